"""Steps of a symmetric composition as machine code, for one scene and one order.

A step of second order is half a step along the velocities, one along the forces there, and half a step along the new
velocities; half steps that follow each other are one. Increments are added with compensation. A symmetric composition
with steps ``g_i h`` has the order 4 if ``sum g_i = 1`` and ``sum g_i^3 = 0``; higher ones ask for more (Hairer, Lubich
and Wanner, Geometric Numerical Integration, section V.3).
"""

from __future__ import annotations

from typing import Final

from atwood.codegen.llvm.build import RoutineSource
from atwood.codegen.routines import ADDRESS, NUMBER, Routine, Value, call_kernel, place_of
from atwood.expr import Program
from atwood.integrators.symplectic.fixed_steps import (
    FILES,
    Layout,
    Memory,
    interpolate,
    judge,
    open_routine,
    run,
    sample,
)
from atwood.integrators.symplectic.stepper import CompiledMethod


def write_routines(layout: Layout, order: int) -> list[Routine]:
    """Write the routines, for a module with forces as ``kernel`` and velocities as ``flow``.

    They are those of `atwood.integrators.symplectic.gauss`, on the same memory.
    """
    parts = [_drift(layout), _kick(layout), _compose(layout, steps_of(order)), _begin(layout)]
    return [*parts, judge(layout), _run(layout), _trial(layout), _speeds(layout), interpolate(layout), sample(layout)]


def _velocities(r: Routine, m: Memory, momenta: Value) -> Value:
    """Write velocities to the F of the main work area."""
    return call_kernel(r, "flow", [momenta], m.derived_2, m.scratch, [m.at("main.F")])


def _add(r: Routine, m: Memory, y: Value, rest: Value, amount: Value, count: int) -> None:
    """Add F times an amount to a half of the state, with what rounding has left."""
    rates = m.at("main.F")
    with r.count(count) as i:
        increment = amount * rates[i]
        total = rest[i] + increment
        old = y[i]
        new = old + total
        y[i], rest[i] = new, (old - new) + total


def _drift(layout: Layout) -> Routine:
    """Move the coordinates along the velocities."""
    r, m, (y, rest, amount) = open_routine(layout, "drift", {"y": ADDRESS, "rest": ADDRESS, "amount": NUMBER})
    r.give_if(_velocities(r, m, y.at(layout.coordinates)) != 0, 1)
    _add(r, m, y, rest, amount, layout.coordinates)
    r.give(0)
    return r


def _kick(layout: Layout) -> Routine:
    """Change the momenta by the forces."""
    arguments = {"y": ADDRESS, "rest": ADDRESS, "t": NUMBER, "amount": NUMBER}
    r, m, (y, rest, t, amount) = open_routine(layout, "kick", arguments)
    n, time = layout.coordinates, place_of(r, t)
    m.evaluations = m.evaluations + 1
    derived, scratch = m.derived, m.scratch
    r.give_if(call_kernel(r, "kernel", [time, y], derived, scratch, [m.at("main.F")]) != 0, 1)
    _add(r, m, y.at(n), rest.at(n), amount, n)
    r.give(0)
    return r


def _compose(layout: Layout, steps: tuple[float, ...]) -> Routine:
    """Take a state one step on, in its place; 1 where there is no force."""
    arguments = {"y": ADDRESS, "rest": ADDRESS, "t": NUMBER, "h": NUMBER}
    r, m, (y, rest, t, h) = open_routine(layout, "compose", arguments)
    before, done = 0.0, 0.0
    for step in (*steps, 0.0):
        share = 0.5 * (before + step)
        r.give_if(r.call("drift", m.session, y, rest, h * share) != 0, 1)
        done, before = done + share, step
        if step == 0.0:
            break
        r.give_if(r.call("kick", m.session, y, rest, t + h * done, h * step) != 0, 1)
    r.give(0)
    return r


def _begin(layout: Layout) -> Routine:
    """Start at the y of a session; 1 where there is no force."""
    r, m, _ = open_routine(layout, "begin", exported=True)
    y, rest, y_old, t = m.at("y"), m.at("rest"), m.at("y_old"), m.t
    with r.count(layout.size) as i:
        rest[i], y_old[i] = 0.0, y[i]
    m.t_old, m.origin, m.since = t, t, 0
    r.give(r.call("kick", m.session, y, rest, t, r.value(0.0, NUMBER)))
    return r


def _run(layout: Layout) -> Routine:
    def attempt(r: Routine, m: Memory, t: Value, h: Value) -> Value:
        r.copy(m.at("y_old"), m.at("y"), layout.size)
        return r.call("compose", m.session, m.at("y"), m.at("rest"), t, h)

    def failed(r: Routine, m: Memory) -> None:
        r.copy(m.at("y"), m.at("y_old"), layout.size)

    return run(layout, attempt, failed=failed)


def _trial(layout: Layout) -> Routine:
    """Make one step of any length from a state to another; 3 where it fails."""
    arguments = {"t": NUMBER, "h": NUMBER, "source": ADDRESS, "target": ADDRESS}
    r, m, (t, h, source, target) = open_routine(layout, "trial", arguments, exported=True)
    rest = m.at("aside.L")
    with r.count(layout.size) as i:
        target[i], rest[i] = source[i], 0.0
    r.give_if(r.call("compose", m.session, target, rest, t, h) != 0, 3)
    r.give(0)
    return r


def _speeds(layout: Layout) -> Routine:
    """Write coordinates and velocities; 1 where there are none."""
    r, m, (_, y, out) = open_routine(layout, "speeds", {"t": NUMBER, "y": ADDRESS, "out": ADDRESS}, exported=True)
    n = layout.coordinates
    r.give_if(_velocities(r, m, y.at(n)) != 0, 1)
    r.copy(out, y, n)
    r.copy(out.at(n), m.at("main.F"), n)
    r.give(0)
    return r


ORDERS: Final = (2, 4, 6, 8)
"""The orders there are."""

_SUZUKI = 1.0 / (4.0 - 4.0 ** (1.0 / 3.0))

_FIRST_HALF = {
    2: (),
    4: (_SUZUKI, _SUZUKI),
    6: (0.39216144400731413928, 0.33259913678935943860, -0.70624617255763935981, 0.08221359629355080023),
    8: (
        *(0.13020248308889008088, 0.56116298177510838456, -0.38947496264484728641, 0.15884190655515560090),
        *(-0.39590389413323757734, 0.18453964097831570709, 0.25837438768632204729, 0.29501172360931029887),
    ),
}
"""Suzuki's five steps of order 4, and of order 6 and 8 the nine and seventeen of Kahan and Li (1997)."""


def steps_of(order: int) -> tuple[float, ...]:
    """Return the steps of a composition, as shares of the whole."""
    half = _FIRST_HALF[order]
    return (*half, 1.0 - 2.0 * sum(half), *half[::-1])


def compiled_composition(forces: Program, velocities: Program, order: int) -> CompiledMethod:
    """Return the equations of a separable H with the steps of a composition.

    Parameters
    ----------
    forces
        Program of (t, q) with p'.
    velocities
        Program of p with q'.
    order
        Of the method, one of `atwood.integrators.symplectic.composition.ORDERS`.
    """
    n = len(forces.inputs[1].symbols)
    layout = Layout(n, n, 1, False, False)
    routines = RoutineSource("integrators.symplectic.composition", FILES, (layout, order))
    return CompiledMethod(routines, {"kernel": forces, "flow": velocities}, order, layout)
