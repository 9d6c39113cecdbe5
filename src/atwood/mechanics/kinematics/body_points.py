"""Points of a body that no node marks: where they are, and how they move with it."""

from __future__ import annotations

from atwood.expr import Scalar
from atwood.late import dataclass
from atwood.mechanics.kinematics.orientation import NodeTurn, node_axes, rotate
from atwood.mechanics.kinematics.positions import Components, Kinematics
from atwood.model.values.rotation import from_axes
from atwood.model.values.space import Space
from atwood.model.values.vector import Vector, cross

__all__ = ["BodyPoint", "body_point_of"]


@dataclass(frozen=True)
class BodyPoint:
    """An arm that a body carries, along the free components in world axes.

    Attributes
    ----------
    position
        The arm, m.
    velocity, acceleration
        Of its end against its beginning.
    """

    position: tuple[Scalar, ...]
    velocity: tuple[Scalar, ...]
    acceleration: tuple[Scalar, ...]


def body_point_of(kinematics: Kinematics, body: int, turn: NodeTurn, vector: Vector, space: Space) -> BodyPoint:
    """Return an arm that is given in the axes of a node.

    Parameters
    ----------
    kinematics
        How bodies move; a body without an orientation has the world's axes.
    body
        The body of the node.
    turn
        How the node is turned from its body.
    vector
        The arm, m.
    space
        What the scene lives in.
    """
    placements = kinematics.placements
    spin = kinematics.angular_velocities.get(body, ())
    spin_rate = kinematics.angular_accelerations.get(body, ())
    if space.is_spatial:
        return _arm_in_space(kinematics, body, turn, vector, spin, spin_rate)
    axes = node_axes(placements.angles.get(body), None, turn)
    arm = space.components(vector if axes is None else from_axes(axes, vector))
    still = (0.0,) * len(arm)
    if space.is_line or not spin:
        return BodyPoint(arm, still, still)
    w, alpha = spin[0], spin_rate[0]
    velocity = (-w * arm[1], w * arm[0])
    acceleration = (-alpha * arm[1] - w * w * arm[0], alpha * arm[0] - w * w * arm[1])
    return BodyPoint(arm, velocity, acceleration)


def _arm_in_space(
    kinematics: Kinematics, body: int, turn: NodeTurn, vector: Vector, spin: Components, spin_rate: Components
) -> BodyPoint:
    axes = kinematics.placements.axes.get(body)
    if axes is None:
        return BodyPoint(tuple(vector), (0.0,) * 3, (0.0,) * 3)
    arm = rotate(vector, turn)
    w, alpha = Vector(*spin), Vector(*spin_rate)
    velocity = cross(w, arm)
    acceleration = cross(alpha, arm) + cross(w, velocity)
    return BodyPoint(*(tuple(from_axes(axes, one)) for one in (arm, velocity, acceleration)))
