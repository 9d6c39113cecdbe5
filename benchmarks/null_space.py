"""Closed loops in the reduced form: compiled rows, the same rows as Python callbacks, and scikit-sundae, in one run.

The first two have the same driver, options and choices of dependent coordinates, so they differ in nothing but how
the rows are computed and when the choice is reviewed.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from timing import best_of, options, print_table, ratio, save

from atwood import Scene, simulate
from atwood.integrators.ida import library as sundials_library, native as ida_native
from atwood.integrators.protocol import Budget, SolverOptions, Statistics, Status
from atwood.simulation.problem.preparation import make_problem, pack_state
from atwood.simulation.problem.problem import SceneProblem
from atwood_library import Ground, Link, Pivot
from atwood_library.scenes import FourBar, SliderCrank

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.helpers import scikit_sundae


def row_of_four_bars(windows: int) -> Scene:
    """Return parallelograms side by side, cranks upright (with two of them: IFToMM benchmark A02)."""
    scene = Scene(t_end=10.0)
    before = None
    for i in range(windows + 1):
        ground, pivot = scene.add(f"ground{i}", Ground(position=(float(i), 0.0, 0.0))), scene.add(f"pivot{i}", Pivot())
        crank = scene.add(f"crank{i}", Link(length=1.0, mass=1.0))
        scene.connect(ground.frame, pivot.a)
        scene.connect(pivot.b, crank.a)
        scene.guess[f"crank{i}.angle"] = math.pi / 2.0
        if before is not None:
            coupler = scene.add(f"coupler{i}", Link(length=1.0, mass=1.0))
            left, right = scene.add(f"left{i}", Pivot()), scene.add(f"right{i}", Pivot())
            for one, other in ((before.b, left.a), (left.b, coupler.a), (coupler.b, right.a), (right.b, crank.b)):
                scene.connect(one, other)
            scene.guess[f"coupler{i}.angle"] = 0.0
        before = crank
    del scene.guess["crank0.angle"]
    scene.start.update({"crank0.angle": math.pi / 2.0, "crank0.angular_velocity": -1.0})
    return scene


def rocking() -> Scene:
    """Return a four-bar none of whose links can turn fully: its dependent coordinates change again and again."""
    return FourBar(crank_length=1.0, coupler_length=1.2, rocker_length=1.0, frame_length=2.2)


CASES: dict[str, tuple[Callable[[], Scene], float]] = {
    "four-bar": (FourBar, 10.0),
    "slider-crank": (SliderCrank, 10.0),
    "four-bar that rocks": (rocking, 10.0),
    "two four-bars (A02)": (lambda: row_of_four_bars(2), 10.0),
    "ten four-bars": (lambda: row_of_four_bars(10), 2.0),
}


def runs_of(scene: Scene, t_end: float, rtol: float) -> dict[str, Callable[[], tuple[Statistics, SceneProblem]]]:
    """Return what runs each of the three."""
    first = simulate(scene, solver="ida", t_end=t_end, rtol=1e-4, outputs=2, samples=1).run
    segment, length = first.segments[0], first.start.length
    q, u = segment.coordinates[:, 0], segment.speeds[:, 0]

    def prepared() -> tuple[SceneProblem, SolverOptions, Any, Any]:
        plan = make_problem(segment.assembly, 0.0, q, u, length, t_end)
        settings = SolverOptions(relative_tolerance=rtol, absolute_tolerances=plan.tolerances(rtol, {}), horizon=t_end)
        return plan, settings, *pack_state(plan, 0.0, q, u)

    def native(compiled: bool) -> tuple[Statistics, SceneProblem]:
        plan, settings, y, yp = prepared()
        tuning = ida_native.IdaTuning(angle_like=plan.angles)
        problem = plan.problem() if compiled else replace(plan.problem(), native=None)
        budget = None if compiled else Budget(poll=plan.between_steps)
        with ida_native.open_session(problem, settings, 0.0, y, yp, budget, tuning) as session:
            if session.advance(t_end).status is not Status.REACHED:
                raise SystemExit("a run did not reach its end")
            return session.statistics, plan

    def sundae() -> tuple[Statistics, SceneProblem]:
        plan, settings, y, yp = prepared()
        session = scikit_sundae.open_session(plan.problem(), settings, 0.0, y, yp, Budget(poll=plan.between_steps))
        return (session.advance(t_end) and session.statistics), plan

    return {"compiled": lambda: native(True), "Python": lambda: native(False), "sundae": sundae}


def measure(name: str, rtol: float, repeat: int) -> dict[str, Any]:
    """Time one scene at one tolerance."""
    make, t_end = CASES[name]
    seen: dict[str, tuple[int, int]] = {}

    def timed(key: str, run: Callable[[], tuple[Statistics, SceneProblem]]) -> Callable[[], float]:
        def once() -> float:
            statistics, plan = run()
            seen[key] = (statistics.steps, plan.switches)
            return statistics.seconds

        return once

    seconds = best_of({key: timed(key, run) for key, run in runs_of(make(), t_end, rtol).items()}, repeat)
    return {"case": name, "rtol": rtol, "seconds": seconds, "steps and switches": seen}


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    chosen = options(__doc__, arguments)
    if not sundials_library.available():
        print(f"nothing to measure: {sundials_library.why_not()}")
        return
    names = list(CASES)[: 1 if chosen.quick else None]
    tolerances = (1e-6,) if chosen.quick else (1e-6, 1e-8)
    found = [measure(name, rtol, chosen.repeat) for name in names for rtol in tolerances]
    rows = []
    for one in found:
        seconds, seen = one["seconds"], one["steps and switches"]
        each = {key: 1e6 * seconds[key] / seen[key][0] for key in seconds}
        rows.append(
            [
                one["case"],
                f"{one['rtol']:g}",
                ratio(seconds["Python"], seconds["compiled"]),
                ratio(seconds["sundae"], seconds["compiled"]),
                *(each[key] for key in seconds),
                *(seen[key][0] for key in seconds),
                seen["compiled"][1],
            ]
        )
    head = ["reduced form", "rtol", "Python / compiled", "sundae / compiled", "us/step", "Python us", "sundae us"]
    print_table("Closed loops", [*head, "steps", "Python steps", "sundae steps", "changes"], rows)
    save(chosen.json, found)


if __name__ == "__main__":
    main()
