"""A scene in the terms of Lagrange's equations: energies, Rayleigh function and forces of each part, and their sums."""

from __future__ import annotations

from collections.abc import Sequence

from atwood.expr import Expression, Graph, SparseMatrix, jacobian, substitute, vjp
from atwood.late import dataclass
from atwood.mechanics.dynamics.equations import Constraint, Equations
from atwood.mechanics.outputs.observables import add_up
from atwood.topology.spanning_forest import Coordinate

__all__ = ["Contribution", "Lagrangian"]


@dataclass(frozen=True)
class Contribution:
    """What one part contributes to Lagrange's equations.

    Attributes
    ----------
    path
        The part.
    kinetic, potential
        Its kinetic and potential energy, J; weight included.
    lagrangian
        What it adds to L, J: T - V, and terms linear in the velocities, as of a charge in a magnetic field.
    rayleigh
        Its Rayleigh function, W, whose derivatives by the velocities are the forces against them.
    forces
        Its generalized force along each velocity: of loads, of potentials that follow the output of another part, and
        of matter that it loses with the velocity that it has.
    """

    path: str
    kinetic: Expression
    potential: Expression
    lagrangian: Expression
    rayleigh: Expression
    forces: tuple[Expression, ...]

    @property
    def is_nothing(self) -> bool:
        """Whether it contributes nothing at all."""
        return all(one.is_zero for one in (self.kinetic, self.potential, self.lagrangian, self.rayleigh, *self.forces))


@dataclass(frozen=True)
class Lagrangian:
    """A scene in the terms of Lagrange's equations, as expressions of one graph.

    Attributes
    ----------
    equations
        What it was made of; its speeds are the velocities here, except where `velocities` says otherwise.
    time
        The symbol of time.
    coordinates, names
        Symbols of the coordinates, their paths and units.
    velocities, velocity_names
        Symbols of the velocities.
    accelerations
        Symbols of their derivatives.
    rates
        The derivatives of the coordinates in terms of the velocities.
    moves
        For each velocity, the number of the coordinate of which it is the derivative; None for a component of an
        angular velocity.
    speeds
        The speeds of the equations in terms of coordinates and velocities.
    parts
        What each part contributes.
    inertial
        For each velocity, ``d/dt dT/dq' - dT/dq`` with all terms of L of first degree in the velocities.
    rows
        For each velocity, inertial less all other forces but those of constraints: `M a + ... - Q`.
    constraint_rows
        For each velocity, the generalized force ``G^T lambda`` of the constraints.
    constraints
        The constraints that the coordinates do not solve, in terms of coordinates and velocities.
    """

    equations: Equations
    time: Expression
    coordinates: tuple[Expression, ...]
    names: tuple[Coordinate, ...]
    velocities: tuple[Expression, ...]
    velocity_names: tuple[Coordinate, ...]
    accelerations: tuple[Expression, ...]
    rates: tuple[Expression, ...]
    moves: tuple[int | None, ...]
    speeds: tuple[Expression, ...]
    parts: tuple[Contribution, ...]
    inertial: tuple[Expression, ...]
    rows: tuple[Expression, ...]
    constraint_rows: tuple[Expression, ...]
    constraints: tuple[Constraint, ...]

    @property
    def graph(self) -> Graph:
        """Where the expressions live."""
        return self.equations.graph

    @property
    def kinetic(self) -> Expression:
        """The kinetic energy T, J."""
        return self._total([one.kinetic for one in self.parts])

    @property
    def potential(self) -> Expression:
        """The potential energy V, J."""
        return self._total([one.potential for one in self.parts])

    @property
    def lagrangian(self) -> Expression:
        """The Lagrangian, J."""
        return self._total([one.lagrangian for one in self.parts])

    @property
    def rayleigh(self) -> Expression:
        """The Rayleigh function, W."""
        return self._total([one.rayleigh for one in self.parts])

    @property
    def forces(self) -> tuple[Expression, ...]:
        """The generalized forces Q that neither potentials nor the Rayleigh function give."""
        return tuple(self._total([one.forces[k] for one in self.parts]) for k in range(len(self.velocities)))

    @property
    def momenta(self) -> tuple[Expression, ...]:
        """The momenta ``dL/dq'``; for an angular velocity in body axes the angular momentum in these."""
        return tuple(vjp([self.lagrangian], [self.graph.one], list(self.velocities)))

    @property
    def mass_matrix(self) -> SparseMatrix:
        """The mass matrix M, symmetric."""
        return jacobian(list(self.inertial), list(self.accelerations))

    @property
    def velocity_terms(self) -> tuple[Expression, ...]:
        """The inertial terms without accelerations: of velocities, and of motions that are given."""
        return tuple(substitute(list(self.inertial), dict.fromkeys(self.accelerations, 0.0)))

    @property
    def constraint_jacobian(self) -> SparseMatrix:
        """The matrix G of the constraints' rates by the velocities."""
        return jacobian([one.rate for one in self.constraints], list(self.velocities))

    @property
    def has_angular_velocities(self) -> bool:
        """Whether some velocities are no derivatives of coordinates."""
        return None in self.moves

    @property
    def is_restricted(self) -> bool:
        """Whether constraints on velocities are solved: L is then that of the velocities that are left, and says less.

        The rows are right all the same; ``d/dt dL/dq' - dL/dq`` of what is left is not (Goldstein, section 2.4).
        """
        return bool(self.equations.solved_speeds)

    def _total(self, values: Sequence[Expression]) -> Expression:
        return add_up([self.graph.zero, *values])
