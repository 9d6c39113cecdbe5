"""Derivatives of one number of a run by any number of parameters: the way back through its stretches.

The derivatives of a sum of quantities at output times, each with a weight, follow from cotangents that are taken back
through the steps, and over what happens between stretches by the transposed saltation matrices (see `changes`). The
cost depends on the number of sums, not on the number of parameters.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from atwood.arrays import FloatArray, IndexArray
from atwood.errors import UnsupportedError
from atwood.expr import Expression
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.model.values.units import ALONG
from atwood.numerics.contact_sets import GOES_ON
from atwood.simulation.contacts.values import layout_of
from atwood.study.sensitivities.augmented import Augmented
from atwood.study.sensitivities.changes import Leg
from atwood.study.sensitivities.columns import Column
from atwood.study.sensitivities.passage import Passage, set_apart
from atwood.study.sensitivities.pulled import Pulled, Recorded, read
from atwood.study.sensitivities.quantities import derivatives, written

_BEGINS = 1e-3
"""In the scene's speeds: a slip that is slower at the begin of a stretch begins there."""


@dataclass(frozen=True, eq=False)
class _Stretch:
    """A stretch of a run as it is gone back.

    Attributes
    ----------
    pulled, made
        What takes cotangents back, and its steps; no steps where it has no length.
    expressions
        The quantities.
    times, states, rows
        Its shown times, the states there, and which of the output times of `made` they are: -1 for the begin.
    seeds, held
        The change of its parameters by each column, without that of discrete states; the places of these.
    tangent
        What the projection at its begin does to changes of the state and of parameters.
    over
        What of a change of the state at its end, of a discrete state, and of each column becomes a change of the state
        and of the discrete states behind: shapes (n + held + columns, n) and (n + held + columns, held); None for
        the last one.
    apart
        How far its states are from those of the run, how large these are, and the sizes of both.
    """

    pulled: Pulled
    made: Recorded | None
    expressions: tuple[Expression, ...]
    times: FloatArray
    states: FloatArray
    rows: IndexArray
    seeds: FloatArray
    held: list[int]
    tangent: tuple[FloatArray, FloatArray]
    over: tuple[FloatArray, FloatArray] | None
    apart: tuple[FloatArray, FloatArray, FloatArray]


class Adjoint(Passage):
    """A run that can be gone back; made as a `Passage` is."""

    def make(self) -> FloatArray:
        """Go through the run and keep its steps; return the quantities at the outputs, shape (quantities, times)."""
        self.moved, self.held = self._at_start()
        self.stretches: list[_Stretch] = []
        values = []
        for number, leg in enumerate(self.legs):
            one = self._stretch(number, leg)
            self.stretches.append(one)
            if len(one.times):
                values.append(self._read(one, np.zeros((len(self.paths), len(one.times))))[0])
        return np.concatenate(values, axis=1)

    def go(self) -> tuple[FloatArray, FloatArray]:
        """Return values and derivatives of the quantities, by a way back for each quantity and output time."""
        values = self.make()
        found = np.empty((len(self.paths), len(self.columns), values.shape[1]))
        for i, k in product(range(len(self.paths)), range(values.shape[1])):
            weights = np.zeros(values.shape)
            weights[i, k] = 1.0
            found[i, :, k] = self.gradient(weights)
        return values, found

    def gradient(self, weights: FloatArray) -> FloatArray:
        """Return the derivatives of a weighted sum of the quantities by the columns, times their scales.

        Parameters
        ----------
        weights
            Shape (quantities, times).
        """
        found, last = np.zeros(len(self.columns)), sum(len(one.times) for one in self.stretches)
        state, held = np.zeros(0), np.zeros(0)
        for one in reversed(self.stretches):
            n, count = one.states.shape[1], len(one.held)
            if one.over is not None:
                behind = one.over[0] @ state + one.over[1] @ held
                state, held = behind[:n], behind[n : n + count]
                found += behind[n + count :]
            else:
                state, held = np.zeros(n), np.zeros(count)
            own, last = weights[:, last - len(one.times) : last], last - len(one.times)
            state, parameters = self._back(one, own, state)
            tangent, slopes = one.tangent
            state, parameters = tangent.T @ state, parameters + slopes.T @ state
            found += one.seeds @ parameters
            held = held + parameters[one.held]
        return found + self.moved @ state + self.held @ held

    def _back(self, one: _Stretch, weights: FloatArray, state: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the cotangents of the state at the begin of a stretch and of its parameters."""
        n = len(state)
        slopes, parameters = np.zeros((len(one.times), n)), np.zeros(one.seeds.shape[1])
        if np.any(weights):
            _, slopes, direct = self._read(one, weights)
            parameters = parameters + direct.sum(axis=0)
        first = slopes[one.rows < 0].sum(axis=0)
        if one.made is None:
            return state + first, parameters
        ends = np.zeros((len(one.made.outputs), n))
        ends[one.rows[one.rows >= 0]] = slopes[one.rows >= 0]
        ends[-1] += state
        state, own = one.pulled.back(one.made, ends)
        apart, size, sizes = one.apart
        used = np.any(ends != 0.0, axis=1)
        if np.any(used):  # errors have grown as changes of the state at the begin do
            grown = np.max(np.abs(state) * sizes) / np.max(np.abs(ends[used]) * sizes)
            self._refuse_apart(one.made.outputs[used], apart[used], 1.0 + size[used] + grown * max(1.0, np.max(size)))
        return state + first, parameters + own

    def _read(self, one: _Stretch, weights: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return quantities, and the gradients of their weighted sums at each time by state and parameters."""
        assembly, count = one.pulled.augmented.plan.assembly, len(one.times)
        kernel = assembly.kernel(read(assembly, one.expressions), vectorized=True)
        n = len(assembly.own_equations.coordinates)
        found = kernel(one.times[None, :], one.states[:, :n].T, one.states[:, n:].T, weights)
        values, state, parameters = (np.broadcast_to(some, (len(some), count)) for some in found)
        return values, state.T, parameters.T

    def _stretch(self, number: int, leg: Leg) -> _Stretch:
        segment, begin = self.segments[leg.number], np.concatenate(leg.begin[1:])
        self._refuse_singular(segment)
        if leg.plan.assembly.own_equations.contacts:
            self._refuse_beginning(leg)
        none = np.zeros((len(self.columns), len(leg.assembly.discrete_states)))
        seeds = self._seeds(leg, none)
        pulled = Pulled(Augmented(leg.plan, leg.begin[0], begin, seeds))
        if not number and leg.plan.assembly.own_equations.contacts:  # where they touch, small changes may let go
            self._tangent(leg, pulled.augmented, begin, self.moved, self._seeds(leg, self.held))
        times = segment.time
        last = np.arange(len(times)) == len(times) - 1
        wanted = np.flatnonzero((segment.shown | last) & (times > leg.begin[0]))
        made, ends = None, np.zeros((0, len(begin)))
        apart = np.zeros(0), np.zeros(0), np.ones(len(begin))
        if len(wanted):
            made = pulled.run(leg.begin[0], begin, times[wanted], self.rtol, self.max_steps, 2 * self.steps + 1000)
            ends = made.ends
            apart = self._apart(segment, ends, wanted)
        shown = np.flatnonzero(segment.shown)
        rows = np.array([list(wanted).index(k) if k in set(wanted) else -1 for k in shown], dtype=np.intp)
        states = np.array([ends[k] if k >= 0 else begin for k in rows]).reshape(len(rows), len(begin))
        expressions = written(leg.plan, self.paths, leg.begin[0], begin) if len(shown) else ()
        places = {symbol: k for k, symbol in enumerate(leg.plan.assembly.parameters)}
        held = [places[one.symbol] for one in leg.assembly.discrete_states]
        over = None
        if number + 1 < len(self.legs):
            over = self._across(leg, self.legs[number + 1], pulled, seeds, held)
        tangent = pulled.tangent(leg.begin[0], begin)
        return _Stretch(pulled, made, expressions, times[shown], states, rows, seeds, held, tangent, over, apart)

    def _refuse_beginning(self, leg: Leg) -> None:
        """Refuse slips in two directions that begin: changes across the slip die away within steps of the motion."""
        layout, contacts = layout_of(leg.assembly), leg.plan.assembly.own_equations.contacts
        states = leg.assembly.held_now
        begun = [
            rows
            for rows, places in zip(layout.units, layout.places, strict=True)
            if len(rows) == 2 and states[places[0]] == GOES_ON
        ]
        if not begun:
            return
        still = np.zeros((1, 1, len(np.concatenate(leg.begin[1:]))))
        rates, _ = derivatives(
            leg.plan.assembly,
            [contacts[i].row.rate for rows in begun for i in rows],
            np.array([leg.begin[0]]),
            np.concatenate(leg.begin[1:])[None, :],
            still,
            np.zeros((1, len(leg.plan.assembly.parameters))),
        )
        for rows, speed in zip(begun, np.hypot(rates[::2, 0], rates[1::2, 0]), strict=True):
            part, unit = contacts[rows[0]].row.key[0], f"{ALONG[contacts[rows[0]].law.options.unit]}/s"
            if speed <= _BEGINS * leg.plan.scales.of(unit):
                raise UnsupportedError(
                    f"at t = {leg.begin[0]:.9g} s a slip in two directions begins, over which derivatives go forward "
                    "alone",
                    where=part,
                    advice="Ask with mode='forward'.",
                )

    def _across(
        self, leg: Leg, after: Leg, pulled: Pulled, seeds: FloatArray, held: list[int]
    ) -> tuple[FloatArray, FloatArray]:
        """Return what becomes of changes at the end of a stretch, each taken onto the constraints before."""
        end = np.concatenate(leg.end[1:])
        n, count, columns = len(end), len(held), self.columns
        every = np.zeros((n + count + len(columns), seeds.shape[1]))
        moving = [k for k in range(count) if k not in set_apart(leg.assembly)]
        every[[n + k for k in moving], [held[k] for k in moving]] = 1.0
        every[n + count :] = seeds
        tangent, slopes = pulled.tangent(leg.end[0], end)
        moved = every @ slopes.T
        moved[:n] += tangent.T
        discrete = np.zeros((len(every), count))
        discrete[[n + k for k in moving], moving] = 1.0
        self.columns = (*[_still()] * (n + count), *columns)
        try:
            found = self._over(leg, after, moved, discrete, every)
        finally:
            self.columns = columns
        return found


def _still() -> Column:
    """Return a column that changes no parameter."""
    return Column("", "1", True, 0.0, 1.0, _refuse, frozenset(), True)


def _refuse(share: float) -> Assembly:
    raise NotImplementedError  # nothing is changed by it
