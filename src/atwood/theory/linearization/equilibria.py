"""`equilibria`: where a scene can stay at rest, and whether it does when it is disturbed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any

import numpy as np

from atwood.analysis.linear.rest import Rest, is_at_rest, same_rest, seek_rest
from atwood.arguments import BY_PATH, optional, takes
from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, ParameterError, UsageError, suggestion
from atwood.forms.assembly import Assembly
from atwood.late import dataclass
from atwood.model.compose.composite import Model
from atwood.model.values.units import parse_quantity, parse_unit
from atwood.pipeline import SCENE
from atwood.showing import fitted
from atwood.simulation.dynamics.balance import balance_of
from atwood.theory.linearization.normal_modes import NormalModes, modes_of
from atwood.theory.linearization.operating_point import OperatingPoint, find_operating_point, moved_to, values_at

__all__ = ["Equilibria", "Equilibrium", "equilibria"]


_STARTS = 32
"""For each independent coordinate, so many starts of Newton's method, spread evenly over the region."""

_MOST_STARTS = 400

_LEAST = 48

_IDLE = 24
"""For each independent coordinate, so many starts one after another that lead to nothing new end the search."""


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """A state of rest.

    Attributes
    ----------
    values
        Coordinates by path, m or rad; angles within half a turn of zero unless the region asks for others.
    stable
        Whether no small deviation grows: of the linear model, which says nothing of deviations that keep their size.
    modes
        Its normal modes; where equations depend on time though the state keeps still, those at the scene's start.
    """

    values: Mapping[str, float]
    stable: bool
    modes: NormalModes = field(repr=False)

    @property
    def growth_rate(self) -> float:
        """The largest growth rate, 1/s; zero where none grows."""
        return float(max(0.0, np.max(self.modes.growth_rates, initial=0.0)))

    def __str__(self) -> str:
        named = ", ".join(f"{path} = {value:.6g}" for path, value in list(self.values.items())[:6])
        return f"{'stable  ' if self.stable else 'unstable'}  {named}"


class Equilibria(list[Equilibrium]):
    """The equilibria of a scene in a region."""

    def __init__(self, found: list[Equilibrium], scene: str) -> None:
        super().__init__(found)
        self.scene = scene

    def to_data(self) -> list[dict[str, Any]]:
        """Return them as plain data, for JSON."""
        return [{"values": dict(one.values), "stable": one.stable, "modes": one.modes.to_data()} for one in self]

    def __str__(self) -> str:
        shown = [str(one) for one in self[:8]]
        if len(self) > len(shown):
            shown.append(f"... and {len(self) - len(shown)} more")
        return "\n".join([f"{self.scene}: {len(self)} equilibri{'um' if len(self) == 1 else 'a'}", *shown])

    def __repr__(self) -> str:
        return fitted(str(self))


@takes(scene=SCENE, region=optional(BY_PATH))
def equilibria(scene: Model | Assembly, *, region: Mapping[str, Any] | None = None) -> Equilibria:
    """Find the states of rest of a scene in a region.

    Newton's method is started at places spread evenly over the region, so that nothing is proven: of equilibria that
    lie very close to each other one can be missed. States that differ along a direction in which nothing changes (a
    cart that may stand anywhere) count as one.

    Parameters
    ----------
    scene
        The scene, or an assembly of it. Driven parts move: rest is that of its generalized coordinates, as of a bead on
        a hoop that turns evenly.
    region
        For coordinates by path the least and the largest value: ``{"rod.angle": ("-90 deg", "90 deg")}``. All angles,
        and lengths up to twice the scene's extent, if not given.

    Returns
    -------
    Equilibria
        A list, in the order of its coordinates.

    Raises
    ------
    UsageError
        If there is none in the region, or the scene stays nowhere at rest since it depends on time.
    ParameterError
        If the region names no coordinate.
    """
    point = find_operating_point(scene, {}, ())
    bounds = _bounds(point, region or {})
    found, seen_moving = _search(point, bounds)
    inside = [one for one in found if _is_inside(point, one, bounds)]
    if not inside:
        raise _none_found(point, found, bool(region), seen_moving)
    made = [_equilibrium(point, one, bounds) for one in inside]
    made.sort(key=lambda one: tuple(round(value, 9) for value in one.values.values()))
    return Equilibria(made, point.assembly.flat.name)


def _none_found(point: OperatingPoint, found: list[Rest], given: bool, seen_moving: bool) -> AtwoodError:
    name = point.assembly.flat.name
    if seen_moving:
        return UsageError(
            "it stays nowhere at rest: its equations depend on time",
            where=name,
            advice="Equilibria belong to scenes whose drives and sources keep still or turn evenly.",
        )
    more = f"; {len(found)} lie outside of it" if found and given else ""
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
        if path not in number:
            raise ParameterError("there is no such coordinate", where=path, advice=suggestion(path, list(number)))
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


def _search(point: OperatingPoint, bounds: FloatArray) -> tuple[list[Rest], bool]:
    """Return the states of rest that Newton's method finds from places all over the region."""
    scene, balance = point.scene, balance_of(point.assembly, "reduced")
    free = max(1, len(scene.tangents) - len(point.kept))
    starts = min(_MOST_STARTS, _STARTS * free)
    found: list[Rest] = []
    seen_moving, idle = False, 0
    for q in [point.q, *_places(point, bounds, starts)]:
        rest = seek_rest(scene, balance, point.t, q, point.kept)
        idle += 1
        if idle > max(_LEAST, _IDLE * free):
            break
        if rest is None or any(same_rest(scene, one, rest, point.t, point.kept, balance) for one in found):
            continue
        idle = 0
        if not is_at_rest(scene, rest, point.t, point.kept, _LATER):
            seen_moving = True
            continue
        found.append(rest)
    return found, seen_moving


_LATER = (0.3819660112501051, 1.2360679774997896)
"""Times after the start, s, at which a state must be one of rest too."""


def _places(point: OperatingPoint, bounds: FloatArray, count: int) -> list[FloatArray]:
    scene = point.scene
    size = len(bounds)
    if not size:
        return []
    from scipy.stats import qmc  # a third of a second

    spread = qmc.Halton(size, seed=7).random(count)
    made = []
    for row in spread:
        values = bounds[:, 0] + row * (bounds[:, 1] - bounds[:, 0])
        q = point.q.copy()
        for i, k in scene.tangents.plain:
            q[i] = values[k]
        moved = np.zeros(size)
        for _, numbers in scene.tangents.orientation_coordinates:
            moved[list(numbers)] = values[list(numbers)]
        made.append(scene.tangents.moved(q, moved))
    return made


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


def _is_inside(point: OperatingPoint, rest: Rest, bounds: FloatArray) -> bool:
    values = _wrapped(point, rest, bounds)
    flat = _flat_displacements(rest)
    for i, k in point.scene.tangents.plain:
        margin = 1e-9 * max(1.0, abs(bounds[k, 0]), abs(bounds[k, 1]))
        if k not in flat and not bounds[k, 0] - margin <= values[i] <= bounds[k, 1] + margin:
            return False
    return True


def _flat_displacements(rest: Rest) -> set[int]:
    """Return the displacements along which nothing changes: their value means nothing."""
    columns = np.max(np.abs(rest.slopes), axis=0, initial=0.0)
    return {k for k, size in zip(rest.minimal.displacements, columns, strict=True) if size < 1e-9}


def _equilibrium(point: OperatingPoint, rest: Rest, bounds: FloatArray) -> Equilibrium:
    q = rest.q.copy()
    flat = _flat_displacements(rest)
    for (i, value), (_, k) in zip(_wrapped(point, rest, bounds).items(), point.scene.tangents.plain, strict=True):
        q[i] = point.q[i] if k in flat else value  # what does not matter stays where it starts
    there = moved_to(point, q, np.zeros_like(point.u))
    modes = modes_of(there, is_steady=True)
    speeds = set(list(values_at(there))[len(point.scene.tangents.plain) :])
    values = {path: value for path, value in values_at(there).items() if path not in speeds}
    return Equilibrium(values, modes.is_stable, modes)
