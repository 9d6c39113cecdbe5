"""The forest: how positions and orientations are computed, one body after another.

In the reduced form, bodies hang on joints wherever these save coordinates; the joints that are left over close the
loops. In the dae form every body is on its own, and every joint is a constraint. Nobody chooses where a loop is cut:
bodies are attached greedily, the cheapest way first, and a body waits while a cheaper way to attach it may turn up.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Literal

from atwood.expr import Expression
from atwood.late import dataclass
from atwood.topology.graph import Joint
from atwood.topology.orientation_coordinates import OrientationCoordinates

__all__ = ["Attachment", "Coordinate", "OrientationStep", "SpanningForest"]


@dataclass(frozen=True)
class Coordinate:
    """A coordinate of the mechanism.

    Attributes
    ----------
    name
        Its path, such as ``rod1.angle``.
    unit
        ``"m"`` or ``"rad"``.
    """

    name: str
    unit: str


@dataclass(frozen=True)
class Attachment:
    """How a body gets its position.

    Attributes
    ----------
    body
        The body.
    joint
        The joint it hangs on; None if it is free, with coordinates of its own.
    node
        The node of the body that the joint, or the coordinates, place.
    parent
        The node on the other side of the joint.
    backwards
        Whether the joint is walked from b to a.
    coordinates
        Numbers of the coordinates that are used, in the forest's list: those of the joint, or of the position.
    speeds
        Numbers of their speeds.
    orientation
        In space: numbers of the coordinates of its orientation, if the body has one of its own.
    spin
        Numbers of the speeds that belong to the orientation.
    turns_with_joint
        In space: whether the joint also gives the orientation.
    """

    body: int
    joint: Joint | None
    node: int
    parent: int
    backwards: bool
    coordinates: tuple[int, ...]
    speeds: tuple[int, ...] = ()
    orientation: tuple[int, ...] = ()
    spin: tuple[int, ...] = ()
    turns_with_joint: bool = False


@dataclass(frozen=True)
class OrientationStep:
    """How a body gets its orientation: from a coordinate, or from another body through a joint that locks.

    Attributes
    ----------
    body
        The body.
    coordinate
        Number of the coordinate; None if it is locked to another body.
    joint
        The joint that locks it.
    parent
        The other body.
    """

    body: int
    coordinate: int | None
    joint: Joint | None = None
    parent: int = 0


@dataclass(frozen=True)
class SpanningForest:
    """How the configuration is computed.

    Attributes
    ----------
    form
        ``"reduced"`` or ``"dae"``.
    coordinates
        The coordinates, in the order in which they are met.
    speeds
        The speeds; as many as coordinates, except of orientations in space.
    orientation_coordinates
        The coordinates that stand for an orientation together.
    attachments
        The bodies, in an order in which they can be placed.
    orientations
        The bodies that have an orientation, in an order in which it can be computed.
    solved
        Constraints, as (part, law, number), that hold whatever the coordinates are.
    loops
        How many independent loops the joints make.
    loop_joints
        Joints that no body hangs on.
    counted
        Numbers of coordinates, and of their speeds, that only count the turns of a joint, by its coordinate's symbol.
    """

    form: Literal["reduced", "dae"]
    coordinates: tuple[Coordinate, ...]
    speeds: tuple[Coordinate, ...]
    orientation_coordinates: tuple[OrientationCoordinates, ...]
    attachments: tuple[Attachment, ...]
    orientations: tuple[OrientationStep, ...]
    solved: frozenset[tuple[str, str, int]]
    loops: int
    loop_joints: tuple[Joint, ...]
    counted: Mapping[Expression, tuple[int, int]] = field(default_factory=dict)
