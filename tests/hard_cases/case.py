"""A hard case: a scene, the ways in which it is solved, and how far each is from what is known."""

from __future__ import annotations

import re
import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from atwood import Model, simulate
from atwood.errors import AtwoodError

BOTH: Mapping[str, Mapping[str, Any]] = {"reduced": {"form": "reduced"}, "dae": {"form": "dae"}}
REDUCED: Mapping[str, Mapping[str, Any]] = {"reduced": {"form": "reduced"}}

KINDS = (
    "index and drift",
    "fast and stiff",
    "singular positions",
    "redundancy",
    "coordinates",
    "separatrices and chaos",
    "scales",
    "large",
    "non-smooth",
    "starts",
    "long",
    "driven",
    "at rest",
)
"""In the order of the page."""


@dataclass(frozen=True)
class Case:
    """A hard case.

    Attributes
    ----------
    name, kind
        What it is called, and where it belongs on the page.
    hard, better
        What is hard about it, and which form is better and why.
    source
        Where the answer comes from, and what is known of it.
    scene
        Makes the scene.
    asked
        The largest error that is allowed, with its meaning.
    error
        How far a run is from the answer, in the terms of `asked`; of a case that is refused, nothing.
    options
        What `simulate` is given in every way.
    ways
        What it is given besides, by name.
    limits
        What is asked of ways of which less is asked.
    refused
        What the message says with which every way is refused; empty where it runs.
    run
        What is called with the scene and all options.
    quick
        Whether all ways together take about a second or less.
    """

    name: str
    kind: str
    hard: str
    better: str
    source: str
    scene: Callable[[], Model]
    asked: tuple[float, str]
    error: Callable[[Any], float] = lambda result: 0.0
    options: Mapping[str, Any] = field(default_factory=dict)
    ways: Mapping[str, Mapping[str, Any]] = field(default_factory=lambda: BOTH)
    limits: Mapping[str, float] = field(default_factory=dict)
    refused: str = ""
    run: Callable[..., Any] = simulate
    quick: bool = True

    def limit(self, way: str) -> float:
        """Return the largest error that is allowed of a way."""
        return self.limits.get(way, self.asked[0])


@dataclass(frozen=True)
class Reached:
    """What one way reaches.

    Attributes
    ----------
    way
        Its name.
    error
        How far it is from the answer; infinite for a run that should have been refused, or was.
    steps, solver, status
        Of the run; for a refusal no steps, and what was said.
    seconds
        With assembling and compiling.
    """

    way: str
    error: float
    steps: int
    seconds: float
    status: str
    solver: str


def solve(case: Case, way: str) -> Reached:
    """Solve a case in one of its ways."""
    begun = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            result = case.run(case.scene(), **{**case.options, **case.ways[way]})
        except AtwoodError as error:
            said = str(error)
            fits = bool(case.refused) and re.search(case.refused, said) is not None
            return Reached(way, 0.0 if fits else float("inf"), 0, time.perf_counter() - begun, said, "refused")
        error = float("inf") if case.refused else float(case.error(result))
    seconds = time.perf_counter() - begun
    if not hasattr(result, "run"):
        return Reached(way, error, 0, seconds, "finished", "-")
    return Reached(way, error, result.statistics.steps, seconds, result.status, result.run.solver)
