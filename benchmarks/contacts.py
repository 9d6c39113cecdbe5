"""Contact, impact and friction beside C by hand: order 8(5,3), dense output, events located on it, the same events.

A ball in a box, a mass on a belt, coupled clutches, a block on a slope; an event also in steps of the double pendulum.
Then ratios: contacts far away to none, the first run of eight floors to that of one, and energies for each impact.
"""

from __future__ import annotations

import ctypes
import math
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from ctypes import c_double, c_int, c_long, c_void_p
from functools import partial
from pathlib import Path

import by_hand
import numpy as np
from timing import best_of, options, print_table, save

from atwood import Model, Scene, assemble, simulate
from atwood.integrators.methods.dormand_prince import TABLEAU
from atwood.integrators.stepper import Stepper
from atwood_library import Ground, PointContact, PointMass, Spring
from atwood_library.scenes import Clutches, DoublePendulum, StickSlip

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.helpers.contact_scenes import box_of_walls

RTOL = 1e-10
OF_CONTACTS = 0.01
"""Scenes with contacts run at this share of the tolerance, and so does the C."""


def block() -> Scene:
    """Return a block that slides up a slope and stays."""
    scene, (c, s) = Scene(), (math.cos(0.3), math.sin(0.3))
    ground, mass = scene.add("ground", Ground()), scene.add("m", PointMass(mass=2.0))
    slope = scene.add("c", PointContact(normal=(-s, 0.0, c), friction=0.4))
    scene.connect(ground.frame, slope.plane)
    scene.connect(mass.point, slope.point)
    scene.start.update({"m.position.x": 0.0, "m.position.z": 0.0, "m.velocity.x": c, "m.velocity.z": s})
    return scene


def over_floors(count: int, height: float) -> Scene:
    """Return a mass on a spring over so many floors, the highest of which is so far below."""
    scene = Scene()
    mass = scene.add("m", PointMass(mass=1.0))
    anchor, spring = scene.add("anchor", Ground()), scene.add("spring", Spring(stiffness=20.0, natural_length=1.0))
    scene.connect(anchor.frame, spring.a)
    scene.connect(mass.point, spring.b)
    for i in range(count):
        ground = scene.add(f"ground{i}", Ground(position=(0.0, 0.0, -height - i)))
        floor = scene.add(f"floor{i}", PointContact(normal=(0.1 * i, 0.0, 1.0), friction=0.3))
        scene.connect(ground.frame, floor.plane)
        scene.connect(mass.point, floor.point)
    scene.start.update({"m.position.x": 0.3, "m.position.z": -1.2, "m.velocity.x": 0.0, "m.velocity.z": 0.0})
    return scene


Case = tuple[str, Callable[[], Model], float, list[float], list[int], list[float]]
CASES: tuple[Case, ...] = (
    ("ball in a box", box_of_walls, 432.1, [0.3, 0.2, 1.1, 0.7], [0, 0, 0], []),
    ("mass on a belt", StickSlip, 100.0, [0.0, 0.2], [2, 0, 0], []),
    ("coupled clutches", Clutches, 1.2, [0.0] * 4 + [10.0, 0.0, 0.0, 0.0], [1, 0, 0], [0.4, 0.9]),
    ("block on a slope", block, 1e4, [0.0, 1.0], [1, 0, 0], []),
)
"""Name, scene, end, and for the C its state, what slips and sticks, and the times at which something is switched."""


def method() -> str:
    """Return the pair with its coefficients written out, for the C."""

    def total(weights: object) -> str:
        return " + ".join(f"{weight!r} * k[{row}][i]" for row, weight in dict(weights).items())  # type: ignore[call-overload]

    def stage(number: int, base: str) -> str:
        values = f"EACH z[i] = {base}[i] + h * ({total(TABLEAU.stages[number - 1])});"
        return (
            values if number == TABLEAU.end else f"{values}\nrates(t + h * {TABLEAU.nodes[number]!r}, z, k[{number}]);"
        )

    first = "\n".join(stage(i, "y") for i in range(1, TABLEAU.end + 1))
    more = "\n".join(stage(i, "y").replace("z", "w") for i in range(TABLEAU.end + 1, len(TABLEAU.nodes)))
    rows = "\n".join(f"d[{3 + i}][i] = h * ({total(one)});" for i, one in enumerate(TABLEAU.dense))
    fifth, third = map(total, TABLEAU.errors)
    horner = "\n".join(
        f"v = v * {'(1.0 - x)' if i % 2 else 'x'} + {f'd[{i - 1}][i]' if i else 'y[i]'};"
        for i in reversed(range(TABLEAU.terms))
    )
    end = TABLEAU.end
    return f"""enum {{ END = {end}, STAGES = {len(TABLEAU.nodes)}, TERMS = {TABLEAU.terms} }};
static inline void attempt(double t, double h, const double *y, double k[][SIZE], double *z) {{ {first} }}
static inline double error_of(const double *y, const double *z, double k[][SIZE], double rtol, double atol) {{
double e5 = 0.0, e3 = 0.0;
EACH {{ const double over = 1.0 / (atol + rtol * fmax(fabs(y[i]), fabs(z[i])));
const double a = over * ({fifth}), b = over * ({third}); e5 += a * a; e3 += b * b; }}
return e5 > 0.0 ? e5 / sqrt((e5 + 0.01 * e3) * SIZE) : 0.0; }}
static inline void densify(double t, double h, const double *y, const double *z, double k[][SIZE], double d[][SIZE]) {{
double w[SIZE]; {more}
EACH {{ const double s = z[i] - y[i], a = h * k[0][i], b = h * k[END][i];
d[0][i] = s; d[1][i] = a - s; d[2][i] = 2.0 * s - a - b; {rows} }} }}
static inline void dense(double x, const double *y, double d[][SIZE], double *z) {{
EACH {{ double v = d[TERMS - 1][i]; {horner} z[i] = v; }} }}
"""


def in_c(number: int, case: Case, flags: str, header: Path) -> Callable[[], tuple[float, int]] | None:
    """Return a run in C: seconds and the number of events; None without a compiler."""
    code = by_hand.load("contacts", flags, {"METHOD": f'"{header}"', "SCENE": number})
    if code is None:
        return None
    code.integrate.argtypes = [c_double, c_double, c_double, *[c_void_p] * 4]
    code.integrate.restype = c_long
    _, _, end, start, states, switches = case
    y, taken = np.array(start), c_long()
    times, at_start = np.array([*switches, np.inf]), (c_int * 3)(*states)

    def run() -> tuple[float, int]:
        y[:] = start
        began = time.process_time()
        places = times.ctypes.data, y.ctypes.data, ctypes.addressof(at_start), ctypes.addressof(taken)
        found = code.integrate(end, OF_CONTACTS * RTOL, OF_CONTACTS * RTOL, *places)
        return time.process_time() - began, int(found)

    return run


def seconds(function: Callable[[], object]) -> float:
    """Return the processor time that a call takes."""
    began = time.process_time()
    function()
    return time.process_time() - began


def compiled_seconds(function: Callable[[], object]) -> float:
    """Return the processor time that a call spends in compiled steps: all that begins and ends in machine code."""
    plain, spent = Stepper._call, [0.0]

    def timed(stepper: Stepper, name: str, *given: float) -> int:
        began = time.process_time()
        try:
            return plain(stepper, name, *given)
        finally:
            spent[0] += time.process_time() - began

    Stepper._call = timed  # type: ignore[method-assign]
    try:
        function()
    finally:
        Stepper._call = plain  # type: ignore[method-assign]
    return spent[0]


def ratios(repeat: int) -> list[list[object]]:
    """Return what contacts cost that do nothing, a first run with many, and energies."""
    rows: list[list[object]] = []
    told: dict[str, object] = {"rtol": RTOL, "t_end": 10.0, "outputs": [0.0, 10.0]}
    for form in ("reduced", "dae"):
        none, far = (assemble(over_floors(count, 100.0), form=form) for count in (0, 20))
        spent = best_of(
            {
                key: lambda one=one: seconds(lambda: simulate(one, **told))
                for key, one in (("none", none), ("far", far))
            },
            repeat,
        )
        rows.append([f"20 contacts far away to none ({form}; goal 1.5)", spent["far"] / spent["none"]])
        simulate(over_floors(2, 1.5), form=form, t_end=2.0, rtol=RTOL)  # so that routines are there
        first = partial(simulate, form=form, t_end=2.0, rtol=RTOL)
        one, eight = (seconds(partial(first, over_floors(count, 1.3))) for count in (1, 8))
        rows.append([f"first run of eight floors to one, routines there ({form}; goal 2)", eight / one])
    result = simulate(box_of_walls(), t_end=100.0, rtol=RTOL)
    energies = seconds(lambda: result.energy)
    rows.append(["energies, ms an impact", 1e3 * energies / len(result.events)])
    return rows


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    given = options(__doc__, arguments)
    rows: list[list[object]] = []
    pendulum = assemble(DoublePendulum())
    steps = simulate(pendulum, t_end=10.0, rtol=RTOL).statistics
    step = min(simulate(pendulum, t_end=10.0, rtol=RTOL).statistics.seconds for _ in range(5)) / steps.steps
    with tempfile.TemporaryDirectory() as folder:
        header = Path(folder) / "method.h"
        header.write_text(method(), "utf-8")
        for number, case in enumerate(CASES, 1):
            name, make, end, *_ = case
            end = end if not given.quick else min(end, 2.0)
            written, assembly = in_c(number, (*case[:2], end, *case[3:]), given.cflags, header), assemble(make())
            told: dict[str, object] = {"rtol": RTOL, "t_end": end, "outputs": [0.0, end]}
            events = [one for one in simulate(assembly, **told).events if one.kind != "event"]

            again = partial(simulate, assembly, **told)
            measures = {"ours": partial(seconds, again), "steps": partial(compiled_seconds, again)}
            measures |= {"c": lambda run=written: run()[0]} if written is not None else {}
            spent = best_of(measures, 1 if given.quick else given.repeat)
            count, theirs = max(len(events), 1), written()[1] if written is not None else None
            c = spent.get("c")
            rows.append(
                [
                    *(name, len(events), theirs, 1e3 * spent["ours"], 1e6 * spent["ours"] / count),
                    *((None,) * 3 if c is None else (1e6 * c / count, spent["ours"] / c, spent["steps"] / c)),
                    spent["ours"] / count / step,
                ]
            )
    own = "scene", "events", "in C", "ms", "us an event"
    head = (*own, "C, us an event", "times C", "compiled steps alone", "steps of a pendulum")
    print_table("Events beside C by hand (goals: 3 times C; a reflection 12 steps of the double pendulum)", head, rows)
    more = ratios(1 if given.quick else given.repeat)
    print_table("Contacts that do nothing, first runs, energies", ("what", "ratio"), more)
    save(given.json, {"events": [dict(zip(head, row, strict=True)) for row in rows], "ratios": dict(map(tuple, more))})


if __name__ == "__main__":
    main()
