"""Slopes within a step of an embedded pair, and its dense output.

Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, section II.6.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from atwood.codegen.routines import ADDRESS, CODE, NUMBER, Routine, Value
from atwood.integrators.embedded.stepper import open_routine
from atwood.integrators.embedded.tableau import Tableau
from atwood.integrators.stepper import Memory


def write_dense_output(pair: Tableau) -> list[Routine]:
    """Write the routines that read a solution within the last step."""
    return [_interpolate(pair), _densify(pair), write_polynomial(pair), _slope(pair)]


def weighted(m: Memory, weights: Mapping[int, float], j: Value) -> Value:
    """Return a weighted sum of slopes."""
    terms = [m.lanes(m.row(row), j) * weight for row, weight in weights.items()]
    total = terms[0]
    for term in terms[1:]:
        total = total + term
    return total


def slopes(
    pair: Tableau, r: Routine, m: Memory, stages: Iterable[int], t: Value, h: Value, failed: Callable[[], None]
) -> None:
    """Take the slopes of stages one after the other."""
    for stage in stages:
        r.call(f"stage{stage}", m.session, h)
        code = r.call("evaluate", m.session, t + h * pair.nodes[stage], m.row("trial"), m.row(stage))
        with r.when(code != 0):
            failed()


def _densify(pair: Tableau) -> Routine:
    """Make the dense output of the last step, unless it is there; 1 where there is none."""
    r, m, () = open_routine(pair, "densify")
    r.give_if(m.is_dense != 0, 0)
    h = m.h
    slopes(pair, r, m, range(pair.end + 1, len(pair.nodes)), m.t_old, h, lambda: r.give(1))
    write_terms(pair, m, h)
    m.is_dense = 1
    r.give(0)
    return r


def write_terms(pair: Tableau, m: Memory, h: Value) -> None:
    """Write the coefficients of the dense output."""
    dense, y, y_old, begin, end = m.row("dense"), m.row("y"), m.row("y_old"), m.row(0), m.row("end slope")
    with m.parts() as j:
        step = m.lanes(y, j) - m.lanes(y_old, j)
        rise, fall = m.lanes(begin, j) * h, m.lanes(end, j) * h
        rows = [step, rise - step, (step + step) - (rise + fall)]
        rows += [weighted(m, weights, j) * h for weights in pair.dense]
        for number, row in enumerate(rows):
            dense[j + m.padded * number] = row


def write_polynomial(pair: Tableau, runs: int = 1) -> Routine:
    """Write the dense output at a share of the last step to `trial`."""
    r, m, (x,) = open_routine(pair, "polynomial", {"x": NUMBER}, runs=runs)
    rows = [m.row("dense").at(m.padded * k) for k in range(pair.terms)]
    below, trial, rest = [m.row("y_old"), *rows[:-1]], m.row("trial"), 1.0 - x
    with m.parts() as j:
        value = m.lanes(rows[-1], j)
        for power in reversed(range(pair.terms)):
            value = value * (rest if power % 2 else x) + m.lanes(below[power], j)
        trial[j] = value
    r.give(0)
    return r


def _slope(pair: Tableau) -> Routine:
    """Write the slope of the cubic through both ends of the last step, at a share of it, to `last`."""
    r, m, (x,) = open_routine(pair, "slope", {"x": NUMBER})
    rest = 1.0 - x
    both, begin, end = x * rest * 6.0 / m.h, rest * (1.0 - x * 3.0), x * (x * 3.0 - 2.0)
    y, y_old, first, second, last = m.row("y"), m.row("y_old"), m.row(0), m.row("end slope"), m.row("last")
    with m.parts() as j:
        step = m.lanes(y, j) - m.lanes(y_old, j)
        last[j] = step * both + m.lanes(first, j) * begin + m.lanes(second, j) * end
    r.give(0)
    return r


def _interpolate(pair: Tableau) -> Routine:
    """Write values and rates at a time within the last step, or at its begin for one before that."""
    arguments = {"time": NUMBER, "y_out": ADDRESS, "yp_out": ADDRESS}
    r, m, (time, y_out, yp_out) = open_routine(pair, "interpolate", arguments, exported=True)
    for end, values, rates in ((m.t, "y", "end slope"), (m.t_old, "y_old", 0)):
        with r.when(time == end if values == "y" else time <= end):
            r.copy(y_out, m.row(values), m.size)
            r.copy(yp_out, m.row(rates), m.size)
            r.give(0)
    r.give_if(r.call("densify", m.session) != 0, 3)
    r.call("polynomial", m.session, (time - m.t_old) / m.h)
    trial = m.row("trial")
    r.copy(y_out, trial, m.size)
    code = r.call(m.function, time, trial, yp_out, m.data)
    m.evaluations = m.evaluations + 1
    r.give(r.choose(code == 0, 0, 3, CODE))
    return r
