"""A component in a random state: numbers for everything that its laws may read, the same for the same seed.

Connectors move as rigid frames with constant velocities; a joint places one of its two connectors from the other.
Parameters have the values that they were given, so that bounds and what `check_values` asks for hold.
"""

from __future__ import annotations

import inspect
import math
import random
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from atwood.errors import DeclarationError
from atwood.lazy_dataclasses import dataclass, replace
from atwood.model.declare.component import Binding, Component, bind
from atwood.model.declare.connectors import Frame, JointCoordinate, Motion
from atwood.model.declare.law_results import Placement, call_law
from atwood.model.declare.laws import Law
from atwood.model.local.flatten import Part
from atwood.model.values.rotation import FREE, IDENTITY, Axes, Rotation, as_rotation, transposed
from atwood.model.values.space import FIXED_AXES, ZERO, Space, Vector, dot, norm, planar_axes

STEP = 1e-3
"""Step of the differences in time, s: velocities are some lengths of the component, or radians, a second."""


@dataclass(frozen=True)
class Pose:
    """Where a connector is and how it is turned: in a plane by an angle, rad; in space its axes in world axes."""

    position: Vector
    angle: float
    axes: Axes


@dataclass(frozen=True)
class Body:
    """The inertia of the body that a connector is on; see `model.carried.Carried`."""

    mass: float
    center_of_mass: Vector
    inertia: Axes
    is_light: bool = False


WORLD_POSE = Pose(ZERO, 0.0, IDENTITY)


@dataclass(frozen=True)
class Trial:
    """A component in a random state.

    Attributes
    ----------
    part
        The component with its values.
    space
        What it lives in.
    length
        Its size, m: of the parameters that are lengths, or one metre.
    values
        Parameters by name.
    inputs, joint_references
        Value and rate of each input, and of each joint coordinate that it takes hold of.
    poses
        Where its connectors are at time zero.
    velocities, angular_velocities
        Their velocities and angular velocities, in world axes.
    coordinates
        Value and rate of each joint coordinate, by name.
    frames
        Connectors that have an orientation here.
    bodies
        Inertia of the bodies that connectors are on.
    line_signs
        On a line, the signs of lengths, by the names of connectors.
    """

    part: Part
    space: Space
    length: float
    values: Mapping[str, Any]
    inputs: Mapping[str, tuple[float, float]]
    joint_references: Mapping[str, tuple[float, float]]
    poses: Mapping[str, Pose]
    velocities: Mapping[str, Vector]
    angular_velocities: Mapping[str, Vector]
    coordinates: Mapping[str, tuple[float, float]]
    frames: frozenset[str]
    bodies: Mapping[str, Body]
    line_signs: Mapping[tuple[str, str], float]

    @property
    def component(self) -> Component:
        """The component."""
        return self.part.component

    def is_frame(self, name: str) -> bool:
        """Return whether a connector has an orientation here."""
        return name in self.frames

    def freedoms(self, name: str) -> int:
        """Return in how many ways a connector can move."""
        return len(self.space.basis) + (len(self.space.turn_axes) if self.is_frame(name) else 0)

    def at(self, t: float) -> dict[str, Pose]:
        """Return where connectors are at a time, each moving by itself."""
        found = {}
        for name, pose in self.poses.items():
            spin = self.angular_velocities[name]
            angle, axes = pose.angle - spin.y * t, pose.axes
            if self.space.is_spatial:
                speed = norm(spin)
                axes = _compose(axes_turned(spin / speed, speed * t), axes) if speed else axes
            elif self.space.is_planar:
                axes = planar_axes(angle)
            found[name] = Pose(pose.position + self.velocities[name] * t, angle, axes)
        return found

    def bound(self, t: float, poses: Mapping[str, Pose], motions: Mapping[str, Motion] | None = None) -> Any:
        """Return the component with numbers in place of its fields."""
        if motions is None:
            motions = {name: self.motion(name, pose) for name, pose in poses.items()}
        held = {
            name: Motion(value=value + rate * t, rate=rate) for name, (value, rate) in self.joint_references.items()
        }
        binding = Binding(
            values={**self.values, **{name: value + rate * t for name, (value, rate) in self.inputs.items()}},
            motions={**motions, **held},
            time=t,
            space=self.space.name,
            line=self.space.line,
            line_signs=self.line_signs,
        )
        return bind(self.component, binding)

    def motion(self, name: str, pose: Pose, velocity: Vector | None = None, spin: Vector | None = None) -> Motion:
        """Return what a connector knows."""
        if not self.is_frame(name):
            still, body = ZERO if velocity is not None else None, self.bodies[name]
            return Motion(pose.position, velocity, axes=FIXED_AXES, angle=0.0, angular_velocity=still, body=body)
        return Motion(
            pose.position,
            velocity,
            axes=pose.axes,
            angle=pose.angle if self.space.is_planar else None,
            angular_velocity=spin,
            body=self.bodies[name],
        )

    def placement(self, law: Law, t: float, poses: Mapping[str, Pose], values: Mapping[str, float]) -> Placement | None:
        """Return where a joint puts b, seen from a; None if its method gives something else."""
        arguments = [values[name] for name in law.options.coordinates]
        made = getattr(self.bound(t, poses), law.name)(*arguments)
        return made if isinstance(made, Placement) else None

    def coordinates_at(self, t: float) -> dict[str, float]:
        """Return the joint coordinates at a time."""
        return {name: value + rate * t for name, (value, rate) in self.coordinates.items()}

    def joined(
        self, law: Law, t: float, values: Mapping[str, float] | None = None, poses: Mapping[str, Pose] | None = None
    ) -> dict[str, Pose]:
        """Return where connectors are with one of them placed by a joint: b from a, or a from b where b is the world.

        Joints that share a coordinate with it place theirs too.
        """
        found = dict(poses or self.at(t))
        for one in self.component.laws("joint"):
            shares = not set(one.options.coordinates).isdisjoint(law.options.coordinates)
            if one.name == law.name or (shares and one.holds_in(self.space.name)):
                found = self._placed(one, t, values or self.coordinates_at(t), found)
        return found

    def _placed(self, law: Law, t: float, values: Mapping[str, float], poses: Mapping[str, Pose]) -> dict[str, Pose]:
        """Return where connectors are with one of them placed by a joint."""
        found = dict(poses)
        a, b = law.options.a, law.options.b
        placement = call_law(self.part.path, law, lambda: self.placement(law, t, found, values))
        if not isinstance(placement, Placement):
            advice = "Return atwood.Placement(displacement=...)."
            raise DeclarationError("a joint returns a Placement", where=f"{self.part.path}.{law.name}", advice=advice)
        backwards = b == "world"
        fixed, moved = (b, a) if backwards else (a, b)
        base = WORLD_POSE if fixed == "world" else found[fixed]
        loose = found[moved]
        angle, axes = loose.angle, loose.axes
        if placement.rotation is not None and placement.rotation is not FREE and self.space.has_rotation:
            if self.space.is_planar:
                turn: Any = placement.rotation
                angle = base.angle - turn if backwards else base.angle + turn
                axes = planar_axes(angle)
            else:
                rotation = _rotation(as_rotation(placement.rotation))
                axes = _compose(base.axes, transposed(rotation) if backwards else rotation)
        shift = placement.displacement
        of_a = Pose(base.position, angle, axes) if backwards else base
        if placement.axes == "a" and self.space.has_rotation:
            shift = _from_axes(of_a.axes, shift)
        along = self.space.vector(self.space.components(shift))
        place = base.position - along if backwards else base.position + along
        found[moved] = Pose(place, angle, axes)
        return found

    def moving(self, poses_at: Callable[[float], Mapping[str, Pose]]) -> dict[str, Motion]:
        """Return what connectors know at time zero, with velocities by differences of where they are."""
        around = {k: poses_at(k * STEP) for k in (-2, -1, 0, 1, 2)}
        found = {}
        for name, pose in around[0].items():
            velocity = rate_of([around[k][name].position for k in (-2, -1, 1, 2)])
            if self.space.is_spatial:
                rates = [rate_of([around[k][name].axes[i] for k in (-2, -1, 1, 2)]) for i in range(3)]
                spin = _spin(pose.axes, rates)
            else:
                spin = Vector(0.0, -rate_of([around[k][name].angle for k in (-2, -1, 1, 2)]), 0.0)
            found[name] = self.motion(name, pose, velocity, spin)
        return found


def _from_axes(axes: Axes, vector: Vector) -> Vector:
    """Return a vector that is given along some axes; as `model.rotation.from_axes`, on numbers alone."""
    found: Vector = axes[0] * vector.x + axes[1] * vector.y + axes[2] * vector.z
    return found


def axes_turned(axis: Vector, angle: float) -> Axes:
    """Return the axes of a turned frame: Rodrigues' formula, as `Turn.axes`, on numbers alone."""
    c, s = math.cos(angle), math.sin(angle)
    x, y, z = axis
    k = 1.0 - c
    return (
        Vector(c + k * x * x, k * x * y + s * z, k * x * z - s * y),
        Vector(k * x * y - s * z, c + k * y * y, k * y * z + s * x),
        Vector(k * x * z + s * y, k * y * z - s * x, c + k * z * z),
    )


def _rotation(rotation: Rotation) -> Axes:
    found = IDENTITY
    for one in rotation.turns:
        found = _compose(found, axes_turned(one.axis, one.angle))
    return found


def _compose(outer: Axes, inner: Axes) -> Axes:
    return _from_axes(outer, inner[0]), _from_axes(outer, inner[1]), _from_axes(outer, inner[2])


def rate_of(around: list[Any]) -> Any:
    """Return a derivative in time from values at -2, -1, 1 and 2 steps, to fourth order."""
    before2, before, after, after2 = around
    return ((after - before) * 8.0 - (after2 - before2)) * (1.0 / (12.0 * STEP))


def _spin(axes: Axes, rates: list[Vector]) -> Vector:
    """Return the angular velocity from axes and their rates: half the sum of ``e_i x e_i'``."""
    total = ZERO
    for axis, rate in zip(axes, rates, strict=True):
        total = total + Vector(
            axis.y * rate.z - axis.z * rate.y, axis.z * rate.x - axis.x * rate.z, axis.x * rate.y - axis.y * rate.x
        )
    return total * 0.5


def rotation_between(before: Pose, after: Pose, space: Space) -> list[float]:
    """Return the small rotation from one pose to another: about the plane's normal, or in world axes."""
    if space.is_planar:
        return [after.angle - before.angle]
    pairs = zip(before.axes, after.axes, strict=True)
    return list(_spin(before.axes, [new - old for old, new in pairs]))


def is_offered(component: Component, name: str) -> bool:
    """Return whether a connector is one of an array that the component offers itself."""
    specs = component.connector_specs().values()
    return any(spec.of and name in spec.names(component) for spec in specs)


def nudged(pose: Pose, column: int, by: float, space: Space) -> Pose:
    """Return a pose moved a little along one of its ways to move: first the directions of the space, then the turns."""
    directions = len(space.basis)
    if column < directions:
        return replace(pose, position=pose.position + space.basis[column] * by)
    if space.is_planar:
        return Pose(pose.position, pose.angle + by, planar_axes(pose.angle + by))
    axes = _compose(axes_turned(IDENTITY[column - directions], by), pose.axes)
    return Pose(pose.position, pose.angle, axes)


def in_components(vector: Vector, space: Space) -> list[float]:
    """Return the free components of a vector as numbers."""
    return [float(dot(vector, direction)) for direction in space.basis]


_WIDE_LENGTH, _WIDE_ANGLE = 10.0, 3.0
"""By how much coordinates are larger in every second trial: up to ten lengths, and to nearly half a turn.

A root in the place of a cosine is right within a quarter turn, and an absolute value on one side.
"""


def make_trial(part: Part, space: Space, seed: int) -> Trial:
    """Return a component in a random state, the same for the same seed; with odd seeds its joints are far from zero."""
    draw = random.Random(seed)

    def number() -> float:
        return draw.choice((-1.0, 1.0)) * draw.uniform(0.2, 1.0)

    component, values = part.component, {}
    sizes = []
    for name, spec in component.parameter_specs().items():
        value = part.values[name]
        if isinstance(value, tuple) and not spec.array:
            value = Vector(*value) if len(value) == 3 else value
        values[name] = value
        if isinstance(value, float) and value and spec.unit.exponents == (0, 1, 0, 0):
            sizes.append(abs(value))
    length = math.exp(sum(map(math.log, sizes)) / len(sizes)) if sizes else 1.0
    connectors = component.connectors()
    free = [name for name, one in connectors.items() if not isinstance(one, JointCoordinate)]
    poses, velocities, angular_velocities = _some_motion(number, space, free, length)
    coordinates: dict[str, tuple[float, float]] = {}
    units = {law.name: law.options.unit for law in component.laws("observable")}
    for law in component.laws("joint"):
        for name in law.options.coordinates:
            is_length = units.get(name) == "m"
            size = length if is_length else 1.0
            reach = 1.0 if seed % 2 == 0 else _WIDE_LENGTH if is_length else _WIDE_ANGLE
            coordinates.setdefault(name, (reach * number() * size, number() * size))
    inputs = {}
    for name, signal in component.signal_specs().items():
        size = length if signal.unit.exponents == (0, 1, 0, 0) else 1.0
        inputs[name] = (abs(number()) * size, number() * size)
    joint_references = {
        name: (number(), number()) for name in connectors if name not in free and not is_offered(component, name)
    }
    frames = frozenset(name for name, one in connectors.items() if isinstance(one, Frame) and space.has_rotation)
    ends = list(enumerate(free)) if space.is_line else []
    line_signs = {(a, b): 1.0 if i < j else -1.0 for i, a in ends for j, b in ends}
    bodies = {name: _some_body(draw, length) for name in free}
    for name, state in component.state_specs().items():
        numbers = tuple(number() for _ in state.names(part.values))
        values[name] = numbers if state.count else numbers[0]
    return Trial(
        part,
        space,
        length,
        values,
        inputs,
        joint_references,
        poses,
        velocities,
        angular_velocities,
        coordinates,
        frames,
        bodies,
        line_signs,
    )


def _some_motion(
    number: Callable[[], float], space: Space, names: Sequence[str], length: float
) -> tuple[dict[str, Pose], dict[str, Vector], dict[str, Vector]]:
    """Return the poses, velocities and angular velocities of connectors that lie apart from each other."""
    poses, velocities, angular_velocities = {}, {}, {}
    for order, name in enumerate(names):
        place = [(3.0 * order + number()) * length] + [number() * length for _ in space.basis[1:]]
        axes, angle, spin = FIXED_AXES, 0.0, ZERO
        if space.is_planar:
            angle, spin = number(), Vector(0.0, number(), 0.0)
            axes = planar_axes(angle)
        elif space.is_spatial:
            raw = Vector(number(), number(), number())
            axes = axes_turned(raw / norm(raw), 2.0 * number())
            spin = Vector(number(), number(), number())
        poses[name] = Pose(space.vector(tuple(place)), angle, axes)
        velocities[name] = space.vector(tuple(number() * length for _ in space.basis))
        angular_velocities[name] = spin
    return poses, velocities, angular_velocities


def _some_body(draw: random.Random, length: float) -> Body:
    """Return the inertia of two points and a sphere, which some body can have."""
    place = Vector(*(draw.uniform(-0.3, 0.3) * length for _ in range(3)))
    rows = [
        Vector(*((dot(place, place) + length**2 if i == j else 0.0) - place[i] * place[j] for j in range(3)))
        for i in range(3)
    ]
    return Body(draw.uniform(1.0, 3.0), place, (rows[0], rows[1], rows[2]))


def line_of(cls: type[Component], law: str) -> str:
    """Return file and line of a law, such as ``parts.py, line 12``; empty where there is no file."""
    function: Any = inspect.getattr_static(cls, law, None)
    function = inspect.unwrap(getattr(function, "_read", function)) if function is not None else None
    code = getattr(function, "__code__", None)
    if code is None:
        return ""
    return f"{Path(code.co_filename).name}, line {code.co_firstlineno}"


def contradiction_at(cls: type[Component], *laws: str) -> str:
    """Return, for the end of a message, where laws are written; empty where nothing is known."""
    places = [place for place in dict.fromkeys(line_of(cls, law) for law in laws) if place]
    return f" ({'; '.join(places)})" if places else ""
