"""What moves with which velocities, part by part: kinetic energy as ``1/2 w . M w`` with masses that are constant."""

from __future__ import annotations

from collections.abc import Sequence

from atwood.expr import Expression, Scalar
from atwood.late import dataclass
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.dynamics.inertia import tensor_of, turned_tensor
from atwood.mechanics.kinematics.body_points import body_point_of
from atwood.mechanics.kinematics.mechanism import Mechanism

__all__ = ["MovingMass", "moving_masses"]


@dataclass(frozen=True, eq=False)
class MovingMass:
    """Velocities that share a matrix of masses.

    Attributes
    ----------
    part
        Whose they are.
    axis
        Number of the world axis that they are along; -1 for the angular velocity in the axes of a body.
    velocities
        Components, m/s or rad/s.
    masses
        The matrix M, row by row, kg or kg m^2.
    """

    part: str
    axis: int
    velocities: Sequence[Expression]
    masses: Sequence[Sequence[Expression]]


def moving_masses(mechanism: Mechanism, equations: Equations) -> list[MovingMass]:
    """Return all that has kinetic energy, as material points and rigid bodies."""
    graph, kinematics, site = mechanism.table.graph, equations.kinematics, equations.site
    axes = range(len(mechanism.space.components(mechanism.gravity)))
    found: list[MovingMass] = []

    def add(part: str, axis: int, velocities: Sequence[Scalar], masses: Sequence[Sequence[Scalar]]) -> None:
        rows = [[graph.convert(m) for m in row] for row in masses]
        found.append(MovingMass(part, axis, [graph.convert(v) for v in velocities], rows))

    for path, local in mechanism.locals_.items():
        for one in local.point_inertias:
            nodes = [site.node(path, point.name) for point in one.points]
            for k in axes:
                add(path, k, [kinematics.velocities[node][k] for node in nodes], one.masses)
        for body in local.body_inertias:
            node = site.node(path, body.frame.name)
            index, turn = site.bodies.body_of[node], site.node_turns[node]
            arm = body_point_of(kinematics, index, turn, body.center_of_mass, mechanism.space)
            for k in axes:
                add(path, k, [kinematics.velocities[node][k] + arm.velocity[k]], [[body.mass]])
            spin = kinematics.angular_velocities.get(index, ())
            if len(spin) == 3:
                add(path, -1, spin, [tuple(column) for column in turned_tensor(tensor_of(path, body), turn)])
            elif spin:
                add(path, -1, spin, [[body.moment]])
    return found
