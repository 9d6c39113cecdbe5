"""`equilibria`: where a scene can stay at rest, and whether it does when it is disturbed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from typing import Any, Literal, NamedTuple, overload

import numpy as np

from atwood.arguments import BY_PATH, FLAG, optional, takes
from atwood.arrays import FloatArray
from atwood.display import count_of, data_of
from atwood.errors import AtwoodError, ParameterError, UsageError, check_known
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass, replace
from atwood.lazy_modules import scipy
from atwood.mechanics.kinematics.mechanism import extent
from atwood.model.compose.composite import Model
from atwood.model.values.units import parse_quantity, parse_unit
from atwood.pipeline import SCENE, smooth_assembly_of
from atwood.ranges import range_of
from atwood.simulation.contacts.chosen import has_contacts
from atwood.simulation.dynamics.balance import balance_of
from atwood.table import Shown, Table, table
from atwood.theory.formulas.notation import SYMBOLS
from atwood.theory.linear.normal_modes import NormalModes, modes_of, values_text
from atwood.theory.linear.operating_point import (
    OperatingPoint,
    find_operating_point,
    moved_to,
    plain_assembly,
    values_at,
)
from atwood.theory.linear.rest import Degenerate, Rest, RestSearch, difference, falling, follow_null_space, wrapped
from atwood.theory.linear.resting_contacts import RestingContacts, RestInSet
from atwood.theory.oscillations.equilibria import SymbolicEquilibria, symbolic_equilibria

_STARTS = 32
"""For each independent coordinate, so many starts of Newton's method, spread evenly over the region."""

_MOST_STARTS = 400

_LEAST = 48

_IDLE = 24
"""For each independent coordinate, so many starts one after another that lead to nothing new end the search."""

_OF_SETS = 0.25
"""Each of many sets of contacts, in which coordinates are fewer, is sought in with so much of this patience."""

_ALONE = 5.0

_SAG, _FARTHEST = 0.75, 1e4
"""In how far the stiffness at the start leads: the size of a scene; in sizes, what is no longer a sag."""

_NEARBY = 4
"""Of so many starts one is ten to a thousand times nearer to the scene's own start, where a well may be narrow."""

_FALLING = 0.3
"""Of the starts, this share goes where forces lead."""

_MEASURED = 9
"""At so many places of the region it is looked how large accelerations are."""

_IMAGED = 24
"""Of so many states images are looked at as well."""


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """A state of rest.

    Attributes
    ----------
    values
        Coordinates by path, m or rad; angles within half a turn of zero unless the region asks for others.
    stable
        Whether no small deviation grows: by the linear model, which says nothing of deviations that keep their size.
        Where that has no stiffness along some direction, by the first higher derivative that is not zero.
    modes
        Its normal modes; where equations depend on time though the state keeps still, those at the scene's start.
    stability
        ``"stable"``, ``"unstable"``, or ``"undecided"`` where no derivative that is looked at decides.
    family
        Along so many directions rest goes on: 0 of one that stands alone; 1 of a cart that may stand anywhere, of a
        ball in a circular groove, or of a block that friction holds. One state stands for all of a family.
    reserves
        What friction could hold besides, N or N m, of each slip that sticks, by path.
    ends
        Where rest goes on along one direction since something sticks: what changes, at both ends of the interval, by
        path.
    """

    values: Mapping[str, float]
    stable: bool
    modes: NormalModes = field(repr=False)
    stability: str = ""
    family: int = 0
    reserves: Mapping[str, float] = field(default_factory=dict)
    ends: tuple[Mapping[str, float], ...] = ()

    @property
    def contacts(self) -> Mapping[str, str]:
        """What each gap and slip does, by path."""
        return self.modes.contacts

    @property
    def growth_rate(self) -> float:
        """The largest growth rate, 1/s; zero where none grows."""
        return float(max(0.0, np.max(self.modes.growth_rates, initial=0.0)))

    def __str__(self) -> str:
        named = ", ".join(f"{path} = {value:.6g}" for path, value in list(self.values.items())[:6])
        return f"{self.stability:<9} {named}{self._besides}"

    @property
    def _besides(self) -> str:
        """What it is one of, what holds it, and how far."""
        said = f", one of a family in {count_of(self.family, 'direction')}" if self.family else ""
        if self.ends:
            first, last = self.ends
            said += ": " + ", ".join(f"{path} from {first[path]:.6g} to {last[path]:.6g}" for path in first)
        held = "".join(f"; {path} sticks, with {value:.6g} in reserve" for path, value in self.reserves.items())
        closed = [path for path, word in self.contacts.items() if word == "closed"]
        return said + held + (f"; closed: {', '.join(closed)}" if closed else "")


class Equilibria(Shown, list[Equilibrium]):
    """The equilibria of a scene in a region."""

    def __init__(self, found: list[Equilibrium], scene: str) -> None:
        super().__init__(found)
        self.scene = scene

    def to_data(self) -> list[dict[str, Any]]:
        """Return them as plain data, for JSON."""
        return [
            data_of(one, "values", "stable", "stability", "family", "contacts", "reserves", "ends", "modes")
            for one in self
        ]

    def tables(self) -> tuple[Table, ...]:
        """Return how stable each is, and where."""
        rows = [(one.stability, f"{one.growth_rate:.6g}", values_text(one.values) + one._besides) for one in self]
        title = f"{self.scene}: {len(self)} equilibri{'um' if len(self) == 1 else 'a'}"
        return (table(("", "growth, 1/s>", "where"), rows, title),)

    __str__ = Shown.as_text


REGION = optional(replace(BY_PATH, word="PATH=FROM:TO", typed=range_of))


@overload
def equilibria(
    scene: Model | Assembly, *, region: Mapping[str, Any] | None = ..., symbolic: Literal[False] = ...
) -> Equilibria: ...


@overload
def equilibria(
    scene: Model | Assembly, *, symbolic: Literal[True], symbols: Mapping[str, str] | None = ...
) -> SymbolicEquilibria: ...


@takes(scene=SCENE, region=REGION, symbolic=FLAG, symbols=SYMBOLS)
def equilibria(
    scene: Model | Assembly,
    *,
    region: Mapping[str, Any] | None = None,
    symbolic: bool = False,
    symbols: Mapping[str, str] | None = None,
) -> Equilibria | SymbolicEquilibria:
    """Find the states of rest of a scene in a region, or as formulas.

    Newton's method is started at places spread evenly over the region, so that nothing is proven: of equilibria that
    lie very close to each other one can be missed. States that differ along a direction in which nothing changes (a
    cart that may stand anywhere) count as one.

    With gaps and slips all sets of closed gaps are looked at, and a state counts if all forces push, all friction is
    within its limit and nothing is inside of anything. What sticks lets rest go on: `Equilibrium.family` says along how
    many directions, `ends` how far along one. Such states are sought where friction has nothing to hold, and where
    there are none of these, at what sticks where the scene starts.

    Parameters
    ----------
    scene
        The scene, or an assembly of it. Driven parts move: rest is that of its generalized coordinates, as of a bead on
        a hoop that turns evenly.
    region
        For coordinates by path the least and the largest value: ``{"rod.angle": ("-90 deg", "90 deg")}``. All angles,
        and lengths up to twice the scene's extent, if not given.
    symbolic
        Whether to solve V' = 0 in closed form: each state as a formula of the parameters, with the range of these in
        which it exists and in which it is stable. An assembly says in which form, and in which angles.
    symbols
        See `equations`: letters of formulas by path. Two parameters that have one letter are equal.

    Returns
    -------
    Equilibria, SymbolicEquilibria
        A list, in the order of its coordinates; of formulas if ``symbolic``.

    Raises
    ------
    UsageError
        If there is none in the region, or the scene stays nowhere at rest since it depends on time.
    UnsupportedError
        If ``symbolic``, and there is no closed form that one would find by hand; or if more than five gaps may close.
    ParameterError
        If the region names no coordinate.
    """
    if symbolic:
        if region is not None:
            raise UsageError("`symbolic` finds all states of rest", where="equilibria", advice="Leave out the region.")
        return symbolic_equilibria(smooth_assembly_of(scene, form=None, orientation=None), symbols)
    if symbols is not None:
        raise UsageError("numbers have no letters", where="equilibria", advice="Give symbolic=True.")
    return numeric_equilibria(scene, region)


def numeric_equilibria(scene: Model | Assembly, region: Mapping[str, Any] | None = None) -> Equilibria:
    """Return the states of rest of a scene in a region, found by Newton's method."""
    base = plain_assembly(scene)
    if has_contacts(base):
        return _with_contacts(RestingContacts(base), region or {})
    point = find_operating_point(base, {}, ())
    sought = _sought(point, region or {})
    if not sought.inside:
        raise _none_found(point, sought.every, bool(region), sought.seen_moving)
    return _in_order([_equilibrium(sought.point, sought.search, one, q) for one, q in sought.inside], point)


def _in_order(made: list[Equilibrium], point: OperatingPoint) -> Equilibria:
    made.sort(key=lambda one: tuple(round(value, 9) for value in one.values.values()))
    return Equilibria(made, point.assembly.flat.name)


class _Sought(NamedTuple):
    """What is found in a region.

    Attributes
    ----------
    point, search
        The scene in the sizes of the region, and what seeks there.
    inside, every
        The states of rest in the region, as they are told, and how many there are in all.
    seen_moving
        Whether something rests at one time and not at others.
    """

    point: OperatingPoint
    search: RestSearch
    inside: list[tuple[Degenerate, FloatArray]]
    every: int
    seen_moving: bool


def _sought(point: OperatingPoint, region: Mapping[str, Any], push: float = 0.0, patience: float = 1.0) -> _Sought:
    """Seek states of rest in a region, where accelerations are large from a size on, with more or less patience."""
    point = replace(point, scene=point.scene.sized(_length(point)))
    bounds = _bounds(point, region)
    lengths = [k for _, k in point.scene.tangents.plain if point.scene.tangents.names[k] in region]
    widths = [float(np.ptp(bounds[k])) / 4.0 for k in lengths if point.scene.tangents.units[k] == "m"]
    point = replace(point, scene=point.scene.sized(max(widths, default=point.scene.length)))
    search = RestSearch(point.scene, balance_of(point.assembly, "reduced"), point.t, point.kept)
    found, seen_moving = _found(point, search, bounds, push, patience)
    settled = [(one, _settled(point, search, one, bounds)) for one in found]
    inside = [(one, q) for one, q in settled if _is_inside(point, q, bounds)]
    return _Sought(point, search, inside, len(found), seen_moving)


def _length(point: OperatingPoint) -> float:
    """Return the size of a scene; of a body alone in a field some times as far as from the origin to its start.

    It is larger where the stiffness at the start leads farther: a soft spring sags by many times its length.
    """
    own = [i for i, k in point.scene.tangents.plain if point.scene.tangents.units[k] == "m"]
    length = point.scene.length
    if not extent(point.assembly.mechanism) and length == 1.0:
        length = _ALONE * float(np.max(np.abs(point.q[own]), initial=0.0)) or length
    search = RestSearch(point.scene.sized(length), balance_of(point.assembly, "reduced"), point.t, point.kept)
    start = search.at(point.q)
    step = None if start is None else falling(start)
    if start is None or step is None:
        return length
    reach = float(np.max(np.abs(search.moved(start, step)[own]), initial=0.0))
    return max(length, _SAG * reach) if reach <= _FARTHEST * length else length


def _none_found(point: OperatingPoint, found: int, given: bool, seen_moving: bool) -> AtwoodError:
    name = point.assembly.flat.name
    if seen_moving:
        return UsageError(
            "it stays nowhere at rest: its equations depend on time",
            where=name,
            advice="Equilibria belong to scenes whose drives and sources keep still or turn evenly.",
        )
    more = f"; {found} lie outside of it" if found and given else ""
    advice = "Give a larger region." if found and given else "Look for a steady motion instead, with `trim`."
    return UsageError(f"there is no equilibrium in the region{more}", where=name, advice=advice)


def _bounds(point: OperatingPoint, region: Mapping[str, Any]) -> FloatArray:
    """Return the least and the largest value of each displacement, shape (displacements, 2)."""
    scene = point.scene
    found = np.array(
        [
            [-np.pi, np.pi] if unit == "rad" else [-2.0 * scene.length, 2.0 * scene.length]
            for unit in scene.tangents.units
        ]
    ).reshape(len(scene.tangents), 2)
    number = {scene.tangents.names[k]: k for _, k in scene.tangents.plain}
    for path, given in region.items():
        check_known(path, number, "there is no such coordinate", error=ParameterError)
        k = number[path]
        try:
            low, high = (_in_si(one, scene.tangents.units[k], path) for one in given)
        except (TypeError, ValueError):
            low, high = 0.0, 0.0
        if not low < high:
            raise UsageError(
                f"its region cannot be {given!r}", where=path, advice="Give the least and the largest value."
            )
        found[k] = low, high
    return found


def _in_si(value: Any, unit: str, path: str) -> float:
    return float(parse_quantity(value, parse_unit(unit), path)) if isinstance(value, str) else float(value)


def _found(
    point: OperatingPoint, search: RestSearch, bounds: FloatArray, push: float, patience: float
) -> tuple[list[Degenerate], bool]:
    """Return the states of rest that Newton's method finds from places all over the region, and their images."""
    free = max(1, len(point.scene.tangents) - len(point.kept))
    places = [point.q, *_places(point, bounds, min(_MOST_STARTS, _STARTS * free))]
    search.measure(places[:_MEASURED])
    search.push = max(search.push, push)
    found: list[Degenerate] = []
    images: list[FloatArray] = []
    seen_moving, idle, taken = False, 0, 0
    chance = np.random.default_rng(7)
    while (taken < len(places) and idle <= patience * max(_LEAST, _IDLE * free)) or images:
        is_image = bool(images)
        q = images.pop() if is_image else places[taken]
        taken += not is_image
        rest = search.seek(q, falls=not is_image and (taken == 1 or chance.random() < _FALLING))
        idle += not is_image
        if rest is None or any(search.same(one.rest, rest) for one in found):
            continue
        idle = 0
        if not search.stays(rest, _LATER):
            seen_moving = True
            continue
        made = follow_null_space(search, rest)
        if made.rest is not rest and any(search.same(one.rest, made.rest) for one in found):
            continue
        if len(found) < patience * _IMAGED:
            images += _images(point, made.rest, [one.rest for one in found])
        images += made.beside
        found.append(made)
    return found, seen_moving


def _images(point: OperatingPoint, rest: Rest, others: Sequence[Rest]) -> list[FloatArray]:
    """Return places where a symmetric scene has more: mirrored, half a turn away, and halfway to the others."""
    made = []
    for i, k in point.scene.tangents.plain:
        for value in (-rest.q[i], rest.q[i] + np.pi) if point.scene.tangents.units[k] == "rad" else (-rest.q[i],):
            made.append(rest.q.copy())
            made[-1][i] = value
    for one in others:
        apart = wrapped(point.scene, difference(point.scene, rest.q, one.q))
        turned = np.array([unit == "rad" for unit in point.scene.tangents.units]) * 2.0 * np.pi
        made += [point.scene.tangents.moved(rest.q, 0.5 * (apart - turn * np.sign(apart))) for turn in (0.0, turned)]
    return made


_LATER = (0.3819660112501051, 1.2360679774997896)
"""Times after the start, s, at which a state must be one of rest too."""


def _places(point: OperatingPoint, bounds: FloatArray, count: int) -> Iterator[FloatArray]:
    scene = point.scene
    size = len(bounds)
    if not size:
        return
    # Each kind of start has a sequence of its own: every so many of one lie in one part of the region.
    wide, close = (scipy.stats.qmc.Halton(size, seed=seed).random(count) for seed in (7, 8))
    for number in range(count):
        is_near, turn = number % _NEARBY == _NEARBY - 1, number // _NEARBY
        row, near = (close[turn], 10.0 ** -(1 + turn % 3)) if is_near else (wide[number - turn], 1.0)
        values = bounds[:, 0] + row * (bounds[:, 1] - bounds[:, 0])
        q = point.q.copy()
        for i, k in scene.tangents.plain:
            q[i] = values[k] if near == 1.0 else q[i] + near * (values[k] - q[i])
        moved = np.zeros(size)
        for _, numbers in scene.tangents.orientation_coordinates:
            moved[list(numbers)] = values[list(numbers)]
        yield scene.tangents.moved(q, moved)


def _wrapped(point: OperatingPoint, rest: Rest, bounds: FloatArray) -> dict[int, float]:
    """Return the coordinates that have one number each, angles moved by whole turns into the region."""
    found = {}
    for i, k in point.scene.tangents.plain:
        value = float(rest.q[i])
        if point.scene.tangents.units[k] == "rad":
            low, high = bounds[k]
            middle = 0.5 * (low + high)
            value -= 2.0 * np.pi * np.round((value - middle) / (2.0 * np.pi))
            if abs(value + np.pi) < 1e-9 and high >= np.pi:
                value += 2.0 * np.pi
        found[i] = value
    return found


def _settled(point: OperatingPoint, search: RestSearch, one: Degenerate, bounds: FloatArray) -> FloatArray:
    """Return the coordinates of a state as they are told; each change of them is put into the balance.

    Angles come into the region by whole turns, what is zero but for rounding is zero, and what means nothing, or may be
    anywhere, stays where it starts.
    """
    q = one.rest.q

    def is_one(there: FloatArray) -> bool:
        rest = search.at(there)  # where constraints put it elsewhere, that is another state
        met = rest is not None and rest.push <= max(one.rest.push, 1e-12 * search.push)
        return met and rest is not None and search.alike(rest.q, there)

    wrapped_values = _wrapped(point, one.rest, bounds)
    for i, k in point.scene.tangents.plain:
        size, start = point.scene.displacement_sizes[k], float(point.q[i])
        near = 0.0 if abs(wrapped_values[i]) <= _TINY * size else wrapped_values[i]
        # At a pole itself angles have no accelerations.
        for value in (wrapped_values[i], wrapped_values[i] + 1e-4 * _TINY * size, near, start):
            there = q.copy()
            there[i] = value
            if abs(value - q[i]) <= 1e-3 * _TINY * size * (value != 0.0) or not is_one(there):
                continue
            if value == start and not search.alike(there, q):
                halfway = 0.5 * (there + q)
                if not one.family or not is_one(halfway):
                    continue
            q = there
    return q


_TINY = 1e-9
"""Relative to the scene's sizes: values below it are told as zero, if that is as much at rest."""


def _is_inside(point: OperatingPoint, q: FloatArray, bounds: FloatArray) -> bool:
    for i, k in point.scene.tangents.plain:
        margin = 1e-9 * max(1.0, abs(bounds[k, 0]), abs(bounds[k, 1]))
        if not bounds[k, 0] - margin <= q[i] <= bounds[k, 1] + margin:
            return False
    return True


def _equilibrium(point: OperatingPoint, search: RestSearch, one: Degenerate, q: FloatArray) -> Equilibrium:
    there = moved_to(point, q, np.zeros_like(point.u))
    modes = modes_of(there, is_steady=True)
    speeds = set(list(values_at(there))[len(point.scene.tangents.plain) :])
    values = {path: value for path, value in values_at(there).items() if path not in speeds}
    for i, k in point.scene.tangents.plain:
        if abs(q[i]) <= 1e-3 * _TINY * point.scene.displacement_sizes[k]:
            values[point.scene.tangents.names[k]] = 0.0
    # Where there is no stiffness, eigenvalues are the root of what is left of it.
    if one.verdict and float(np.max(modes.growth_rates, initial=0.0)) <= _CREEPS * np.sqrt(search.slope):
        stability = one.verdict
    else:
        stability = "stable" if modes.is_stable else "unstable"
    return Equilibrium(values, stability == "stable", modes, stability, one.family)


def _with_contacts(contacts: RestingContacts, region: Mapping[str, Any]) -> Equilibria:
    """Return the states of rest in all sets of contacts."""
    made: list[Equilibrium] = []
    rests: list[RestInSet] = []
    push = 0.0
    apart: list[set[int]] = []  # gaps that cannot be closed together
    for closed in contacts.sets():
        for sticks in (False, True):
            known = any(one.closed == closed for one in rests) if sticks else any(one <= {*closed} for one in apart)
            point = None if known else contacts.point(closed, sticks)
            if point is None:
                apart += [] if known or sticks else [{*closed}]
                break
            sought = _sought(point, region, push, _OF_SETS)
            push = max(push, sought.search.push)
            for one, q in sought.inside:
                rest = contacts.rest(sought.point, q, closed)
                if rest is not None and not any(rest.is_at(other) for other in rests):
                    rests.append(rest)
                    made.append(_resting(contacts, rest, one, sought.search))
                    if sticks:
                        break
    if not made:
        raise UsageError(
            "there is no equilibrium in the region, whatever touches and sticks",
            where=contacts.assembly.flat.name,
            advice="What sticks is looked at where the scene starts: start it elsewhere, or give a larger region.",
        )
    return _in_order(made, rests[0].point)


def _resting(contacts: RestingContacts, rest: RestInSet, one: Degenerate, search: RestSearch) -> Equilibrium:
    """Return a state of rest with contacts as it is told."""
    found = _equilibrium(rest.point, search, one, rest.point.q)
    stability = found.stability if rest.is_strict else "undecided"
    return replace(
        found,
        stability=stability,
        stable=stability == "stable",
        family=rest.stuck or one.family,
        reserves=rest.found.reserves,
        ends=contacts.ends(rest),
    )


_CREEPS = 2e-3
"""Relative to the square root of slopes elsewhere: growth rates that are the root of a stiffness without digits."""
