"""A hard case: a scene, the ways in which it is solved, and how far each is from what is known."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from atwood import Result, Scene, simulate

BOTH: Mapping[str, Mapping[str, Any]] = {"reduced": {"form": "reduced"}, "dae": {"form": "dae"}}


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
        Where the answer comes from.
    scene
        Makes the scene.
    error
        How far a run is from the answer, in the terms of `asked`.
    asked
        The largest error that is allowed, with its meaning.
    options
        What `simulate` is given in every way.
    ways
        What it is given besides, by name.
    quick
        Whether it takes less than a second.
    """

    name: str
    kind: str
    hard: str
    better: str
    source: str
    scene: Callable[[], Scene]
    error: Callable[[Result], float]
    asked: tuple[float, str]
    options: Mapping[str, Any] = field(default_factory=dict)
    ways: Mapping[str, Mapping[str, Any]] = field(default_factory=lambda: BOTH)
    quick: bool = True


@dataclass(frozen=True)
class Reached:
    """What one way reaches."""

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
        result = simulate(case.scene(), **{**case.options, **case.ways[way]})
    return Reached(
        way,
        float(case.error(result)),
        result.statistics.steps,
        time.perf_counter() - begun,
        result.status,
        result.run.solver,
    )
