"""Spherical: a ball in a socket."""

from __future__ import annotations

from atwood import FREE, Frame, Placement, Vector, connector, constraint, joint
from atwood_library.interfaces.loaded_ball import LoadedBall


class Spherical(LoadedBall):
    """A ball and socket: the two frames share their position and turn against each other in every way.

    In a plane it is a hinge. Its `force` is what it exerts on frame b. It can carry a spring, a damper,
    motors and a cone as a stop.
    """

    synonyms = (
        *("Ball joint", "Ball and socket", "Spherical joint"),
        *("MultiBody.Joints.Constraints.Spherical", "UniversalSpherical", "JointUPS", "JointUSR"),
        *("JointUSP", "JointSSR", "JointSSP"),
    )

    a: Frame = connector(Frame, "The frame that carries the joint.")
    b: Frame = connector(Frame, "The frame that moves.")

    @constraint(reaction="force", unit="N", doc="Force exerted on frame b, in world axes.")
    def coincidence(self) -> Vector:
        """Return the distance of the two frames."""
        return self.b.position - self.a.position

    @joint("a", "b", solves=("coincidence",), spaces=("plane", "space"))
    def meet(self) -> Placement:
        """Place b at a; how it is turned is its own affair."""
        return Placement(Vector(0.0, 0.0, 0.0), FREE if self.in_space else None)
