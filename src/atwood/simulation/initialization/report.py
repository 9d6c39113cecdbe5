"""What the start moved: how far bodies are from where they were placed roughly, and what moved them.

A fixed start value holds exactly; it is where the user put something. A guess is where something is roughly. The rough
place is the one that meets both as well as they go together, with coordinates of which nothing is said at zero; loops
are open there. From it the constraints, and fixed values that guesses contradict, move bodies to the start. What is
said of a body tells its position, its orientation, both or neither: only what is told can be moved, the rest is placed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.display import data_of
from atwood.expr import Expression, Program, jacobian
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.quantities import coordinate_program
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import Equations
from atwood.numerics.matrices import least_norm, scaled, to_array
from atwood.numerics.rank import independent_rows, open_directions, row_scales
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of
from atwood.simulation.dynamics.scales import motion_scales
from atwood.simulation.initialization.closure_error import ClosureError, find_closure_errors
from atwood.simulation.initialization.start import Start, with_closed
from atwood.simulation.initialization.system import Level, System, sort_targets
from atwood.table import Table, table
from atwood.tolerances import tolerances

_SHARE = 0.2
"""What moves a body by less than this share of what the first one does is not named."""

_Entries = tuple[Any, Any, tuple[int, int]]
_GUESSES: Key[Program] = Key("guessed quantities")
_BODIES: Key[tuple[Program, Program, _Entries]] = Key("places of bodies")


@dataclass(frozen=True)
class MovedBody:
    """A body that is elsewhere at the start than where it was placed roughly.

    Attributes
    ----------
    path
        The body, named after its leading part.
    distance
        By how much its centre of mass (of a body without mass: its root) moved, m.
    angle
        By how much it turned, rad, between 0 and pi.
    position_said, orientation_said
        Whether what was said at the start told its position, and its orientation; what was not told was placed by the
        solver and not moved.
    by
        What moved it, most first: joints and ties, and fixed start values.
    """

    path: str
    distance: float
    angle: float
    position_said: bool
    orientation_said: bool
    by: tuple[str, ...]

    @property
    def moved(self) -> tuple[float, float]:
        """Distance and angle of what was said of it: m and rad."""
        return self.distance if self.position_said else 0.0, self.angle if self.orientation_said else 0.0

    @property
    def placed(self) -> tuple[float, float]:
        """Distance and angle of what was not said of it, from its place at coordinates of zero: m and rad."""
        return 0.0 if self.position_said else self.distance, 0.0 if self.orientation_said else self.angle


@dataclass(frozen=True)
class GuessMet:
    """A guess, and what became of it.

    Attributes
    ----------
    path, unit
        The quantity.
    asked, found
        Its guess, and its value at the start.
    off
        The difference, within half a turn for an angle.
    """

    path: str
    unit: str
    asked: float
    found: float
    off: float


@dataclass(frozen=True)
class InitializationReport:
    """What the start moved.

    Attributes
    ----------
    bodies
        Bodies that are elsewhere than where they were placed roughly; what was said and moved first, and the largest
        movements first.
    guesses
        All guesses, those that are missed most first.
    opened
        Joints and ties that were open at the rough place, the widest first.
    length
        Extent of the scene, m, with which lengths are compared with angles.
    """

    bodies: tuple[MovedBody, ...]
    guesses: tuple[GuessMet, ...]
    opened: tuple[ClosureError, ...]
    length: float

    def tables(self) -> tuple[Table, ...]:
        """Return the bodies that moved, the guesses, and what was open."""
        length = self.length
        bodies = [
            (one.path, _how_far(*one.moved, length) or "-", _how_far(*one.placed, length) or "-", ", ".join(one.by))
            for one in self.bodies
        ]
        guesses = [
            (one.path, f"{one.asked:.6g}", *_met(one, length), "" if one.unit == "1" else one.unit)
            for one in self.guesses
        ]
        opened = [(one.part, one.describe(length)) for one in self.opened]
        found: list[tuple[tuple[str, ...], Sequence[tuple[str, ...]]]] = [
            (("body", "moved", "placed", "by"), bodies),
            (("guess", "asked", "found", "off by", "unit"), guesses),
            (("was open", "by"), opened),
        ]
        return tuple(table(headings, rows) for headings, rows in found if rows)

    def __str__(self) -> str:
        tables = "\n\n".join(one.text() for one in self.tables())
        return tables or "Nothing was moved: everything starts where it was said."

    @property
    def summary(self) -> str:
        """One line: what moved and by how much, and what was placed; empty if nothing was moved or placed."""
        moved = [f"{one.path} by {far}" for one in self.bodies if (far := _how_far(*one.moved, self.length))]
        placed = [one.path for one in self.bodies if _how_far(*one.placed, self.length)]
        text = [f"moved by the initialization: {_few(moved)}"] if moved else []
        if placed:
            what = "it" if len(placed) == 1 else "them"
            text.append(f"placed by the solver, as not all was said of {what}: {_few(placed)}")
        if self.opened and text:
            text.append(f"{self.opened[0].part} was open by {self.opened[0].describe(self.length)}")
        return "; ".join(text)

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return data_of(self, "bodies", "guesses", "opened")


_SHOWN = 3
"""So many bodies are named in a line."""


def _few(names: Sequence[str]) -> str:
    rest = len(names) - _SHOWN
    return ", ".join(names[:_SHOWN]) + (f" and {rest} more" if rest > 0 else "")


def _how_far(distance: float, angle: float, length: float) -> str:
    """Return a movement in words; rounding is left out."""
    said = [f"{distance:.3g} m"] if distance > tolerances.CLOSED * length else []
    return " and ".join([*said, *([f"{np.degrees(angle):.3g} deg"] if angle > tolerances.CLOSED else [])])


def _met(guess: GuessMet, length: float) -> tuple[str, str]:
    """Return what became of a guess and the difference, without rounding."""
    size = length if guess.unit == "m" else max(1.0, abs(guess.asked))
    is_met = abs(guess.off) <= tolerances.CLOSED * size
    return (f"{guess.asked:.6g}", "0") if is_met else (f"{guess.found:.6g}", f"{guess.off:.3g}")


def report_initialization(assembly: Assembly, start: Start) -> InitializationReport:
    """Find out what a start moved."""
    equations, t = with_closed(assembly), start.time
    guesses = _guesses(assembly, equations, start)
    if np.array_equal(start.rough, start.coordinates):
        return InitializationReport((), guesses, (), start.length)
    level, _ = sort_targets(assembly, equations)
    closure_errors = find_closure_errors(assembly, equations, t, start.rough, start.length)
    opened = [one for one in closure_errors if one.size(start.length) > tolerances.CLOSED]
    opened.sort(key=lambda one: -one.size(start.length))
    bodies = _Bodies(assembly, equations)
    distances, angles = bodies.apart(t, start.rough, start.coordinates)
    said = bodies.said(level, t, start)
    moving = [
        i
        for i in range(len(bodies.indices))
        if distances[i] > tolerances.CLOSED * start.length or (angles[i] > tolerances.CLOSED and bodies.turns[i])
    ]
    by = bodies.movers(level, start, moving)
    found = [MovedBody(bodies.names[i], float(distances[i]), float(angles[i]), *said[i], by[i]) for i in moving]

    def size(one: tuple[float, float]) -> float:
        return float(np.hypot(one[0] / start.length, one[1]))

    found.sort(key=lambda one: (-size(one.moved), -size(one.placed)))
    return InitializationReport(tuple(found), guesses, tuple(opened), start.length)


def _guesses(assembly: Assembly, equations: Equations, start: Start) -> tuple[GuessMet, ...]:
    given: Mapping[str, float] = assembly.flat.guess
    if not given:
        return ()
    observables = [assembly.start_observables[path] for path in given]
    program = assembly.shared.get(
        _GUESSES,
        lambda: coordinate_program(assembly, "guesses", equations, [one.value for one in observables]),
        tuple(given),
    )
    values = assembly.kernel(program)([start.time], start.coordinates, start.speeds)[0]
    found = []
    for one, asked, value in zip(observables, given.values(), values, strict=True):
        off = float(value) - asked
        if one.periodic:
            off = float(np.remainder(off + np.pi, 2.0 * np.pi) - np.pi)
        found.append(GuessMet(one.path, one.unit, asked, asked + off if one.periodic else float(value), off))
    found.sort(key=lambda one: -abs(one.off) / (start.length if one.unit == "m" else 1.0))
    return tuple(found)


class _Bodies:
    """Where the bodies of a scene are, and how they move with the speeds, in numbers."""

    def __init__(self, assembly: Assembly, equations: Equations) -> None:
        self.assembly, self.equations = assembly, equations
        every = [one for one in assembly.mechanism.bodies.bodies if not one.is_fixed]
        self.indices, self.names = [one.index for one in every], [one.name for one in every]
        placements = equations.kinematics.placements
        self.turns = [i in placements.angles or i in placements.axes for i in self.indices]
        self.places, self.jacobian_program, self.entries = assembly.shared.get(_BODIES, self._programs)

    def _programs(self) -> tuple[Program, Program, tuple[Any, Any, tuple[int, int]]]:
        kinematics, placements = self.equations.kinematics, self.equations.kinematics.placements
        places: list[Expression] = []
        rates: list[Expression] = []
        for i in self.indices:
            places += placements.references[i]
            rates += kinematics.reference_velocities[i]
            if i in placements.angles:
                places.append(placements.angles[i])
            elif i in placements.axes:
                places += [self.equations.graph.convert(c) for axis in placements.axes[i] for c in axis]
            if i in placements.angles or i in placements.axes:
                rates += kinematics.angular_velocities.get(i, ())
        speeds = list(self.equations.speeds)
        entries = jacobian(rates, speeds)
        return (
            coordinate_program(self.assembly, "places", self.equations, places),
            coordinate_program(self.assembly, "movements of bodies", self.equations, {"jacobian": entries.entries}),
            (entries.rows, entries.columns, (len(rates), len(speeds))),
        )

    def apart(self, t: float, q: FloatArray, other: FloatArray) -> tuple[list[float], list[float]]:
        """Return distance and angle of each body between two places: m and rad."""
        still = np.zeros(len(self.equations.speeds))
        a, b = (np.asarray(self.assembly.kernel(self.places)([t], x, still)[0]) for x in (q, other))
        distances, angles, at = [], [], 0
        placements = self.equations.kinematics.placements
        for i in self.indices:
            n = len(placements.references[i])
            distances.append(float(np.linalg.norm(b[at : at + n] - a[at : at + n])))
            at += n
            if i in placements.angles:
                angles.append(abs(float(np.remainder(b[at] - a[at] + np.pi, 2.0 * np.pi) - np.pi)))
                at += 1
            elif i in placements.axes:
                angles.append(_angle_between(a[at : at + 9].reshape(3, 3), b[at : at + 9].reshape(3, 3)))
                at += 9
            else:
                angles.append(0.0)
        return distances, angles

    def _movements(self, t: float, q: FloatArray, length: float) -> list[tuple[FloatArray, FloatArray]]:
        """Return how position (in shares of the extent) and orientation of each body move with the scaled speeds."""
        rows, columns, shape = self.entries
        matrix = np.zeros(shape)
        matrix[rows, columns] = self.assembly.kernel(self.jacobian_program)([t], q, np.zeros(shape[1]))[0]
        matrix *= motion_scales(self.equations, length)
        kinematics, found, at = self.equations.kinematics, [], 0
        for i, turns in zip(self.indices, self.turns, strict=True):
            n = len(kinematics.reference_velocities[i])
            m = len(kinematics.angular_velocities.get(i, ())) if turns else 0
            found.append((matrix[at : at + n] / length, matrix[at + n : at + n + m]))
            at += n + m
        return found

    def said(self, level: Level, t: float, start: Start) -> list[tuple[bool, bool]]:
        """Return whether what is said tells the position of each body, and its orientation."""
        system = System(self.assembly, self.equations, [*level.guessed, *level.fixed], False)
        scales = motion_scales(self.equations, start.length)
        derivatives = to_array(system.at(t, start.rough, np.zeros_like(scales))[1]) if system.targets else None
        if derivatives is None:
            free = np.eye(len(scales))
        else:
            derivatives = scaled(derivatives, scales)
            free = open_directions(
                derivatives[independent_rows(derivatives, system.errors.of_jacobian(t, start.rough, scales))]
            )

        def is_told(rows: FloatArray) -> bool:
            return float(np.linalg.norm(rows @ free.T)) <= tolerances.FREE * float(np.linalg.norm(rows))

        moves = self._movements(t, start.rough, start.length)
        return [(is_told(shift), is_told(turn)) for shift, turn in moves]

    def movers(self, level: Level, start: Start, wanted: Sequence[int]) -> dict[int, tuple[str, ...]]:
        """Return what moved bodies: the parts of the way that the multiplier of each condition stands for."""
        system = System(self.assembly, self.equations, level.fixed, True)
        scales = motion_scales(self.equations, start.length)
        t, q = start.time, start.coordinates
        derivatives = to_array(system.at(t, q, np.zeros_like(scales))[1])
        if not derivatives.shape[0]:
            return dict.fromkeys(wanted, ())
        derivatives = scaled(derivatives, scales, row_scales(derivatives, scales, system.errors.near(t, q, scales)))
        way = kinematic_map_of(self.assembly, "regular").difference(t, start.rough, q) / scales
        weights = least_norm(derivatives.T, way)
        names = [one.key[0] for one in self.equations.constraints if one.value is not None]
        names += [target.path for target in level.fixed]
        ways: dict[str, FloatArray] = {}
        for name, row, weight in zip(names, derivatives, weights, strict=True):
            ways[name] = ways.get(name, np.zeros_like(scales)) + weight * row
        moves = self._movements(t, q, start.length)
        found = {}
        for i in wanted:
            both = np.concatenate(moves[i])
            sizes = {name: float(np.linalg.norm(both @ one)) for name, one in ways.items()}
            most = max(sizes.values())
            ordered = sorted((name for name in sizes if sizes[name] > _SHARE * most), key=lambda name: -sizes[name])
            found[i] = tuple(ordered)
        return found


def _angle_between(a: FloatArray, b: FloatArray) -> float:
    """Return the angle of the rotation between two sets of axes, rad; exact for small ones too."""
    r = a @ b.T
    sine = 0.5 * float(np.linalg.norm([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]]))
    return float(np.arctan2(sine, 0.5 * (float(np.trace(r)) - 1.0)))
