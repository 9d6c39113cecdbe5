"""A component in a random state, the same for the same seed."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Sequence

from atwood.consistency.trials import Body, Pose, Trial, axes_turned, is_offered
from atwood.model.declare.connectors import Frame, JointCoordinate
from atwood.model.local.flatten import Part
from atwood.model.values.space import FIXED_AXES, Space, planar_axes
from atwood.model.values.vector import ZERO, Vector, dot, norm

__all__ = ["make_trial"]


_WIDE_LENGTH, _WIDE_ANGLE = 10.0, 3.0
"""By how much coordinates are larger in every second trial: up to ten lengths, and to nearly half a turn.

A root in the place of a cosine is right within a quarter turn, and an absolute value on one side.
"""


def make_trial(part: Part, space: Space, seed: int) -> Trial:
    """Return a component in a random state, the same for the same seed; with odd seeds its joints are far from zero.

    Parameters
    ----------
    part
        The component with its values.
    space
        What it lives in.
    seed
        Of the random numbers.
    """
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
    line_signs = {(a, b): 1.0 if i < j else -1.0 for i, a in enumerate(free) for j, b in enumerate(free)}
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
