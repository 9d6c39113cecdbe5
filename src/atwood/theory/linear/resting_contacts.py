"""Rest with contacts: which sets it may be in, whether its forces allow it, and how far it goes on.

At rest a gap is closed or open, and what may rub sticks, or slips past a surface that runs. Where something sticks rest
goes on along as many directions as it holds, up to where a force or a reserve vanishes. So places are sought without
friction, where it has nothing to hold, and where these are none, in what sticks as the scene starts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from itertools import chain, combinations

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, UnsupportedError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.numerics.contact_sets import GOES_ON, OPEN, STICKS, State
from atwood.numerics.rank import null_space
from atwood.simulation.contacts.chosen import ContactSet, in_set, margins_in, set_of, state_in_set, states_by_path
from atwood.simulation.contacts.forces import forces_in
from atwood.simulation.contacts.values import ContactValues, layout_of
from atwood.simulation.dynamics.balance import balance_of
from atwood.simulation.dynamics.scales import Scales, find_scales
from atwood.simulation.initialization.start import Start, find_start
from atwood.theory.linear.operating_point import OperatingPoint, moved_to, point_at, start_at, values_at
from atwood.theory.linear.rest import RestSearch, slopes_at
from atwood.theory.linear.variations import LinearScene
from atwood.tolerances import tolerances

_MOST_GAPS = 5
"""Sets of so many gaps are looked through; of more there are too many."""

_SAME = 1e-6
"""Relative to sizes of the scene: places that differ by less are one."""

_STEP, _FARTHEST, _HALVINGS = 1e-3, 1e3, 44
"""In sizes of the scene: the first step along a direction of rest, and how far it is followed; how exactly its end is
found."""


@dataclass(frozen=True, eq=False)
class RestInSet:
    """A state of rest with contacts.

    Attributes
    ----------
    point
        The state, in its set.
    found
        The set, with forces and reserves.
    place
        Where everything is and how it is turned, whole turns aside; see `RestSearch.configuration`.
    stuck
        Along so many directions what sticks lets rest go on, neutral ones included; 0 where nothing sticks.
    closed
        Numbers of the gaps that are closed.
    """

    point: OperatingPoint
    found: ContactSet
    place: FloatArray
    stuck: int
    closed: tuple[int, ...]

    def is_at(self, other: RestInSet) -> bool:
        """Return whether everything is in the same places."""
        return bool(np.max(np.abs(self.place - other.place), initial=0.0) <= _SAME)

    @property
    def is_strict(self) -> bool:
        """Whether neighbours are in the same set."""
        return all(one.is_strict for one in self.found.margins)


class RestingContacts:
    """The sets of contacts in which a scene may rest.

    Parameters
    ----------
    assembly
        The scene, in generalized coordinates with quaternions.
    """

    def __init__(self, assembly: Assembly) -> None:
        self.assembly = start_at(assembly, {})
        self.layout = layout_of(self.assembly)
        self.gaps = [k for k, is_slip in enumerate(self.layout.is_slip) if not is_slip]
        if len(self.gaps) > _MOST_GAPS:
            raise UnsupportedError(
                f"{len(self.gaps)} gaps may be open or closed at rest, in too many sets to look at",
                where=self.layout.first[self.gaps[0]].row.key[0],
                advice="Let `simulate` bring the scene to rest, and linearise it there: `at=(result, time)`.",
            )

    @cached_property
    def start(self) -> Start:
        """A place near the scene's start."""
        return find_start(self.assembly)

    @cached_property
    def _places(self) -> RestSearch:
        """Tells places of the whole scene apart."""
        scene = LinearScene(self.assembly, "reduced")
        return RestSearch(scene, balance_of(self.assembly, "reduced"), self.start.time, ())

    def sets(self) -> Iterator[tuple[int, ...]]:
        """Yield which gaps may be closed: first as few as there can be."""
        return chain.from_iterable(combinations(self.gaps, n) for n in range(len(self.gaps) + 1))

    def point(self, closed: Sequence[int], sticks: bool) -> OperatingPoint | None:
        """Return the scene with gaps closed, without friction or with all that may stick; None if that cannot be."""
        start = self.start
        values = self._values(start.coordinates)
        states = self._states(values, closed, STICKS if sticks else OPEN)
        if sticks and not any(state == STICKS for k, (state, _) in enumerate(states) if self.layout.is_slip[k]):
            return None
        made = in_set(self.assembly, states_by_path(self.layout.first, states))
        try:
            own = find_start(made)
            return point_at(made, own.time, own.coordinates, np.zeros_like(own.speeds))
        except AtwoodError:  # gaps that cannot be closed together
            return None

    def rest(self, point: OperatingPoint, q: FloatArray, closed: tuple[int, ...]) -> RestInSet | None:
        """Return a state of rest as one with contacts; None where forces or gaps would be negative."""
        now = self.base_place(point, q)
        values = self._values(now)
        states = self._states(values, closed, STICKS)
        forces = forces_in(values, states)
        ahead, back = values.limits_at(forces)
        for k, (state, way) in enumerate(states):
            static = max(side.static_free[k] + float(side.static_shares[k] @ forces) for side in (ahead, back))
            if self.layout.is_slip[k] and state == STICKS and static <= 0.0:
                states[k] = OPEN, (0.0,) * len(way)  # pressed no longer
        margins = margins_in(values, states, self._scales(values))
        if not all(one.is_met for one in margins):
            return None
        found = set_of(self.assembly.flat, self.layout.first, states, margins)
        made = in_set(self.assembly, found.states)
        place, _ = state_in_set(self.assembly, made, point.t, now, np.zeros_like(self.start.speeds), self.start.length)
        there = point_at(made, point.t, place, np.zeros(len(made.regular.speeds)), contacts=found.words)
        held = any(state == STICKS for k, (state, _) in enumerate(states) if self.layout.is_slip[k])
        stuck = self._free_directions(there).shape[1] if held else 0
        return RestInSet(there, found, self._places.configuration(now), stuck, closed)

    def ends(self, one: RestInSet) -> tuple[Mapping[str, float], ...]:
        """Return both ends of an interval of rest: what changes along it, by path; nothing where it has none."""
        if one.stuck != 1:
            return ()
        point = one.point
        search = RestSearch(point.scene, balance_of(point.assembly, "reduced"), point.t, point.kept)
        search.push = np.inf
        first = search.at(point.q)
        if first is None:
            return ()
        [way] = self._free_directions(point).T

        def at(distance: float) -> FloatArray | None:
            rest = search.seek(search.moved(first, distance * way))
            if rest is None:
                return None
            values = self._values(self.base_place(point, rest.q))
            margins = margins_in(values, self._states(values, one.closed, STICKS), self._scales(values))
            return rest.q if all(each.value >= 0.0 for each in margins) else None

        found = []
        for sign in (-1.0, 1.0):
            inside, outside = 0.0, sign * _STEP
            while at(outside) is not None:
                inside, outside = outside, 2.0 * outside
                if abs(outside) > _FARTHEST:
                    return ()
            for _ in range(_HALVINGS):
                middle = 0.5 * (inside + outside)
                inside, outside = (inside, middle) if at(middle) is None else (middle, outside)
            last = at(inside)  # none where the state itself is the end, but for rounding
            found.append(values_at(moved_to(point, point.q if last is None else last, np.zeros_like(point.u))))
        names = [point.scene.tangents.names[k] for _, k in point.scene.tangents.plain]
        return tuple({name: side[name] for name in names if found[0][name] != found[1][name]} for side in found)

    def base_place(self, point: OperatingPoint, q: FloatArray) -> FloatArray:
        """Return the coordinates of the scene with all sets at a place of one of its sets."""
        still = np.zeros(len(point.u))
        return state_in_set(point.assembly, self.assembly, point.t, q, still, self.start.length)[0]

    def _values(self, q: FloatArray) -> ContactValues:
        return ContactValues(self.assembly, self.start.time, q, np.zeros_like(self.start.speeds), self.start.length)

    def _scales(self, values: ContactValues) -> Scales:
        return find_scales(self.assembly, self.start.length, values.u, values.falling, values.sizes, 1.0)

    def _states(self, values: ContactValues, closed: Sequence[int], held: int) -> list[State]:
        """Return states with some gaps closed: what may rub is as given, or slips where its surface runs."""
        small = tolerances.CLOSED * self._scales(values).length / self._scales(values).time
        found: list[State] = []
        for k, rows in enumerate(self.layout.units):
            none, rates = (0.0,) * len(rows), values.rates[list(rows)]
            speed, at = float(np.linalg.norm(rates)), self.layout.gap_of[k]
            if not self.layout.is_slip[k]:
                found.append((STICKS if k in closed else OPEN, none))
            elif at >= 0 and at not in closed:
                found.append((OPEN, none))
            else:
                found.append((GOES_ON, tuple(map(float, rates / speed))) if speed > small else (held, none))
        return found

    def _free_directions(self, point: OperatingPoint) -> FloatArray:
        """Return the directions along which rest goes on to first order, scaled, as columns."""
        flow = point.scene.flow(point.t, point.q, np.zeros_like(point.u), point.kept)
        _, _, slopes = slopes_at(point.scene, flow, point.kept)
        return null_space(slopes, tolerances.RANK * float(np.max(np.abs(slopes), initial=0.0)))
