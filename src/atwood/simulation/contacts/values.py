"""Gaps and slips of a scene in numbers, in maximal coordinates, in which every joint has its forces.

A unit force along a row i makes accelerations ``X_i``, with the joints holding: ``M X_i - G^T y_i = J_i^T``,
``G X_i = 0``. So the rows move by ``b + A f`` with ``A = J X`` (C. Glocker, *Set-Valued Force Laws*, 2001).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from copy import copy
from functools import cached_property

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Expression, InputGroup, OutputGroup, Program, depends_on, jacobian, read_by, substitute
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.loose import in_no_contact, state_paths
from atwood.forms.program import state_groups
from atwood.forms.quantities import to_maximal
from atwood.integrators.sets.sizes import UNMOVED
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.constraints.read_multipliers import weights_of
from atwood.mechanics.dynamics.equations import ContactRow
from atwood.model.values.units import ALONG
from atwood.numerics.contact_sets import Contacts, Limits, Unit, sizes_of
from atwood.numerics.matrices import least_norm, or_one, to_array
from atwood.numerics.rank import null_space
from atwood.simulation.dynamics.balance import (
    LIGHT,
    Balance,
    BalanceValues,
    ConstraintValues,
    balance_of,
    even_balance,
)
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of
from atwood.simulation.dynamics.scales import Scales, coordinate_scales, motion_scales
from atwood.simulation.problem.problem import SceneProblem

_LAYOUT: Key[Layout] = Key("gaps and slips")
_OWN_SIZES: Key[Scales] = Key("sizes of forces of gaps and slips")

_LIMITS = ("limits", "static limits", "limits backwards", "static limits backwards")


@dataclass(frozen=True, eq=False)
class Layout:
    """The gaps and slips of a scene, and what tells their values.

    Attributes
    ----------
    program
        The program of (t, q, u, multipliers that limits read).
    slopes
        The pattern of the slopes of their rates.
    read, sources, shares
        The multipliers that limits read, for each whether it is that of a row, and its number there or among those of
        joints, and the patterns of the slopes of limits and static limits along these.
    is_curved, is_borne
        Whether limits are curved in these multipliers, and whether some are those of joints.
    contacts, units
        The rows, and those of each gap and each slip.
    first, is_slip
        The first row of each unit, and whether it is a slip.
    speeds
        The units that are gaps at velocities.
    gap_of
        For each unit that is a slip the number of its gap; -1 for what has none.
    places
        Where the states of each unit are among the discrete states.
    """

    program: Program
    slopes: tuple[tuple[int, ...], tuple[int, ...]]
    read: tuple[Expression, ...]
    sources: tuple[tuple[bool, int], ...]
    shares: tuple[tuple[tuple[int, ...], tuple[int, ...]], ...]
    is_curved: bool
    is_borne: bool
    contacts: tuple[ContactRow, ...]
    units: tuple[tuple[int, ...], ...]
    first: tuple[ContactRow, ...]
    is_slip: tuple[bool, ...]
    speeds: tuple[int, ...]
    gap_of: tuple[int, ...]
    places: tuple[tuple[int, ...], ...]

    @cached_property
    def owners(self) -> tuple[int, ...]:
        """For each unit a number that gaps and slips of one part share, as the corners of a box do."""
        numbers: dict[str | int, int] = {}
        keys = [one.row.key[0].rpartition(".")[0] or k for k, one in enumerate(self.first)]
        return tuple(numbers.setdefault(key, len(numbers)) for key in keys)


def layout_of(assembly: Assembly) -> Layout:
    """Return the gaps and slips of a scene."""
    return assembly.shared.get(_LAYOUT, lambda: _layout(assembly))


def _layout(assembly: Assembly) -> Layout:
    equations, graph = assembly.maximal, assembly.maximal.graph
    contacts = equations.contacts
    rates = [one.row.rate for one in contacts]
    slopes = jacobian(rates, list(equations.speeds))
    at_rest = dict.fromkeys(equations.accelerations, graph.zero)
    seconds = substitute([one.row.second for one in contacts], at_rest)
    none = graph.zero
    limits = [[one.towards(way)[i] for one in contacts] for way in (1.0, -1.0) for i in (0, 1)]
    own, every = [one.read for one in contacts], [limit for some in limits for limit in some]
    read = tuple(read_by(every, [*own, *equations.multipliers]))
    found = [jacobian(some, list(read)) for some in limits]
    values = [none if one.row.value is None else one.row.value for one in contacts]
    outputs = (
        OutputGroup("values", tuple(values)),
        OutputGroup("rates", tuple(rates)),
        OutputGroup("slopes", tuple(slopes.entries)),
        OutputGroup("seconds", tuple(seconds)),
        *(OutputGroup(name, tuple(some)) for name, some in zip(_LIMITS, limits, strict=True)),
        *(OutputGroup(f"shares of {name}", tuple(one.entries)) for name, one in zip(_LIMITS, found, strict=True)),
        OutputGroup("restitution", tuple(none if one.restitution is None else one.restitution for one in contacts)),
        OutputGroup("compliance", tuple(map(_compliance, contacts))),
    )
    groups = (*state_groups(equations), InputGroup("read", read))
    program = Program("gaps and slips", groups, assembly.parameters, outputs)
    units: dict[tuple[str, str], list[int]] = {}
    for i, one in enumerate(contacts):
        units.setdefault(one.row.key[:2], []).append(i)
    first = tuple(contacts[rows[0]] for rows in units.values())
    number = {key: k for k, key in enumerate(units)}
    states = {one.path: i for i, one in enumerate(assembly.discrete_states)}
    return Layout(
        program,
        (slopes.rows, slopes.columns),
        read,
        tuple((x in own, own.index(x) if x in own else equations.multipliers.index(x)) for x in read),
        tuple((one.rows, one.columns) for one in found),
        depends_on([entry for one in found for entry in one.entries], list(read)),
        any(x not in own for x in read),
        contacts,
        tuple(map(tuple, units.values())),
        first,
        tuple(one.is_slip for one in first),
        tuple(k for k, one in enumerate(first) if one.is_speed),
        tuple(
            number.get((one.row.key[0], one.law.options.at), -1) if one.is_slip and one.law.options.at else -1
            for one in first
        ),
        tuple(tuple(states[path] for path in state_paths(one)) for one in first),
    )


def _compliance(one: ContactRow) -> Expression:
    """Return by how much a row gives way to a unit of force, where it shares a load; zero where it is rigid."""
    stiffness = one.row.stiffness
    return one.row.multiplier.graph.zero if stiffness is None else 1.0 / stiffness


def with_own_sizes(plan: SceneProblem, t: float, q: FloatArray, u: FloatArray) -> SceneProblem:
    """Return a plan that knows sizes of the forces of its gaps and slips.

    A part that is far lighter than the whole scene has smaller forces. Those of some rows are off by
    ``|A^+| a`` where accelerations are off by a: what touches, in whatever set, is then off by no more.
    """
    assembly, scales = plan.assembly, plan.scales
    layout = layout_of(assembly)
    if not layout.contacts or layout.is_borne:  # limits that read forces of joints are off by these
        return plan

    def make() -> Scales:
        values = ContactValues(assembly, t, q, u, scales.length)
        size = sizes_of(np.diag(values.response), values.row_sizes)
        inverse = least_norm(values.response / size / size[:, None], np.eye(len(size)), errors=LIGHT)
        falls = [scales.of(ALONG[one.law.options.unit]) / scales.time**2 for one in layout.contacts]
        each = np.abs(inverse / size / size[:, None]) @ np.array(falls)
        each = np.where(np.isfinite(size), each, np.inf)
        found: dict[tuple[str, str], float] = {}
        for one, rows, at in zip(layout.first, layout.units, layout.gap_of, strict=True):
            asked = [*rows, *(layout.units[at] if at >= 0 else ())]
            found[one.row.key[:2]] = float(np.max(each[asked]))
        return replace(scales, contacts=found)

    return replace(plan, scales=assembly.kept.get(_OWN_SIZES, make, t, q.tobytes(), u.tobytes(), scales.time))


def unmoved(one: ContactRow, scales: Scales) -> float:
    """Return by how little a unit of force moves a row where only rounding does, in a scene of some sizes."""
    size = scales.of(ALONG[one.law.options.unit])
    return UNMOVED * size**2 / (scales.force * scales.time**2 * scales.length)


def without_contacts(assembly: Assembly) -> Balance:
    """Return the balance of forces in maximal coordinates of a scene in which nothing touches, slips or sticks."""
    return balance_of(in_no_contact(assembly), "dae")


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
        self.assembly, self.t, self.length, self.layout = assembly, t, length, layout_of(assembly)
        self.contacts, self.units, self.gap_of = self.layout.contacts, self.layout.units, self.layout.gap_of
        if assembly.form == "reduced":
            q, u = (np.array(x) for x in assembly.kernel(to_maximal(assembly))([t], q, u))
            q = kinematic_map_of(assembly, "dae").normalized(q)
        self.q, self.u = q, u
        self.sizes = motion_scales(assembly.maximal, length)
        self.row_sizes = np.array([length if one.law.options.unit == "N" else 1.0 for one in self.contacts])
        self._kernel = assembly.kernel(self.layout.program)
        self.read = np.zeros(len(self.layout.read))
        self._take(self.u)

    def with_speeds(self, u: FloatArray) -> ContactValues:
        """Return the same at other speeds of the maximal coordinates."""
        if u is self.u or np.array_equal(u, self.u):
            return self
        made = copy(self)
        for name in ("_now", "_free", "sharing"):
            made.__dict__.pop(name, None)
        made.u = u.copy()
        made._take(made.u)
        return made

    def _take(self, u: FloatArray) -> None:
        found = [np.array(x) for x in self._kernel([self.t], self.q, u, self.read)]
        self.values, self.rates, slopes, self.seconds, *limits = found
        self._limits, self._shares, (self.restitution, self.compliance) = limits[:4], limits[4:8], limits[8:]
        self.slopes = np.zeros((len(self.contacts), len(u)))
        self.slopes[self.layout.slopes] = slopes

    def moved(self, step: float, far: float = 0.0) -> Iterator[FloatArray]:
        """Go through the values with each coordinate moved by a share of itself, lengths by one of what is far, too."""
        sizes = np.abs(self.q) + (coordinate_scales(self.assembly.maximal, far) if far else 0.0)
        for by in np.diag(step * sizes)[sizes != 0.0]:
            yield np.array(self._kernel([self.t], self.q + by, self.u, self.read)[0])

    def touching(self, near: float) -> FloatArray:
        """Return 1 for each gap that is as near to zero, in units of the scene, and for the slips at it; else 0."""
        found = np.zeros(len(self.contacts))
        for rows, at in zip(self.units, self.gap_of, strict=True):
            gap = self.units[at][0] if at >= 0 else rows[0]
            is_near = self.values[gap] <= near * self.row_sizes[gap]
            found[list(rows)] = not self.contacts[gap].is_slip and is_near
        return found

    @cached_property
    def _now(self) -> BalanceValues:
        """The balance of forces without these forces, by a program in which they do not occur."""
        return without_contacts(self.assembly).at(self.t, self.q, self.u)

    @property
    def _sizes_by_mass(self) -> FloatArray:
        """Displacements that take as much of inertia for each body, so that one beside a far heavier one has some."""
        own = np.diag(to_array(self._now.mass)) * self.sizes**2
        largest: dict[tuple[str, str], float] = {}
        bodies = [(one.name.rpartition(".")[0], one.unit) for one in self.assembly.maximal.speed_names]
        for body, inertia in zip(bodies, own.tolist(), strict=True):
            largest[body] = max(inertia, largest.get(body, 0.0))
        shares = np.array([largest[body] for body in bodies]) / (float(np.max(own, initial=0.0)) or 1.0)
        found: FloatArray = self.sizes / np.sqrt(np.where(shares > 0.0, shares, 1.0))
        return found

    @cached_property
    def _inverse(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The inverse of that balance, and what is scaled before and after it: they depend on the place alone."""
        now, sizes = self._now, self._sizes_by_mass
        each = or_one(np.max(np.abs(to_array(now.jacobian) * sizes), axis=1, initial=0.0))
        matrix, unit = even_balance(now, sizes, each)
        inverse = least_norm(matrix, np.eye(len(matrix)), errors=LIGHT)
        return inverse, np.concatenate([sizes / unit, 1.0 / each]), np.concatenate([sizes, unit / each])

    def _moved(self, right: FloatArray) -> FloatArray:
        """Return accelerations and multipliers of joints for some right-hand sides, a column each."""
        inverse, before, after = self._inverse
        found: FloatArray = after[:, None] * (inverse @ (before[:, None] * right))
        return found

    @cached_property
    def _free(self) -> FloatArray:
        """Accelerations and multipliers of joints without these forces."""
        return self._moved(np.concatenate([-self._now.bias, -self._now.gamma])[:, None])[:, 0]

    @cached_property
    def _joints(self) -> ConstraintValues:
        """The constraints of joints, of which Jacobian and explicit rates depend on the place alone."""
        return balance_of(self.assembly, "dae").constraints_at(self.t, self.q, self.u)

    def allowed(self, u: FloatArray) -> FloatArray:
        """Return the nearest speeds of the maximal coordinates, by masses, that joints allow at this place."""
        joints = self._joints
        rate = np.asarray(joints.jacobian @ u, dtype=float) + joints.explicit_rate
        change: FloatArray = self._moved(np.concatenate([np.zeros(len(u)), -rate])[:, None])[: len(u), 0]
        return u + change if len(rate) else u

    @property
    def falling(self) -> FloatArray:
        """Accelerations without these forces."""
        return self._free[: len(self.u)]

    @cached_property
    def _by_each(self) -> FloatArray:
        """Accelerations and multipliers of joints by a unit of each force."""
        right = np.zeros((len(self._inverse[0]), len(self.contacts)))
        right[: len(self.u)] = self.slopes.T
        return self._moved(right)

    @cached_property
    def response(self) -> FloatArray:
        """A: how the rows move by a unit of each force."""
        found: FloatArray = self.slopes @ self._by_each[: len(self.u)]
        return found

    def by_free_ways(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return how rows move along what joints leave free, each way with a unit of inertia, and without forces.

        These are B, a and b of ``b + B (a + B^T f)``. What joints leave of a row is known in B to rounding of the row,
        and in A to rounding alone of its square.
        """
        now, sizes = self._now, self._sizes_by_mass
        mass, jacobian = sizes[:, None] * to_array(now.mass) * sizes, to_array(now.jacobian) * sizes
        each = or_one(np.max(np.abs(jacobian), axis=1, initial=0.0))
        held, free = least_norm(jacobian / each[:, None], -now.gamma / each), null_space(jacobian / each[:, None])
        inertia, turns = np.linalg.eigh(free.T @ mass @ free)
        has_mass = inertia > LIGHT * np.max(inertia, initial=0.0)
        ways = free @ turns[:, has_mass] / np.sqrt(inertia[has_mass])
        along, falls = (self.slopes * sizes) @ ways, -ways.T @ (sizes * now.bias + mass @ held)
        return along, falls, self.slopes @ (sizes * held) + self.seconds

    @cached_property
    def sharing(self) -> tuple[FloatArray, FloatArray]:
        """The slopes of what is least where nothing determines how forces are shared: ``S f + s``.

        It is ``f W f/2``, with the multipliers of joints, which follow from the forces, among the f: as much as rows
        give way in `read_multipliers`, so that forces here are those that are reported. Springs share a load alone.
        """
        n, soft = len(self.u), self.compliance > 0.0
        jacobian = to_array(self._now.jacobian)
        weights = np.where(soft, self.compliance, self.alone)
        by_each, free = self._by_each[n:], self._free[n:]
        joints = by_each.T * (0.0 if soft.any() else self._gives(jacobian, zip(*np.nonzero(jacobian), strict=True)))
        return np.diag(weights) + joints @ by_each, joints @ free

    @property
    def alone(self) -> FloatArray:
        """How each row moves by a unit of its own force with nothing else held."""
        return self._gives(self.slopes, zip(*self.layout.slopes, strict=True))

    def _gives(self, slopes: FloatArray, pattern: Iterable[tuple[int, int]]) -> FloatArray:
        """Return by how much rows give way that have no stiffness."""
        own = np.diag(to_array(self._now.mass)).tolist()
        inertia = {i: one for i, one in enumerate(own) if one > 0.0}
        entries = {(r, c): float(slopes[r, c]) for r, c in pattern}
        return np.array(weights_of(entries, inertia, [0.0] * len(slopes)))

    def accelerations(self) -> FloatArray:
        """Return how the rows accelerate without these forces."""
        found: FloatArray = self.slopes @ self.falling + self.seconds
        return found

    def speeds_by(self, forces: FloatArray) -> FloatArray:
        """Return the change of speeds, or the accelerations, that impulses, or forces, make."""
        found: FloatArray = self._by_each[: len(self.u)] @ forces
        return found

    def limits_at(self, forces: FloatArray) -> tuple[Limits, Limits]:
        """Return the limits of all units near some forces of the rows, forwards and backwards: ``L(f) = L_0 + P f``."""
        layout, count, n = self.layout, len(self.contacts), len(self.u)
        ways, rest = np.zeros((len(layout.read), count)), np.zeros(len(layout.read))
        for k, (is_own, number) in enumerate(layout.sources):
            if is_own:
                ways[k, number] = 1.0
            else:
                ways[k], rest[k] = self._by_each[n + number], self._free[n + number]
        read = rest + ways @ forces
        if not np.array_equal(read, self.read):
            self.read = read
            self._take(self.u)
        found: list[FloatArray] = []
        heads = [rows[0] for rows in self.units]
        for limits, entries, places in zip(self._limits, self._shares, layout.shares, strict=True):
            slopes = np.zeros((count, len(self.read)))
            slopes[places] = entries
            shares = slopes @ ways
            found += [(limits - shares @ forces)[heads], shares[heads]]
        return Limits(*found[:4]), Limits(*found[4:])

    def chosen(
        self,
        chosen: list[int],
        free: FloatArray,
        given: dict[int, tuple[float, ...]],
        limits: tuple[Limits, Limits],
        pressed: FloatArray | None = None,
    ) -> Contacts:
        """Return what is asked of some units; what slips at gaps that are pressed already rubs whether they open."""
        rows = [row for k in chosen for row in self.units[k]]
        place = {row: i for i, row in enumerate(rows)}
        is_pressed = [pressed is not None and pressed[self.units[k][0]] > 0.0 for k in chosen]
        number = {k: i for i, k in enumerate(chosen) if not is_pressed[i]}
        units = tuple(
            Unit(
                tuple(place[row] for row in self.units[k]),
                self.layout.is_slip[k],
                given.get(k, (0.0,) * len(self.units[k])),
                number.get(self.gap_of[k], -1),
            )
            for k in chosen
        )
        ahead, back = (
            Limits(
                some.free[chosen],
                some.shares[chosen][:, rows],
                some.static_free[chosen],
                some.static_shares[chosen][:, rows],
            )
            for some in limits
        )
        response, sizes = self.response[rows][:, rows], self.row_sizes[rows]
        return Contacts(response, free[rows], units, ahead, back, self.compliance[rows], sizes)
