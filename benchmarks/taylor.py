"""The Taylor-series method beside heyoka's: milliseconds for an error, from the same equations.

The double pendulum over 10 s and chains of 10 and 40 links over 1 s, released horizontally at rest, and a free body
that tumbles for 100 s; the error is the largest of the angles (double pendulum), of the tip's position (chains) or of
the quaternion (body) at the end, against a solution at the least tolerance.  heyoka gets Atwood's accelerations,
operation by operation, with numbers for the parameters, in its default mode; for the chain of 40 in its compact one.

At this start only every fourth coefficient of each unknown is there, and heyoka chooses its steps by the last two: at
orders that are multiples of four both are zero, and its first step is far too long.  So its first step is given.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from timing import at_error, best_of, options, peer, print_table, ratio, save

from atwood import assemble, simulate
from atwood.forms.accelerations import acceleration_program
from atwood.integrators.taylor.stepper import CompiledRecurrences
from atwood.simulation.problem.taylor_scene import recurrences
from atwood_library.scenes import Chain, DoublePendulum, FreeBody

TARGETS = (1e-3, 1e-6, 1e-9, 1e-12)
CASES = {
    "double pendulum": (DoublePendulum(), 10.0, False, 0.05),
    "chain of 10": (Chain(links=10), 1.0, False, 0.005),
    "chain of 40": (Chain(links=40), 1.0, True, 0.002),
    "tumbling body": (FreeBody(), 100.0, False, 0.05),
}
"""Scene, end, whether heyoka must be compact to compile it in reasonable time, and its first step."""


def quantities(name: str, places: Any) -> Any:
    """Return what the error is measured of, from the coordinates."""
    if name.startswith("chain"):
        return np.array([np.mean(np.sin(places)), np.mean(np.cos(places))])
    return np.asarray(places)[-4:]


def atwood_run(assembly: Any, t_end: float, rtol: float) -> tuple[float, Any]:
    """Return seconds and the coordinates at the end."""
    result = simulate(assembly, solver="taylor", rtol=rtol, t_end=t_end, outputs=2, samples=1)
    return result.statistics.seconds, result.run.segments[-1].coordinates[:, -1].copy()


def start_of(assembly: Any) -> Any:
    """Return coordinates and speeds at the start."""
    first = simulate(assembly, solver="taylor", t_end=1e-3, outputs=2, samples=1).run.segments[0]
    return np.concatenate([first.coordinates[:, 0], first.speeds[:, 0]]), len(first.coordinates)


def heyoka_system(heyoka: Any, assembly: Any, own: Mapping[int, Any] | None = None) -> list[tuple[Any, Any]]:
    """Return Atwood's accelerations as heyoka's expressions; some parameters, by their places, are its own."""
    program = acceleration_program(assembly).program
    given = {k: float(value) for k, value in enumerate(assembly.parameter_values)} | dict(own or {})
    numbers = dict(zip(program.parameters, given.values(), strict=True))
    _, q, u = (group.symbols for group in program.inputs)
    names = [f"x{i:03d}" for i in range(len(q) + len(u))]
    symbols = dict(zip((*q, *u), heyoka.make_vars(*names), strict=True))
    made: dict[int, Any] = {}
    two = {
        "add": lambda a, b: a + b,
        "sub": lambda a, b: a - b,
        "mul": lambda a, b: a * b,
        "div": lambda a, b: a / b,
    }
    for node in program.nodes:
        if node.is_symbol:
            made[node.index] = symbols[node] if node in symbols else numbers[node]
        elif node.is_constant:
            made[node.index] = float(node.payload)
        else:
            arguments = [made[argument.index] for argument in node.arguments]
            if node.operation in two:
                made[node.index] = two[node.operation](*arguments)
            else:
                one = {"neg": lambda a: -a, "sin": heyoka.sin, "cos": heyoka.cos}[node.operation]
                made[node.index] = one(*arguments)
    results = [made[result.index] for result in program.results]
    rates = results if len(results) == len(q) + len(u) else [*(symbols[v] for v in u), *results]
    return [
        (symbols[v], heyoka.expression(rate) if isinstance(rate, float) else rate)
        for v, rate in zip((*q, *u), rates, strict=True)
    ]


def heyoka_run(integrator: Any, start: Any, count: int, first: float, t_end: float) -> tuple[float, Any]:
    """Return seconds and the coordinates, so many of the state, at the end."""
    integrator.state[:] = start
    integrator.time = 0.0
    began = time.perf_counter()
    integrator.step(max_delta_t=first)
    integrator.propagate_until(t_end)
    return time.perf_counter() - began, integrator.state[:count].copy()


def measure(name: str, chosen: Any) -> dict[str, Any]:
    """Return the points of both, and what it takes until they can begin."""
    scene, t_end, compact, first = CASES[name]
    assembly = assemble(scene)
    best = quantities(name, atwood_run(assembly, t_end, 1e-16)[1])
    tolerances = [10.0**-k for k in ((3, 6) if chosen.quick else range(2, 16))]
    runs: dict[str, dict[float, Callable[[], tuple[float, Any]]]] = {
        "Atwood": {rtol: partial(atwood_run, assembly, t_end, rtol) for rtol in tolerances}
    }
    began = time.perf_counter()
    CompiledRecurrences(recurrences(assembly))
    compiling = {"Atwood, from the cache": time.perf_counter() - began}
    heyoka = peer("heyoka") if not chosen.quick else None
    if heyoka is not None:
        system = heyoka_system(heyoka, assembly)
        start, count = start_of(assembly)
        runs["heyoka"] = {}
        for rtol in tolerances:
            began = time.perf_counter()
            integrator = heyoka.taylor_adaptive(system, start, tol=rtol, compact_mode=compact)
            compiling[f"heyoka at {rtol:g}"] = time.perf_counter() - began
            runs["heyoka"][rtol] = partial(heyoka_run, integrator, start, count, first, t_end)
    points: dict[str, list[tuple[float, float, float]]] = {way: [] for way in runs}
    for rtol in tolerances:
        for listed in runs.values():
            listed[rtol]()  # the first call may compile
        errors = {
            way: float(np.max(np.abs(quantities(name, listed[rtol]()[1]) - best))) for way, listed in runs.items()
        }
        measures = {way: partial(lambda run: run()[0], listed[rtol]) for way, listed in runs.items()}
        for way, seconds in best_of(measures, chosen.repeat).items():
            points[way].append((rtol, errors[way], 1e3 * seconds))
    return {"points": points, "compiling": compiling}


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    chosen = options(__doc__, arguments, scenes=list(CASES))
    results: dict[str, Any] = {}
    for name in ("double pendulum",) if chosen.quick else chosen.scenes:
        found = results[name] = measure(name, chosen)
        at = {
            way: [at_error([(error, ms) for _, error, ms in points], target) for target in TARGETS]
            for way, points in found["points"].items()
        }
        rows: list[list[Any]] = []
        for way, values in at.items():
            rows.append([way, *map(ratio, values, at["Atwood"]), *values])
        head = ["", *(f"x at {t:g}" for t in TARGETS), *(f"ms at {t:g}" for t in TARGETS)]
        print_table(f"{name}: milliseconds at an error, and as many times Atwood", head, rows)
        rows = [
            [way, *points[k]] for k in range(len(found["points"]["Atwood"])) for way, points in found["points"].items()
        ]
        print_table(f"{name}: each tolerance", ["", "tolerance", "error", "ms"], rows)
        print(f"until it can begin, s: {', '.join(f'{k} {v:.3g}' for k, v in list(found['compiling'].items())[:4])}")
    save(chosen.json, results)


if __name__ == "__main__":
    main()
