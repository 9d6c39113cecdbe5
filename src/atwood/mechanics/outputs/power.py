"""Power of everything that is no potential: loads, dampers, and potentials that change with time."""

from __future__ import annotations

from atwood.expr import Expression, jvp, substitute
from atwood.late import replace
from atwood.mechanics.build import resolve_signals
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.dynamics.forces import Forces, in_joint_coordinates, local_map, part_forces
from atwood.mechanics.kinematics.mechanism import Mechanism
from atwood.model.local.moving_mass import inertial_energy

__all__ = ["applied_power", "switched_energy"]


def applied_power(mechanism: Mechanism, equations: Equations) -> Expression:
    """Return the power, W, that loads, dampers and what changes with time put into the scene.

    What changes with time: potentials, Lagrangians, and mass, which takes its energy along.

    Constraints that move with time (drives) are left out: their power is minus their multiplier times the explicit
    time derivative of the constraint.

    Parameters
    ----------
    mechanism
        The mechanism.
    equations
        Its equations in one form.
    """
    graph, kinematics = equations.graph, equations.kinematics
    signals = resolve_signals(mechanism, equations.site, kinematics, equations.read)
    forces = Forces(graph)
    total = graph.constant(0.0)
    for local in mechanism.locals_.values():
        mapping = {**local_map(equations.site, local, kinematics), **signals}
        alone = replace(local, potentials=(), lagrangians=())
        part_forces(equations.site, alone, kinematics, mapping, forces)
        changing = [*local.potentials, *(-value for value in local.lagrangians)]
        space = mechanism.space.name
        changing += [graph.convert(inertial_energy(one, mechanism.gravity, space)) for one in local.varying]
        placed, _ = in_joint_coordinates(local, kinematics, changing)
        for slope in jvp(placed, {mechanism.time: 1.0}) if placed else ():
            total = total + substitute([slope], mapping)[0]
    for node, force in forces.on_nodes.items():
        for f, v in zip(force, kinematics.velocities[node], strict=True):
            total = total + f * v
    for body, torque in forces.on_bodies.items():
        for c, w in zip(torque, kinematics.angular_velocities.get(body, ()), strict=False):
            total = total + c * w
    for symbol, force_on_joint in forces.on_joints.items():
        total = total + force_on_joint * kinematics.joint_rates[symbol]
    return total


def switched_energy(mechanism: Mechanism, equations: Equations) -> Expression:
    """Return the energy, J, of the potentials that act in some modes only, which comes and goes with these.

    Parameters
    ----------
    mechanism
        The mechanism.
    equations
        Its equations in one form.
    """
    kinematics = equations.kinematics
    signals = resolve_signals(mechanism, equations.site, kinematics, equations.read)
    total = equations.graph.constant(0.0)
    for local in mechanism.locals_.values():
        mapping = {**local_map(equations.site, local, kinematics), **signals}
        for value in in_joint_coordinates(local, kinematics, local.switched)[0]:
            total = total + substitute([value], mapping)[0]
    return total
