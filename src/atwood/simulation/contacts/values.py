"""Gaps and slips of a scene in numbers, in maximal coordinates, in which every joint has its forces.

A unit force along a row i makes accelerations ``X_i``, with the joints holding: ``M X_i - G^T y_i = J_i^T``,
``G X_i = 0``. So the rows move by ``b + A f`` with ``A = J X`` (C. Glocker, *Set-Valued Force Laws*, 2001).
"""

from __future__ import annotations

from copy import copy
from functools import cached_property

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Expression, InputGroup, OutputGroup, Program, depends_on, jacobian, substitute
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.program import state_groups
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import ContactRow
from atwood.model.declare.contact_laws import value_names
from atwood.numerics.contact_sets import Contacts, Limits, Unit
from atwood.numerics.matrices import least_norm, or_one, to_array
from atwood.simulation.dynamics.balance import LIGHT, balance_of, even_balance
from atwood.simulation.dynamics.reactions import maximal_state
from atwood.simulation.dynamics.scales import motion_scales

_PROGRAM: Key[_Program] = Key("gaps and slips")


@dataclass(frozen=True, eq=False)
class _Program:
    """The program of (t, q, u, multipliers that limits read), and the pattern of its matrices."""

    program: Program
    rows: tuple[int, ...]
    columns: tuple[int, ...]
    read: tuple[Expression, ...]
    shares: tuple[tuple[tuple[int, int], ...], tuple[tuple[int, int], ...]]


def _program(assembly: Assembly) -> _Program:
    equations, graph = assembly.maximal, assembly.maximal.graph
    contacts = equations.contacts
    rates = [one.row.rate for one in contacts]
    slopes = jacobian(rates, list(equations.speeds))
    at_rest = dict.fromkeys(equations.accelerations, graph.zero)
    seconds = substitute([one.row.second for one in contacts], at_rest)
    none = graph.zero
    limits = [none if one.limit is None else one.limit for one in contacts]
    static = [none if one.static_limit is None else one.static_limit for one in contacts]
    own = [one.read for one in contacts]
    every = [*limits, *static]
    read = tuple(x for x in (*own, *equations.multipliers) if any(depends_on(limit, [x]) for limit in every))
    found = [jacobian(some, list(read)) for some in (limits, static)]
    values = [none if one.row.value is None else one.row.value for one in contacts]
    outputs = (
        OutputGroup("values", tuple(values)),
        OutputGroup("rates", tuple(rates)),
        OutputGroup("slopes", tuple(slopes.entries)),
        OutputGroup("seconds", tuple(seconds)),
        OutputGroup("limits", tuple(limits)),
        OutputGroup("static limits", tuple(static)),
        OutputGroup("shares", tuple(found[0].entries)),
        OutputGroup("static shares", tuple(found[1].entries)),
        OutputGroup("restitution", tuple(none if one.restitution is None else one.restitution for one in contacts)),
    )
    groups = (*state_groups(equations), InputGroup("read", read))
    places = tuple(tuple(zip(one.rows, one.columns, strict=True)) for one in found)
    program = Program("gaps and slips", groups, assembly.parameters, outputs)
    return _Program(program, slopes.rows, slopes.columns, read, (places[0], places[1]))


class ContactValues:
    """Gaps and slips at a state.

    Parameters
    ----------
    assembly
        The scene.
    t, q, u
        The state in the coordinates of its form.
    length
        Extent of the scene, m.
    """

    def __init__(self, assembly: Assembly, t: float, q: FloatArray, u: FloatArray, length: float) -> None:
        self.assembly, self.t = assembly, t
        self.contacts = assembly.maximal.contacts
        self.q, self.u = (x[:, 0] for x in maximal_state(assembly, np.array([t]), q[:, None], u[:, None]))
        self.sizes = motion_scales(assembly.maximal, length)
        self._made = assembly.shared.get(_PROGRAM, lambda: _program(assembly))
        self._kernel = assembly.kernel(self._made.program)
        self.read = np.zeros(len(self._made.read))
        self._take(self.u)

    def with_speeds(self, u: FloatArray) -> ContactValues:
        """Return the same at other speeds of the maximal coordinates."""
        if np.array_equal(u, self.u):
            return self
        made = copy(self)
        made.__dict__.pop("_solved", None)
        made.u = u.copy()
        made._take(made.u)
        return made

    def _take(self, u: FloatArray) -> None:
        found = [np.asarray(x, dtype=float) for x in self._kernel([self.t], self.q, u, self.read)]
        self.values, self.rates, slopes, self.seconds, self.limits, self.static_limits, *_ = found
        self.restitution = found[8]
        self.slopes = np.zeros((len(self.contacts), len(u)))
        self.slopes[self._made.rows, self._made.columns] = slopes
        self._shares = found[6], found[7]

    @cached_property
    def units(self) -> tuple[tuple[int, ...], ...]:
        """The rows of each gap and each slip."""
        found: dict[tuple[str, str], list[int]] = {}
        for i, one in enumerate(self.contacts):
            found.setdefault(one.row.key[:2], []).append(i)
        return tuple(map(tuple, found.values()))

    @cached_property
    def gap_of(self) -> tuple[int, ...]:
        """For each unit that is a slip the number of its gap; -1 for what has none."""
        first = [self.contacts[rows[0]] for rows in self.units]
        places = {one.row.key[:2]: k for k, one in enumerate(first)}
        return tuple(
            places.get((one.row.key[0], one.law.options.at), -1) if one.is_slip and one.law.options.at else -1
            for one in first
        )

    @cached_property
    def _solved(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Accelerations without these forces, those by a unit of each, and the multipliers of joints likewise."""
        assembly = self.assembly
        held = dict(zip((one.path for one in assembly.discrete_states), assembly.held_now, strict=True))
        for rows in self.units:
            held |= dict.fromkeys(state_paths(self.contacts[rows[0]]), 0.0)
        loose = assembly.with_held([held[one.path] for one in assembly.discrete_states])
        now = balance_of(loose, "dae").at(self.t, self.q, self.u)
        n, each = len(self.u), or_one(np.max(np.abs(to_array(now.jacobian) * self.sizes), axis=1, initial=0.0))
        matrix, unit = even_balance(now, self.sizes, each)
        right = np.zeros((len(matrix), 1 + len(self.contacts)))
        right[:n, 0], right[n:, 0] = -now.bias * self.sizes / unit, -now.gamma / each
        right[:n, 1:] = (self.slopes * self.sizes).T / unit
        found = least_norm(matrix, right, errors=LIGHT)
        moved, borne = found[:n] * self.sizes[:, None], found[n:] * unit / each[:, None]
        return moved[:, 0], moved[:, 1:], borne[:, 0], borne[:, 1:]

    @cached_property
    def response(self) -> FloatArray:
        """A: how the rows move by a unit of each force."""
        found: FloatArray = self.slopes @ self._solved[1]
        return found

    def accelerations(self) -> FloatArray:
        """Return how the rows accelerate without these forces."""
        found: FloatArray = self.slopes @ self._solved[0] + self.seconds
        return found

    def speeds_by(self, forces: FloatArray) -> FloatArray:
        """Return the change of speeds, or the accelerations, that impulses, or forces, make."""
        found: FloatArray = self._solved[1] @ forces
        return found

    def limits_at(self, forces: FloatArray) -> Limits:
        """Return the limits of all units near some forces of the rows: ``L(f) = L_0 + P f``."""
        contacts, borne, by = self.contacts, self._solved[2], self._solved[3]
        count = len(contacts)
        own = {one.read: i for i, one in enumerate(contacts)}
        number = {symbol: i for i, symbol in enumerate(self.assembly.maximal.multipliers)}
        ways, rest = np.zeros((len(self._made.read), count)), np.zeros(len(self._made.read))
        for k, symbol in enumerate(self._made.read):
            if symbol in own:
                ways[k, own[symbol]] = 1.0
            else:
                ways[k], rest[k] = by[number[symbol]], borne[number[symbol]]
        self.read = rest + ways @ forces
        self._take(self.u)
        found: list[FloatArray] = []
        heads = [rows[0] for rows in self.units]
        for limits, entries, places in zip(
            (self.limits, self.static_limits), self._shares, self._made.shares, strict=True
        ):
            slopes = np.zeros((count, len(self.read)))
            for (r, c), entry in zip(places, entries, strict=True):
                slopes[r, c] = entry
            shares = slopes @ ways
            found += [(limits - shares @ forces)[heads], shares[heads]]
        return Limits(*found)

    def chosen(
        self, chosen: list[int], free: FloatArray, given: dict[int, tuple[float, ...]], limits: Limits
    ) -> Contacts:
        """Return what is asked of some units."""
        rows = [row for k in chosen for row in self.units[k]]
        place = {row: i for i, row in enumerate(rows)}
        number = {k: i for i, k in enumerate(chosen)}
        units = tuple(
            Unit(
                tuple(place[row] for row in self.units[k]),
                self.contacts[self.units[k][0]].is_slip,
                given.get(k, (0.0,) * len(self.units[k])),
                number.get(self.gap_of[k], -1),
            )
            for k in chosen
        )
        few = Limits(
            limits.free[chosen],
            limits.shares[np.ix_(chosen, rows)],
            limits.static_free[chosen],
            limits.static_shares[np.ix_(chosen, rows)],
        )
        return Contacts(self.response[np.ix_(rows, rows)], free[rows], units, few)


def state_paths(one: ContactRow) -> tuple[str, ...]:
    """Return the paths of the discrete states of a gap, or of a slip: its state, then its direction."""
    part, law, _ = one.row.key
    directions = value_names(one.law) if one.is_slip else ()
    return (f"{part}.{law}_state", *(f"{part}.{name}_direction" for name in directions))
