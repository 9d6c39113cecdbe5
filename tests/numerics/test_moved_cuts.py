"""Ranks that callers once decided by cuts of their own, on scenes that are hard for them: the same ranks as before.

Each of these callers compared singular values with a number of its own. Now it says how far its rows may be off, and
`atwood.numerics` decides. On what the library's scenes, the hard cases and all tests of theory ask, the smallest value
that is kept and the largest that is dropped, relative to the largest, are at least so far apart:

==========================================  ==========  =======  ========
caller                                      cut before  kept     dropped
==========================================  ==========  =======  ========
`consistency.joints`                        1e-5        6e-1     0
`mechanics.constraints.frobenius`           1e-9 of 1   9e-2     0
`mechanics.constraints.pfaffian`            1e-9 of 1   1e-1     0
`conservation.invariance`                   1e-8        1e-6     5e-10
`linear.modes`, what has no frequency       1e-10       3e-3     0
`linear.steady`                             1e-8        7e-3     1e-11
`symmetry`, where the start moves           1e-11       3e-7     6e-17
`symmetry`, what is free there              1e-9        2e-8     4e-14
least-norm solutions with cuts of
1e-10 to 1e-13, or none: `find`, `proof`,
`continuation`, `trim`, `start_solution`    1e-9 now    3e-5     0
==========================================  ==========  =======  ========
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
import pytest

from atwood import UsageError, conserved, equilibria, linearize, normal_modes, report, simulate
from atwood.numerics import rank as ranks
from atwood_library.scenes import SCENES

Cut = Callable[[np.ndarray], float]

BEFORE: dict[str, Cut] = {
    "_rank": lambda values: 1e-5 * values[0],
    "_vanishes": lambda _: 1e-9,
    "_combinations": lambda _: 1e-9,
    "_candidates": lambda values: 1e-11 * values[0],
    "_place": lambda values: 1e-9 * values[0],
    "_speeds": lambda values: 1e-9 * values[0],
    "_damped": lambda values: 1e-10 * values[0],
    "_symmetric": lambda values: 1e-8 * values[0],
    "conserved_directions": lambda values: 1e-8 * values[0],
}
"""The least singular value that each function kept before, from all of them."""

BEFORE_OF_SOLUTIONS = {
    "_speeds": 1e-10,
    "_corrected": 1e-13,
    "find_steady": 1e-10,
    "_fit": 1e-12,
    "_is_known": 1e-10,
    "_impulses": 1e-11,
}
"""The same of least-norm solutions, relative to the largest."""


def caller() -> str:
    """The function outside of the numerics that asks."""
    frame = sys._getframe(2)
    while (
        not frame.f_globals["__name__"].startswith("atwood.")
        or frame.f_globals["__name__"].startswith(("atwood.numerics", "atwood.clock"))
        or frame.f_code.co_name.startswith("<")
    ):
        assert frame.f_back is not None
        frame = frame.f_back
    return frame.f_code.co_name


@pytest.fixture
def decided(monkeypatch: pytest.MonkeyPatch) -> dict[str, list[tuple[int, int]]]:
    """What each caller's matrices had for ranks before, and have now."""
    found: dict[str, list[tuple[int, int]]] = {}
    significant, lstsq = ranks.significant, np.linalg.lstsq

    def decide(values: np.ndarray, errors: ranks.Errors = None) -> np.ndarray:
        kept, name = significant(values, errors), caller()
        if name in BEFORE and values.ndim == 1 and len(values) and values[0] > 0.0:
            found.setdefault(name, []).append((int(np.sum(values > BEFORE[name](values))), int(np.sum(kept))))
        return kept

    def solve(matrix: np.ndarray, right: np.ndarray, rcond: float | None = None) -> Any:
        solved, name = lstsq(matrix, right, rcond=rcond), caller()
        if name in BEFORE_OF_SOLUTIONS and len(solved[3]) and solved[3][0] > 0.0:
            before = int(np.sum(solved[3] > BEFORE_OF_SOLUTIONS[name] * solved[3][0]))
            found.setdefault(f"solution in {name}", []).append((before, int(solved[2])))
        return solved

    monkeypatch.setattr(ranks, "significant", decide)
    monkeypatch.setattr(np.linalg, "lstsq", solve)
    return found


@pytest.mark.parametrize(
    ("scene", "ask", "callers"),
    [
        ("bricard", report, set()),  # whose joints are checked once in a process
        ("rolling-disc", report, {"_combinations"}),
        ("benchmark-bicycle", report, {"_vanishes"}),
        ("rigid-bodies", report, {"_place", "_speeds", "solution in _speeds"}),
        ("spherical-pendulum", conserved, {"conserved_directions", "solution in _fit"}),
        ("n-body", conserved, {"conserved_directions", "solution in _is_known"}),
        ("lagrange-top", linearize, {"_symmetric", "solution in find_steady"}),
        ("rolling-ball", linearize, {"_symmetric"}),
        ("double-pendulum", normal_modes, set()),
        ("quarter-car", normal_modes, set()),
        ("double-cardan-twice", lambda scene: simulate(scene, t_end=0.05, outputs=3), set()),
        ("rotating-hoop-free", equilibria, set()),
    ],
)
def test_ranks_are_what_they_were(
    scene: str, ask: Callable[[Any], Any], callers: set[str], decided: dict[str, list[tuple[int, int]]]
) -> None:
    with suppress(UsageError):  # of states that are not steady, which is decided first
        ask(SCENES[scene]())
    moved = {name: [one for one in pairs if one[0] != one[1]] for name, pairs in decided.items()}
    assert not any(moved.values()), moved
    assert set(decided) >= callers, sorted(decided)
