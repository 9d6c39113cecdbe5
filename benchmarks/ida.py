"""Time per step of IDA: Atwood's equations, C by hand in the same driver, and scikit-sundae with Python callbacks.

All solve the stabilised DAE form with the same start, tolerances and shared library.  Atwood and the C by hand also
have the same driver and options, so they take the same steps but for rounding.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import by_hand
import numpy as np
from timing import best_of, options, print_table, ratio, save

from atwood import Model, simulate
from atwood.kernels.llvm_ida_text import sundials_layout
from atwood.solve import ida_native
from atwood.solve.driver import ImplicitProblem, NativeCallbacks, SolverOptions, Statistics, Status
from atwood.solve.problem import Plan, pack_state
from atwood_library.scenes import Chain, DoublePendulum, SimplePendulum


def scenes(quick: bool) -> list[tuple[str, Model, int, float]]:
    """Return name, scene, number of links and end of each case."""
    found: list[tuple[str, Model, int, float]] = [("pendulum", SimplePendulum(), 1, 10.0)]
    if not quick:
        found.append(("double pendulum", DoublePendulum(), 2, 10.0))
        found.append(("chain of 10", Chain(links=10, mass=0.1), 10, 1.0))
    return found


def hand_problem(plan: Plan, links: int, flags: str) -> ImplicitProblem | None:
    """Return the problem with the functions by hand instead of the compiled ones; None without a compiler."""
    layout = sundials_layout()
    defines = {
        "LINKS": links,
        "VECTOR_DATA": layout.vector_data,
        "DENSE_DATA": layout.dense_data,
        "SPARSE_DATA": layout.sparse_data,
        "SPARSE_VALUES": layout.sparse_values,
        "SPARSE_POINTERS": layout.sparse_pointers,
        "INDEX": "int" if layout.index_bytes == 4 else "int64_t",
    }
    library = by_hand.load("ggl_chain", flags, defines)
    if library is None:
        return None
    made = plan.problem()
    rows, columns = np.zeros((2, 36 * links), dtype=np.int32)
    count = library.prepare(ctypes.c_void_p(rows.ctypes.data), ctypes.c_void_p(columns.ctypes.data))
    pattern = (rows[:count].astype(np.intp), columns[:count].astype(np.intp))
    if not all(np.array_equal(a, b) for a, b in zip(pattern, made.pattern, strict=True)):
        raise SystemExit("the Jacobian by hand has other entries than Atwood's")
    values = plan.assembly.parameter_values
    if links == 2:
        values = values[[0, 2, 1, 3, 4]]
    values = np.array(values)

    def address(name: str) -> int:
        return ctypes.cast(library[name], ctypes.c_void_p).value or 0

    def native(linear_solver: Any) -> NativeCallbacks:
        jacobian = "ida_sparse" if linear_solver == "sparse" else "ida_dense"
        return NativeCallbacks(address("ida_residual"), address(jacobian), values.ctypes.data, keep=(library, values))

    return replace(made, native=native)


def measures_of(scene: Model, links: int, t_end: float, rtol: float, flags: str) -> dict[str, Callable[[], Statistics]]:
    """Return what runs each of the three."""
    arguments: dict[str, Any] = {"form": "dae", "t_end": t_end, "rtol": rtol, "outputs": 2, "samples": 1}
    first = simulate(scene, solver="ida", **arguments)
    plan = first.run.segments[0].plan
    segment = first.run.segments[0]
    q, u = segment.coordinates[:, 0], segment.speeds[:, 0]
    y, yp = pack_state(plan, 0.0, q, u)
    settings = SolverOptions(relative_tolerance=rtol, absolute_tolerances=plan.tolerances(rtol), horizon=t_end)

    def session(problem: ImplicitProblem) -> Callable[[], Statistics]:
        def run() -> Statistics:
            with ida_native.open_session(problem, settings, 0.0, y, yp, None, ida_native.IdaTuning()) as made:
                if made.advance(t_end).status is not Status.REACHED:
                    raise SystemExit("a run did not reach its end")
                return made.statistics

        return run

    found = {"atwood": session(plan.problem())}
    hand = hand_problem(plan, links, flags)
    if hand is not None:
        found["hand"] = session(hand)
    found["simulate"] = lambda: simulate(scene, solver="ida", **arguments).statistics
    found["sundae"] = lambda: simulate(scene, solver="ida-sundae", **arguments).statistics
    return found


def measure(name: str, scene: Model, links: int, t_end: float, rtol: float, chosen: Any) -> dict[str, Any]:
    """Time one scene at one tolerance."""
    runs = measures_of(scene, links, t_end, rtol, chosen.cflags)
    steps: dict[str, int] = {}

    def timed(key: str, run: Callable[[], Statistics]) -> Callable[[], float]:
        def once() -> float:
            statistics = run()
            steps[key] = statistics.steps
            return statistics.seconds

        return once

    fast = {key: timed(key, run) for key, run in runs.items() if key != "sundae"}
    slow = {"sundae": timed("sundae", runs["sundae"])}
    seconds = best_of(fast, 3 * chosen.repeat) | best_of(slow | {"atwood again": fast["atwood"]}, min(chosen.repeat, 3))
    seconds["atwood"] = min(seconds["atwood"], seconds.pop("atwood again"))
    return {"case": name, "rtol": rtol, "seconds": seconds, "steps": steps}


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    chosen = options(__doc__, arguments)
    if not ida_native.available():
        print(f"nothing to measure: {ida_native.why_not()}")
        return
    if by_hand.compiler() is None:
        print("no C compiler: nothing by hand to compare with")
    found = [
        measure(name, scene, links, t_end, rtol, chosen)
        for name, scene, links, t_end in scenes(chosen.quick)
        for rtol in ((1e-6,) if chosen.quick else (1e-4, 1e-6, 1e-8))
    ]
    table = []
    for row in found:
        seconds, steps = row["seconds"], row["steps"]
        each = {key: 1e6 * seconds[key] / steps[key] for key in seconds}
        table.append(
            [
                row["case"],
                f"{row['rtol']:g}",
                ratio(each["atwood"], each.get("hand")),
                ratio(seconds["sundae"], seconds["simulate"]),
                each["atwood"],
                each.get("hand"),
                each["sundae"],
                steps["atwood"],
                steps.get("hand"),
                steps["sundae"],
                1e3 * seconds["simulate"],
            ]
        )
    head = ["scene, dae ggl", "rtol", "Atwood / C", "sundae / Atwood", "Atwood us/step", "C us/step", "sundae us/step"]
    head += ["Atwood steps", "C steps", "sundae steps", "Atwood run ms"]
    print_table(f"IDA; C with {chosen.cflags}", head, table)
    save(chosen.json, found)


if __name__ == "__main__":
    main()
