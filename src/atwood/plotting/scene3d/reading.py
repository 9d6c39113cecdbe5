"""What there is to draw of a scene in space along a run: where bodies are, what joins them, what they weigh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from functools import cached_property
from typing import Literal

import numpy as np

from atwood.arrays import FloatArray
from atwood.late import dataclass
from atwood.model.values.outline import Outline

__all__ = ["Joining", "Lump", "Pose", "Reading", "Tie"]

JoiningKind = Literal["hinge", "ball", "cross", "slide", "plane", "curve"]
TieKind = Literal["rod", "rope", "spring", "damper"]


@dataclass(frozen=True, eq=False)
class Pose:
    """Where a body is along a run.

    Attributes
    ----------
    origin
        Place of its root node, m, shape (times, 3).
    axes
        Its axes in world axes as the columns of matrices, shape (times, 3, 3).
    """

    origin: FloatArray
    axes: FloatArray

    def place(self, point: FloatArray) -> FloatArray:
        """Return where a point of the body is along the run, m, shape (times, 3)."""
        found: FloatArray = self.origin + self.axes @ point
        return found


@dataclass(frozen=True, eq=False)
class Joining:
    """What a joint looks like.

    Attributes
    ----------
    part
        Its path.
    kind
        What it lets move.
    nodes
        Nodes a and b.
    axes
        Its axes: in body a of the first; of a ``cross`` the second in body b.
    turns
        Whether a ``slide`` turns about its axis too.
    reach
        Of a ``slide``, how far it goes along its axis in the run, m; of a ``plane``, between which heights
        over it node b is, m.
    curve
        Of a ``curve``, its points from node a in the axes of body a, m, shape (points, 3).
    """

    part: str
    kind: JoiningKind
    nodes: tuple[int, int]
    axes: tuple[FloatArray, ...] = ()
    turns: bool = False
    reach: tuple[float, float] = (0.0, 0.0)
    curve: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Lump:
    """Mass of one part: of a rigid body, or of a point.

    Attributes
    ----------
    part
        Its path.
    body, node
        Where it belongs.
    mass
        kg.
    center
        Its centre of mass in the axes of the body, m.
    axes
        Its frame in the axes of the body, as columns.
    tensor
        Inertia about the centre of mass in the axes of the body, kg m^2; zero for a point.
    outline
        What it looks like; None if the part does not say.
    origin
        Its node in the axes of the body, about which the outline is, m.
    """

    part: str
    body: int
    node: int
    mass: float
    center: FloatArray
    axes: FloatArray
    tensor: FloatArray
    outline: Outline | None = None
    origin: FloatArray = field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True)
class Tie:
    """What goes from one node to another.

    Attributes
    ----------
    part
        Its path.
    kind
        How it is drawn.
    nodes
        Its nodes in order.
    """

    part: str
    kind: TieKind
    nodes: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Reading:
    """What there is to draw of a scene in space along a run.

    Attributes
    ----------
    time
        Times, s.
    body_of
        Body of each node; 0 is the world.
    offsets, turns
        Place and axes of each node in the axes of its body, m.
    poses
        Where each body is.
    steps
        Pairs of nodes that a part holds rigidly apart.
    joinings, lumps, ties
        What the parts are.
    grounds
        Nodes that are fixed in the world by a part.
    is_heavy
        Whether there is gravity.
    """

    time: FloatArray
    body_of: Mapping[int, int]
    offsets: Mapping[int, FloatArray]
    turns: Mapping[int, FloatArray]
    poses: Mapping[int, Pose]
    steps: tuple[tuple[int, int], ...]
    joinings: tuple[Joining, ...] = ()
    lumps: tuple[Lump, ...] = ()
    ties: tuple[Tie, ...] = ()
    grounds: tuple[int, ...] = ()
    is_heavy: bool = False

    def place(self, node: int) -> FloatArray:
        """Return where a node is along the run, m, shape (times, 3)."""
        return self.poses[self.body_of[node]].place(self.offsets[node])

    @cached_property
    def used(self) -> tuple[int, ...]:
        """Nodes of what is drawn."""
        several = [*(one.nodes for one in self.joinings), *(one.nodes for one in self.ties), *self.steps, self.grounds]
        found = {node for nodes in several for node in nodes} | {one.node for one in self.lumps}
        return tuple(sorted(found))
