"""Chains of 1,000 and 10,000 links and a net of 50 by 50 masses, beside C by hand and other packages.

What is told: seconds until a run can begin, milliseconds of its integration, evaluations of the accelerations (steps of
those with fixed steps), nanoseconds of one for each body, and the error at the end, against the C at a tolerance of
1e-12. Chains are let go level, the net falls a little; both by explicit methods.
"""

from __future__ import annotations

import gc
import resource
import time
from collections.abc import Callable, Sequence
from ctypes import c_double, c_long, c_void_p
from dataclasses import dataclass
from typing import Any

import by_hand
import numpy as np
import peer_runs
from mechanisms import FloatArray, Mechanism, chain
from timing import options, peer, print_table, save

from atwood import Scene, assemble, simulate
from atwood_library import Ground, PointMass, Spring

STIFFNESS, TOLERANCE = 200.0, 1e-6


@dataclass(frozen=True)
class Work:
    """Many bodies.

    Attributes
    ----------
    bodies, t_end
        How many, and the end, s.
    scene, paths
        Atwood's, and what is compared of it at the end.
    defines, parameters, start
        The C by hand.
    place
        What is compared, from the coordinates of the C.
    mechanism
        The chain as other benchmarks have it, for other packages.
    """

    bodies: int
    t_end: float
    scene: Callable[[], Any]
    paths: tuple[str, ...]
    defines: dict[str, object]
    parameters: FloatArray
    start: FloatArray
    place: Callable[[FloatArray], FloatArray]
    mechanism: Mechanism | None = None


def chain_work(links: int, t_end: float) -> Work:
    """Return a chain of links of length and mass 1/N."""
    made, l = chain(links), 1.0 / links
    tip = f"bob[{links - 1}].position"
    return Work(
        links,
        t_end,
        lambda: made.scene,
        (f"{tip}.x", f"{tip}.z"),
        {"MECHANISM": '"chain.c"', "LINKS": links},
        np.array([l] * links + [1.0 / l] * (2 * links) + [9.81]),
        np.concatenate([made.angles_at_start(), np.zeros(links)]),
        made.from_angles,
        Mechanism(made.name, made.scene, links, l, l, t_end),
    )


def net(side: int) -> Scene:
    """Return a net of masses on springs, hung up at its upper edge and stretched a little."""
    scene, gap = Scene(t_end=0.2), 1.0 / side
    masses = {(i, j): scene.add(f"m{i}_{j}", PointMass(mass=gap)) for i in range(side) for j in range(side)}

    def tie(name: str, a: Any, b: Any) -> None:
        spring = scene.add(name, Spring(stiffness=STIFFNESS, natural_length=gap))
        scene.connect(a, spring.a)
        scene.connect(spring.b, b)

    for (i, j), mass in masses.items():
        if i == 0:
            ground = scene.add(f"g{j}", Ground(position=(j * gap, 0.0, 0.0)))
            tie(f"s{j}", ground.frame, mass.point)
        for name, other in (("right", (i, j + 1)), ("down", (i + 1, j))):
            if other in masses:
                tie(f"{name}{i}_{j}", mass.point, masses[other].point)
        for axis, value in (("x", j * gap), ("z", -(i + 1) * 1.05 * gap)):
            scene.start.update({f"m{i}_{j}.position.{axis}": value, f"m{i}_{j}.velocity.{axis}": 0.0})
    return scene


def net_work(side: int, t_end: float) -> Work:
    """Return a net of masses."""
    gap, n = 1.0 / side, side * side
    places = np.array([[j * gap, -(i + 1) * 1.05 * gap] for i in range(side) for j in range(side)])
    last = f"m{side - 1}_{side - 1}.position"
    return Work(
        n,
        t_end,
        lambda: net(side),
        (f"{last}.x", f"{last}.z"),
        {"MECHANISM": '"net.c"', "ROWS": side, "COLUMNS": side},
        np.array([gap, STIFFNESS, gap, 9.81]),
        np.concatenate([places.ravel(), np.zeros(2 * n)]),
        lambda q: q[2 * n - 2 : 2 * n],
    )


CASES: dict[str, Callable[[], Work]] = {
    "chain of 1,000": lambda: chain_work(1000, 0.01),
    "net of 50 by 50": lambda: net_work(50, 0.2),
    "chain of 10,000": lambda: chain_work(10_000, 0.001),
}


def c_run(work: Work, flags: str) -> Callable[[float], tuple[float, int, FloatArray]]:
    """Return what makes a run in C: seconds, evaluations, and what is compared."""
    code = by_hand.load("explicit", flags, work.defines)
    if code is None:
        raise SystemExit("no C compiler")
    integrate = code.integrate
    integrate.argtypes = [c_double, c_double, c_double, c_void_p, c_void_p, c_void_p]
    p, counts = work.parameters, np.zeros(3, dtype=c_long)

    def run(tolerance: float) -> tuple[float, int, FloatArray]:
        y = work.start.copy()
        began = time.perf_counter()
        failed = integrate(work.t_end, tolerance, tolerance, p.ctypes.data, y.ctypes.data, counts.ctypes.data)
        spent = time.perf_counter() - began
        if failed:
            raise SystemExit("the run by hand failed")
        return spent, int(counts[2]), work.place(y)

    run.keep = code  # type: ignore[attr-defined]
    return run


def atwood_run(work: Work) -> tuple[float, Callable[[], tuple[float, int, FloatArray]]]:
    """Return seconds until a run can begin, and what makes one."""
    began = time.perf_counter()
    assembly = assemble(work.scene(), form="reduced")

    def run() -> tuple[float, int, FloatArray]:
        how: dict[str, Any] = {"t_end": work.t_end, "rtol": TOLERANCE, "outputs": 2, "samples": 1}
        result = simulate(assembly, solver="explicit", **how)
        place = np.array([result[path][-1] for path in work.paths])
        return result.statistics.seconds, result.statistics.residual_evaluations, place

    run()
    return time.perf_counter() - began, run


def others(work: Work) -> dict[str, tuple[float, int, Callable[[], tuple[float, FloatArray]]]]:
    """Return the runs of other packages with fixed steps: seconds to set up, steps, and what makes one."""
    found: dict[str, tuple[float, int, Callable[[], tuple[float, FloatArray]]]] = {}
    if work.mechanism is None or work.bodies > 2000:
        return found
    ways = (("exudyn", "Exudyn, RK67", peer_runs.exudyn_run, 20), ("mujoco", "MuJoCo, RK4", peer_runs.mujoco_run, 50))
    for name, title, make, steps in ways:
        if module := peer(name):
            began = time.perf_counter()
            try:
                run = make(module, work.mechanism, steps)
                run()
            except (ArithmeticError, ValueError) as error:
                print(f"{title}: {str(error).splitlines()[-1]}")
                continue
            found[title] = time.perf_counter() - began, steps, run
    return found


def measure(work: Work, flags: str, repetitions: int, quick: bool) -> dict[str, list[float]]:
    """Return the row of each side."""
    by_c = c_run(work, flags)
    exact = by_c(1e-12)[2]
    prepared, by_atwood = atwood_run(work)
    rows: dict[str, list[float]] = {}
    peers = {} if quick else others(work)
    for _ in range(repetitions):
        runs = {"C by hand": (0.0, *by_c(TOLERANCE)), "Atwood explicit": (prepared, *by_atwood())}
        for title, (set_up, steps, run) in peers.items():
            spent, place = run()
            runs[title] = set_up, spent, steps, place
        for title, (set_up, spent, count, place) in runs.items():
            cost = [set_up, 1e3 * spent, count, 1e9 * spent / count / work.bodies, float(np.max(np.abs(place - exact)))]
            if title not in rows or cost[1] < rows[title][1]:
                rows[title] = cost
    return rows


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    chosen = options(__doc__, arguments, scenes=list(CASES))
    cases = {"chain of 50": lambda: chain_work(50, 0.05)} if chosen.quick else {n: CASES[n] for n in chosen.scenes}
    results = {}
    for name, make in cases.items():
        rows = results[name] = measure(make(), chosen.cflags, chosen.repeat, chosen.quick)
        head = ["", "until it can begin, s", "ms", "evaluations or steps", "ns, each body", "error, m"]
        print_table(f"{name}, rtol {TOLERANCE:g}", head, [[side, *row] for side, row in rows.items()])
        print(f"memory so far: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
        gc.collect()
    save(chosen.json, results)


if __name__ == "__main__":
    main()
