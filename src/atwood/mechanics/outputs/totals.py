"""Totals: mass, momentum, angular momentum and inertia of several parts together, about the world's origin."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from atwood.expr import Expression, Scalar, jvp
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.dynamics.inertia import tensor_of, turned_tensor
from atwood.mechanics.kinematics.mechanism import Mechanism, world_position
from atwood.mechanics.kinematics.positions import body_point_of
from atwood.mechanics.outputs.observables import Observable, take
from atwood.model.declare.contributions import BodyInertia
from atwood.model.local.parts import LocalPart
from atwood.model.values.rotation import Axes, from_axes
from atwood.model.values.vector import ZERO, Vector, cross, dot


@dataclass(frozen=True)
class Totals:
    """What parts have together; sums of material points, about the origin of the world (Goldstein, section 1.2).

    Attributes
    ----------
    mass
        kg.
    first_moment
        Mass times the position of the centre of mass, kg m.
    momentum
        kg m/s.
    angular_momentum
        kg m^2/s.
    moments, products
        Entries xx, yy, zz and xy, xz, yz of the inertia tensor in world axes, kg m^2.
    """

    mass: Scalar = 0.0
    first_moment: Vector = ZERO
    momentum: Vector = ZERO
    angular_momentum: Vector = ZERO
    moments: Vector = ZERO
    products: Vector = ZERO

    def __add__(self, other: Totals) -> Totals:
        return Totals(
            self.mass + other.mass,
            self.first_moment + other.first_moment,
            self.momentum + other.momentum,
            self.angular_momentum + other.angular_momentum,
            self.moments + other.moments,
            self.products + other.products,
        )


def part_totals(mechanism: Mechanism, equations: Equations, path: str) -> Totals:
    """Return what one part has; what is only said by a Lagrangian has none of it."""
    local, kinematics, space = mechanism.locals_[path], equations.kinematics, mechanism.space
    total = Totals()
    for one in local.point_inertias:
        nodes = [equations.site.node(path, point.name) for point in one.points]
        places = [space.vector(world_position(mechanism, kinematics.placements, node)) for node in nodes]
        moving = [space.vector(kinematics.velocities[node]) for node in nodes]
        for i, r in enumerate(places):
            for j, (s, v) in enumerate(zip(places, moving, strict=True)):
                total += _of_mass(one.masses[i][j], r, s, v)
    for body in local.body_inertias:
        total += _of_body(mechanism, equations, local, body)
    return total


def _of_mass(mass: Scalar, r: Vector, s: Vector, velocity: Vector) -> Totals:
    """Return what a mass has at r that moves with a velocity, and has its second arm at s."""
    momentum = velocity * mass
    square = dot(r, s)
    moments = Vector(square - r.x * s.x, square - r.y * s.y, square - r.z * s.z) * mass
    products = Vector(r.x * s.y + r.y * s.x, r.x * s.z + r.z * s.x, r.y * s.z + r.z * s.y) * (-0.5 * mass)
    return Totals(mass, r * mass, momentum, cross(r, momentum), moments, products)


def _of_body(mechanism: Mechanism, equations: Equations, local: LocalPart, body: BodyInertia) -> Totals:
    """Return what a rigid body has: as a point at its centre of mass, and by its turning."""
    kinematics, space = equations.kinematics, mechanism.space
    node = equations.site.node(local.part.path, body.frame.name)
    index, turn = equations.site.bodies.body_of[node], equations.site.node_turns[node]
    arm = body_point_of(kinematics, index, turn, body.center_of_mass, space)
    place = space.vector(world_position(mechanism, kinematics.placements, node)) + space.vector(arm.position)
    whole = _of_mass(body.mass, place, place, space.vector(kinematics.velocities[node]) + space.vector(arm.velocity))
    spin = kinematics.angular_velocities.get(index, ())
    if space.is_spatial:
        tensor = turned_tensor(tensor_of(local.part.path, body), turn)
        axes = kinematics.placements.axes.get(index)
        own = from_axes(tensor, Vector(*spin)) if spin else ZERO
        x, y, z = tensor if axes is None else _in_world(tensor, axes)
        turned = Totals(
            angular_momentum=own if axes is None else from_axes(axes, own),
            moments=Vector(x.x, y.y, z.z),
            products=Vector(y.x, z.x, z.y),
        )
    else:
        rate = spin[0] if spin else 0.0
        moments = Vector(0.0, body.moment, 0.0)
        turned = Totals(angular_momentum=Vector(0.0, -1.0 * (body.moment * rate), 0.0), moments=moments)
    return whole + turned


def _in_world(tensor: Axes, axes: Axes) -> Axes:
    """Return the columns in world axes of a tensor whose columns are in the axes of a body: ``R J R^T``."""
    columns = [from_axes(axes, column) for column in tensor]
    rows = [Vector(axes[0][i], axes[1][i], axes[2][i]) for i in range(3)]
    x, y, z = (columns[0] * row.x + columns[1] * row.y + columns[2] * row.z for row in rows)
    return x, y, z


def energy_rate(equations: Equations, energy: Expression) -> Expression:
    """Return how fast an energy changes along the motion, W."""
    moving: dict[Expression, Expression | float] = {equations.time: 1.0}
    moving |= zip(equations.coordinates, equations.rates, strict=True)
    moving |= zip(equations.speeds, equations.accelerations, strict=True)
    return jvp([energy], moving)[0]


def observe_totals(mechanism: Mechanism, prefix: str, around: Mapping[str, object]) -> dict[str, Observable]:
    """Return the quantities of a model as a whole, by path."""
    found: dict[str, Observable] = {}
    for name, value, unit, doc in _quantities(mechanism.space.name, around):
        take(mechanism, found, f"{prefix}{name}", value, unit, doc, False)
    return found


def _quantities(space: str, around: Mapping[str, object]) -> Iterator[tuple[str, Scalar, str, str]]:
    read: Mapping[str, Scalar] = around
    mass, first = read["mass"], read["first_moment"]
    yield "mass", mass, "kg", "Mass of all parts."
    yield "center_of_mass", first / mass, "m", "Centre of mass in world axes."
    yield "momentum", read["momentum"], "kg*m/s", "Momentum in world axes."
    yield "kinetic_energy", read["kinetic"], "J", "Kinetic energy of all parts."
    yield "potential_energy", read["potential"], "J", "Potential energy of all parts."
    yield "total_energy", read["kinetic"] + read["potential"], "J", "Kinetic and potential energy of all parts."
    yield "power", read["power"], "W", "Rate of the kinetic and potential energy of all parts."
    # about the centre of mass, by the parallel-axis theorem
    own = _of_mass(-1.0 / mass, first, first, ZERO)
    moments = read["moments"] + own.moments
    if space == "space":
        yield "angular_momentum", read["angular_momentum"], "kg*m^2/s", "Angular momentum about the world's origin."
        yield "moments", moments, "kg*m^2", "Entries Jxx, Jyy, Jzz about the centre of mass, in world axes."
        yield "products", read["products"] + own.products, "kg*m^2", "Entries Jxy, Jxz, Jyz, likewise."
    elif space == "plane":
        turning = read["angular_momentum"].y * -1.0
        yield "angular_momentum", turning, "kg*m^2/s", "Angular momentum about the origin, counter-clockwise."
        yield "moment", moments.y, "kg*m^2", "Moment of inertia about the centre of mass."


def add_totals(parts: Sequence[Totals]) -> Totals:
    """Return what several parts have together."""
    total = Totals()
    for part in parts:
        total += part
    return total
