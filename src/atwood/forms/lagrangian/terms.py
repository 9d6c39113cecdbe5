"""A scene in the terms of Lagrange's equations: energies, Rayleigh function and forces of each part, and their sums."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from atwood.expr import Expression, Graph, Scalar, SparseMatrix, depends_on, jacobian, jvp, substitute, vjp
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.dynamics.equations import Constraint, Equations, balance_rows, inertia_forces
from atwood.mechanics.dynamics.forces import Forces, in_joint_coordinates, local_map, part_forces
from atwood.mechanics.outputs.observables import add_up, part_energies
from atwood.model.local.parts import LocalPart
from atwood.topology.spanning_forest import Coordinate


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


def contribution(
    assembly: Assembly, equations: Equations, path: str, signals: Mapping[Expression, Expression]
) -> Contribution:
    """Return what the part at `path` contributes, with what it reads from outputs of other parts in `signals`."""
    mechanism, graph = assembly.mechanism, equations.graph
    local, site, kinematics = mechanism.locals_[path], equations.site, equations.kinematics
    mapping = {**local_map(site, local, kinematics), **signals}
    linked = [*local.signal_symbols.values(), *local.stand_ins]
    # What follows the output of another part is no potential of the scene, and a Lagrangian is not T - V.
    plain = replace(local, potentials=_free_of(local.potentials, linked), lagrangians=())
    locals_ = {**mechanism.locals_, path: plain}
    kinetic, potential = part_energies(replace(mechanism, locals_=locals_), equations, path, signals)
    total = kinetic - potential
    given = in_joint_coordinates(local, kinematics, local.lagrangians)[0]
    if given:
        total = total + add_up(substitute(given, mapping))
        locals_ = {**mechanism.locals_, path: replace(plain, lagrangians=local.lagrangians)}
        kinetic, potential = part_energies(replace(mechanism, locals_=locals_), equations, path, signals)
    damping = in_joint_coordinates(local, kinematics, _free_of(local.dissipations, linked))[0]
    rayleigh = add_up([graph.zero, *substitute(damping, mapping)]) if damping else graph.zero
    rest = replace(
        local,
        potentials=tuple(one for one in local.potentials if one not in plain.potentials),
        dissipations=tuple(one for one in local.dissipations if one not in _free_of(local.dissipations, linked)),
        lagrangians=(),
    )
    found = Forces(graph)
    part_forces(site, rest, kinematics, mapping, found)
    forces = [-row for row in balance_rows(kinematics, {}, found, equations.speeds)]
    if local.varying:
        thrust = _thrust(assembly, equations, path, signals)
        forces = [force + more for force, more in zip(forces, thrust, strict=True)]
    return Contribution(path, kinetic, potential, graph.convert(total), rayleigh, tuple(forces))


def _free_of(values: Sequence[Expression], symbols: Sequence[Expression]) -> tuple[Expression, ...]:
    return tuple(value for value in values if not symbols or not depends_on(value, symbols))


def _thrust(
    assembly: Assembly, equations: Equations, path: str, signals: Mapping[Expression, Expression]
) -> list[Expression]:
    """Return the generalized force of matter that leaves a part with the velocity that it has: ``m' v . dv/dq'``.

    The momentum of what stays changes by it without a force: ``d/dt (m v) = m a + m' v``.
    """
    local, time = assembly.mechanism.locals_[path], equations.time

    def rate(value: Scalar) -> Expression:
        return jvp([equations.graph.convert(value)], {time: 1.0})[0]

    leaving = replace(
        local,
        point_inertias=tuple(
            replace(one, masses=[[rate(m) for m in row] for row in one.masses])
            for one in local.point_inertias
            if one in local.varying
        ),
        body_inertias=tuple(
            replace(
                one,
                mass=rate(one.mass),
                moment=rate(one.moment),
                tensor=None if one.tensor is None else tuple(tuple(rate(e) for e in row) for row in one.tensor),
            )
            for one in local.body_inertias
            if one in local.varying
        ),
        lagrangians=(),
    )
    changed = replace(assembly.mechanism, locals_={**assembly.mechanism.locals_, path: leaving})
    kinetic, _ = part_energies(changed, equations, path, signals)
    return vjp([kinetic], [equations.graph.one], list(equations.speeds))


def inertial_terms(equations: Equations, signals: Mapping[Expression, Expression]) -> list[Expression]:
    """Return the inertial terms along each speed, of Lagrangians those that depend on velocities."""
    site, kinematics = equations.site, equations.kinematics
    forces = Forces(equations.graph)
    plain = kinematics.accelerations, kinematics.reference_accelerations
    at_centers = inertia_forces(site, equations.masses, kinematics, plain, forces)
    for local in equations.locals_.values():
        if local.lagrangians:
            still = _at_rest(local, kinematics.joint_rates)
            moving = tuple(value - rest for value, rest in zip(local.lagrangians, still, strict=True))
            one = replace(local, potentials=(), dissipations=(), loads=(), lagrangians=moving)
            part_forces(site, one, kinematics, {**local_map(site, local, kinematics), **signals}, forces)
    return balance_rows(kinematics, at_centers, forces, equations.speeds)


def _at_rest(local: LocalPart, joint_rates: Mapping[Expression, Expression]) -> list[Expression]:
    """Return a part's Lagrangians with all velocities zero."""
    rates = dict.fromkeys(local.velocities, 0.0)
    formulas = [formula for symbol, (_, formula) in local.formulas.items() if symbol in joint_rates]
    rates |= {formula: 0.0 for formula in formulas if formula is not None}
    return substitute(list(local.lagrangians), rates)
