"""Steps of the methods of Gauss, for one set of equations and one order.

Stages are found by fixed-point iteration, each with those before it that are known already, from what the polynomial of
the last step gives; it ends where changes are rounding, since what is left of the iteration's error would not be
symplectic. Increments are added with compensation (Hairer, Lubich and Wanner, Geometric Numerical Integration, sections
VIII.5 and VIII.6).

Coefficients of the methods of Gauss, correctly rounded.

Collocation at the zeros of the shifted Legendre polynomial of degree s has the order 2s, is symmetric and symplectic
(Hairer, Lubich and Wanner, Geometric Numerical Integration, sections II.1.3 and VI.4.1). It is symplectic since
``b_i a_ij + b_j a_ji = b_i b_j``; with ``m_ij = a_ij/b_j`` that is ``m_ij + m_ji = 1``, which holds exactly for
floating-point numbers too where ``m_ij`` is taken as one less ``m_ji`` (Antonana, Makazaga and Murua, Numerical
Algorithms 76, 2017).
"""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal, localcontext
from functools import cache, reduce
from math import inf
from operator import add
from typing import NamedTuple

from atwood.codegen.routines import ADDRESS, CODE, INTEGER, NUMBER, Routine, Value, call_kernel, place_of
from atwood.integrators.symplectic.fixed_steps import (
    Layout,
    Memory,
    interpolate,
    judge,
    open_routine,
    run,
    sample,
)

_ULP = 2.0**-53
_ROUNDING, _IDLE, _SWEEPS = 1e-11, 3, 200
"""Changes of this share of the sizes that so many sweeps do not make smaller are rounding; and the most sweeps."""

_NEWTON = 6
"""So many steps of Newton's method find speeds that the equations take as a guess, from near by."""

_STEP = {"w": ADDRESS, "y": ADDRESS, "t": NUMBER, "h": NUMBER}


def write_routines(layout: Layout, order: int) -> list[Routine]:
    """Write the routines of a method, for a module with the equations as ``kernel``.

    They take a session's array, which `atwood.integrators.symplectic.fixed_steps` lays out.
    """
    method = tableau(order)
    parts = [_evaluate(layout), *(_stage(layout, method, j) for j in range(layout.stages)), _solve(layout)]
    parts += [_flat(layout, method), _ahead(layout, method), _advance(layout), _speeds(layout), _begin(layout)]
    return [*parts, judge(layout), _run(layout), _trial(layout), interpolate(layout), sample(layout)]


def _weighted(weights: Sequence[float], values: Sequence[Value]) -> Value:
    return reduce(add, [weight * value for weight, value in zip(weights, values, strict=True)])


def _evaluate(layout: Layout) -> Routine:
    """Evaluate the equations at the Y of a work area: F, and speeds from those at `guess`."""
    r, m, (w, t, guess) = open_routine(layout, "evaluate", {"w": ADDRESS, "t": NUMBER, "guess": ADDRESS})
    n, time = layout.coordinates, place_of(r, t)
    y, f, v = (w.at(layout.within(key)) for key in ("Y", "F", "V"))
    inputs = [time, y, y.at(n), guess][: 4 if layout.takes_speeds else 3]
    outputs = [f, f.at(n), v][: 3 if layout.has_speeds else 2]
    m.evaluations = m.evaluations + 1
    r.give(call_kernel(r, "kernel", inputs, m.derived, m.scratch, outputs))
    return r


def _stage(layout: Layout, method: Tableau, j: int) -> Routine:
    """Improve one stage; its largest change goes to `delta`, in units of what values were.

    In units of the scene's sizes it goes to `coarse`: a value that should be zero is rounding for ever.
    """
    arguments = {**_STEP, "delta": ADDRESS, "coarse": ADDRESS}
    r, m, (w, y, t, h, delta, coarse) = open_routine(layout, f"stage{j}", arguments)
    n, increments = layout.size, w.at(j * layout.size)
    place, f, scales = (w.at(layout.within(key)) for key in ("Y", "F", "scale"))
    guess, per_size = w.at(layout.within("U") + j * layout.speeds), m.at("per_size")
    with r.count(n) as i:
        place[i] = y[i] + _weighted(method.shares[j], [w[i + k * n] for k in range(layout.stages)])
    r.give_if(r.call("evaluate", m.session, w, t + h * method.nodes[j], guess) != 0, 1)
    weight = h * method.weights[j]
    with r.count(n) as i:
        new, old = weight * f[i], increments[i]
        increments[i] = new
        change, scale = r.size(new - old), r.most(r.size(place[i]), scales[i])
        scales[i] = scale
        delta[0] = r.most(r.choose(change == 0.0, 0.0, change / scale), delta[0])
        coarse[0] = r.most(change * per_size[i], coarse[0])
    if layout.takes_speeds:
        r.copy(guess, w.at(layout.within("V")), layout.speeds)
    r.give(0)
    return r


def _solve(layout: Layout) -> Routine:
    """Find the stages of a step; 1 where they are not found."""
    r, m, (w, y, t, h) = open_routine(layout, "solve", _STEP)
    delta, coarse, best, idle = r.array(1), r.array(1), r.variable(inf), r.variable(0, INTEGER)
    with r.count(_SWEEPS):
        delta[0], coarse[0] = 0.0, 0.0
        for j in range(layout.stages):
            r.give_if(r.call(f"stage{j}", m.session, w, y, t, h, delta, coarse) != 0, 1)
        now = delta[0]
        r.give_if(now <= _ULP, 0)
        better = now < best.now
        idle.now = r.choose(better, 0, idle.now + 1, INTEGER)
        best.now = r.choose(better, now, best.now)
        r.give_if((idle.now >= _IDLE) & (coarse[0] <= _ROUNDING), 0)
    r.give(1)
    return r


def _flat(layout: Layout, method: Tableau) -> Routine:
    """Set all stages to the rates at `y`; 1 where there are none."""
    r, m, (w, y, t, h) = open_routine(layout, "flat", _STEP)
    f = w.at(layout.within("F"))
    r.copy(w.at(layout.within("Y")), y, layout.size)
    last = w.at(layout.within("U") + (layout.stages - 1) * layout.speeds)
    r.give_if(r.call("evaluate", m.session, w, t, last) != 0, 1)
    with r.count(layout.size) as i:
        increment = h * f[i]
        for j, weight in enumerate(method.weights):
            w[i + j * layout.size] = increment * weight
    r.give(0)
    return r


def _ahead(layout: Layout, method: Tableau) -> Routine:
    """Take the stages of a step on to the next one."""
    r = Routine("ahead", {"w": ADDRESS}, result=None)
    (w,) = r.arguments
    with r.count(layout.size) as i:
        places = [i + k * layout.size for k in range(layout.stages)]
        old = [w[place] for place in places]
        for place, weights in zip(places, method.ahead, strict=True):
            w[place] = _weighted(weights, old)
    return r


def _advance(layout: Layout) -> Routine:
    """Add the stages up: from `y` and what rounding has left of it, to both."""
    r = Routine("advance", {"w": ADDRESS, "y": ADDRESS, "rest": ADDRESS}, result=None)
    w, y, rest = r.arguments
    with r.count(layout.size) as i:
        total = rest[i]
        for j in range(layout.stages):
            total = total + w[i + j * layout.size]
        old = y[i]
        new = old + total
        y[i], rest[i] = new, (old - new) + total
    return r


def _speeds(layout: Layout) -> Routine:
    """Write coordinates and speeds at a state, by way of the area aside; 1 where there are none."""
    r, m, (t, y, out) = open_routine(layout, "speeds", {"t": NUMBER, "y": ADDRESS, "out": ADDRESS}, exported=True)
    n, w = layout.coordinates, m.at("aside.L")
    guess, speeds = w.at(layout.within("U")), w.at(layout.within("V" if layout.has_speeds else "F"))
    r.copy(w.at(layout.within("Y")), y, 2 * n)
    for _ in range(_NEWTON if layout.takes_speeds else 1):
        r.give_if(r.call("evaluate", m.session, w, t, guess) != 0, 1)
        if layout.takes_speeds:
            r.copy(guess, w.at(layout.within("V")), layout.speeds)
    r.copy(out, y, n)
    r.copy(out.at(n), speeds, layout.speeds)
    r.give(0)
    return r


def _begin(layout: Layout) -> Routine:
    """Start at the y of a session; 1 where the equations have no value there."""
    r, m, _ = open_routine(layout, "begin", exported=True)
    y, w, t = m.at("y"), m.at("main.L"), m.t
    rest, y_old, scales = m.at("rest"), m.at("y_old"), w.at(layout.within("scale"))
    r.give_if(r.call("flat", m.session, w, y, t, m.step) != 0, 1)
    with r.count(layout.size) as i:
        rest[i], y_old[i] = 0.0, y[i]
        scale = r.size(y[i])
        for j in range(layout.stages):
            scale = scale + r.size(w[i + j * layout.size])
        scales[i] = scale
    m.t_old, m.origin, m.since = t, t, 0
    r.give(0)
    return r


def _run(layout: Layout) -> Routine:
    def attempt(r: Routine, m: Memory, t: Value, h: Value) -> Value:
        w, y = m.at("main.L"), m.at("y")
        with r.when(m.since != 0):
            r.call("ahead", w, result=None)
        code = r.variable(r.call("solve", m.session, w, y, t, h), CODE)
        with r.when(code.now != 0):  # from a poor guess the iteration may lead where the equations have no value
            r.give_if(r.call("flat", m.session, w, y, t, h) != 0, 2)
            code.now = r.call("solve", m.session, w, y, t, h)
        return code.now

    def good(r: Routine, m: Memory) -> None:
        r.copy(m.at("y_old"), m.at("y"), layout.size)
        r.call("advance", m.at("main.L"), m.at("y"), m.at("rest"), result=None)

    return run(layout, attempt, good=good)


def _trial(layout: Layout) -> Routine:
    """Make one step of any length aside, from a state to another; 3 where it fails."""
    arguments = {"t": NUMBER, "h": NUMBER, "source": ADDRESS, "target": ADDRESS}
    r, m, (t, h, source, target) = open_routine(layout, "trial", arguments, exported=True)
    w, own = m.at("aside.L"), m.at("main.L")
    r.copy(w.at(layout.within("scale")), own.at(layout.within("scale")), layout.size)
    if layout.takes_speeds:
        begin, count = layout.within("U"), layout.speeds
        for j in range(layout.stages):
            r.copy(w.at(begin + j * count), own.at(begin + (layout.stages - 1) * count), count)
    for name in ("flat", "solve"):
        r.give_if(r.call(name, m.session, w, source, t, h) != 0, 3)
    with r.count(layout.size) as i:
        total = w[i]
        for j in range(1, layout.stages):
            total = total + w[i + j * layout.size]
        target[i] = source[i] + total
    r.give(0)
    return r


ORDERS = (2, 4, 6, 8, 10, 12)
"""The orders there are."""

_DIGITS = 60


class Tableau(NamedTuple):
    """A method of s stages: with ``L_j = h b_j f(Y_j)``, ``Y_i = y + sum m_ij L_j`` and the step is ``sum L_j``.

    Attributes
    ----------
    nodes
        c.
    weights
        b.
    shares
        m, by rows.
    ahead
        What the polynomial through the L of one step gives for those of the next, by rows.
    """

    nodes: tuple[float, ...]
    weights: tuple[float, ...]
    shares: tuple[tuple[float, ...], ...]
    ahead: tuple[tuple[float, ...], ...]


@cache
def tableau(order: int) -> Tableau:
    """Return the method of an order, one of `ORDERS`."""
    s = order // 2
    with localcontext() as context:
        context.prec = _DIGITS
        nodes = _zeros(s)
        basis = [_lagrange(nodes, j) for j in range(s)]
        weights = [_integral(one, Decimal(1)) for one in basis]
        exact = [[_integral(basis[j], c) / weights[j] for j in range(s)] for c in nodes]
        shares = [[0.5] * s for _ in range(s)]
        for i in range(s):
            for j in range(i):
                # The larger of the two is rounded, so that the other is one less it without rounding.
                above = float(exact[i][j])
                shares[i][j], shares[j][i] = above, 1.0 - above
        ahead = tuple(
            tuple(float(weights[i] / weights[j] * _value(basis[j], 1 + nodes[i])) for j in range(s)) for i in range(s)
        )
        return Tableau(tuple(map(float, nodes)), tuple(map(float, weights)), tuple(map(tuple, shares)), ahead)


Polynomial = list[Decimal]
"""Coefficients, lowest power first."""


def _zeros(s: int) -> list[Decimal]:
    """Return the zeros of the shifted Legendre polynomial, ``(d/dx)^s x^s (x - 1)^s``, by Newton's method."""
    row: Polynomial = [Decimal(1)]
    for k in range(s):  # the coefficients of the polynomial P_s(1 - 2x) = sum (-s)_k (s+1)_k/(k!)^2 x^k
        row.append(row[-1] * (k - s) * (s + 1 + k) / ((k + 1) ** 2))
    slope = [k * value for k, value in enumerate(row)][1:]
    found: list[Decimal] = []
    for _ in range(s):
        x = Decimal(0)  # below all zeros that are left, from where the iteration rises without passing one
        for _ in range(500):
            value, rate = _value(row, x), _value(slope, x)
            rate -= value * sum((1 / (x - known) for known in found), Decimal(0))
            step = value / rate
            x -= step
            if abs(step) < Decimal(10) ** (10 - _DIGITS):
                break
        found.append(x)
    return sorted(found)


def _value(row: Polynomial, x: Decimal) -> Decimal:
    total = Decimal(0)
    for coefficient in reversed(row):
        total = total * x + coefficient
    return total


def _integral(row: Polynomial, x: Decimal) -> Decimal:
    return _value([Decimal(0), *(value / (k + 1) for k, value in enumerate(row))], x)


def _lagrange(nodes: list[Decimal], j: int) -> Polynomial:
    """Return the polynomial that is one at a node and zero at the others."""
    row: Polynomial = [Decimal(1)]
    for i, node in enumerate(nodes):
        if i != j:
            shifted = [Decimal(0), *row]
            row = [(a - node * b) / (nodes[j] - node) for a, b in zip(shifted, [*row, Decimal(0)], strict=True)]
    return row
