"""What each part contributes to Lagrange's equations, and the inertial terms of all together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from atwood.expr import Expression, Scalar, depends_on, jvp, substitute, vjp
from atwood.forms.assembly import Assembly
from atwood.forms.lagrangian.terms import Contribution
from atwood.late import replace
from atwood.mechanics.dynamics.equations import Equations, balance_rows, inertia_forces
from atwood.mechanics.dynamics.forces import Forces, in_joint_coordinates, local_map, part_forces
from atwood.mechanics.outputs.observables import add_up, part_energies
from atwood.model.local.parts import LocalPart

__all__ = ["contribution", "inertial_terms"]


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
