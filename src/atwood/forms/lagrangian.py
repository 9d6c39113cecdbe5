"""Lagrange's equations of a scene: energies, Rayleigh function and generalized forces, part by part and in sum.

With ``L = T - V`` and the Rayleigh function R, Lagrange's equations are

    d/dt dL/dq' - dL/dq + dR/dq' = Q + G^T lambda,    g(q, t) = 0,    G = dg/dq

(Goldstein, equations 1.57, 1.70 and 2.23). All velocities are derivatives of coordinates, but for the angular velocity
of a body whose orientation is in quaternions: there the equations are Euler's, in the axes of the body (Goldstein,
equation 5.39). Angular velocities are rates of angles where orientations are in Euler angles.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, TypeAlias

from atwood.errors import UsageError, suggestion
from atwood.expr import Expression, Graph, Scalar, SparseMatrix, depends_on, jacobian, jvp, substitute, vjp
from atwood.forms.assembly import Assembly, FormName
from atwood.forms.caches import Key
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.build import resolve_signals
from atwood.mechanics.dynamics.equations import Constraint, Equations, balance_rows, inertia_forces
from atwood.mechanics.dynamics.forces import Forces, in_joint_coordinates, part_forces, place_part
from atwood.mechanics.kinematics.orientation import euler_spin
from atwood.mechanics.outputs.observables import MOMENTUM, Observable
from atwood.mechanics.outputs.totals import add_up, part_energies
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
    def course(self) -> dict[Expression, Expression | float]:
        """The derivatives by time of time, coordinates and velocities, by symbol."""
        moving = zip((*self.coordinates, *self.velocities), (*self.rates, *self.accelerations), strict=True)
        return {self.time: 1.0, **dict(moving)}

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
    part = place_part(site, local, kinematics, signals)
    linked = [*local.signal_symbols.values(), *local.stand_ins]
    # What follows the output of another part is no potential of the scene, and a Lagrangian is not T - V.
    plain = replace(local, potentials=_free_of(local.potentials, linked), lagrangians=())
    locals_ = {**mechanism.locals_, path: plain}
    kinetic, potential = part_energies(replace(mechanism, locals_=locals_), equations, path, signals)
    total = kinetic - potential
    given = in_joint_coordinates(local, kinematics, local.lagrangians)[0]
    if given:
        total = total + add_up(part.put(given))
        locals_ = {**mechanism.locals_, path: replace(plain, lagrangians=local.lagrangians)}
        kinetic, potential = part_energies(replace(mechanism, locals_=locals_), equations, path, signals)
    damping = in_joint_coordinates(local, kinematics, _free_of(local.dissipations, linked))[0]
    rayleigh = add_up([graph.zero, *part.put(damping)]) if damping else graph.zero
    rest = replace(
        local,
        potentials=tuple(one for one in local.potentials if one not in plain.potentials),
        dissipations=tuple(one for one in local.dissipations if one not in _free_of(local.dissipations, linked)),
        lagrangians=(),
    )
    found = Forces(graph)
    part_forces(replace(part, local=rest), found)
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
            part_forces(replace(place_part(site, local, kinematics, signals), local=one), forces)
    return balance_rows(kinematics, at_centers, forces, equations.speeds)


def _at_rest(local: LocalPart, joint_rates: Mapping[Expression, Expression]) -> list[Expression]:
    """Return a part's Lagrangians with all velocities zero."""
    rates = dict.fromkeys(local.velocities, 0.0)
    formulas = [formula for symbol, (_, formula) in local.formulas.items() if symbol in joint_rates]
    rates |= {formula: 0.0 for formula in formulas if formula is not None}
    return substitute(list(local.lagrangians), rates)


def lagrangian_of(assembly: Assembly, form: FormName | None = None) -> Lagrangian:
    """Return a scene in the terms of Lagrange's equations.

    Parameters
    ----------
    assembly
        The scene. With orientations in Euler angles, the velocities are the derivatives of these angles.
    form
        In which coordinates; those of the assembly if not given.

    Raises
    ------
    UsageError
        If orientations are in three coordinates that are no Euler angles.
    """
    equations = assembly.in_coordinates(form or assembly.form)
    made = lagrangian_along_speeds(assembly, equations)
    return _along_angles(made) if any(c.kind.startswith("euler-") for c in equations.orientation_coordinates) else made


def rows_by_part(found: Lagrangian) -> dict[str, tuple[Expression, ...]]:
    """Return what each part adds to each equation of motion: inertia, less all forces, those of constraints included.

    Parameters
    ----------
    found
        The scene.

    Returns
    -------
    dict
        By path. Empty where some velocities are no derivatives of coordinates or constraints on velocities are solved:
        there the equations are not the sums of what the Lagrangians of parts give.
    """
    if found.has_angular_velocities or found.is_restricted:
        return {}
    graph, one = found.graph, found.graph.one
    along, places = found.course, [place for place in found.moves if place is not None]
    rows: dict[str, tuple[Expression, ...]] = {}
    for part in found.parts:
        momenta = vjp([part.lagrangian], [one], list(found.velocities))
        slopes = vjp([part.lagrangian], [one], list(found.coordinates))
        losses = vjp([part.rayleigh], [one], list(found.velocities))
        sides = zip(jvp(momenta, along), places, losses, part.forces, strict=True)
        rows[part.path] = tuple(rate - slopes[place] + loss - force for rate, place, loss, force in sides)
    for held in found.constraints:
        path, nothing = held.key[0], (graph.zero,) * len(found.velocities)
        others = {other.multiplier: 0.0 for other in found.constraints if other is not held}
        pushes = substitute(list(found.constraint_rows), others) if others else found.constraint_rows
        rows[path] = tuple(row - push for row, push in zip(rows.get(path, nothing), pushes, strict=True))
    return rows


def lagrangian_along_speeds(assembly: Assembly, equations: Equations) -> Lagrangian:
    """Return a scene in the terms of Lagrange's equations with the speeds of its equations as velocities.

    Parameters
    ----------
    assembly
        The scene.
    equations
        Its equations in the coordinates that are wanted.
    """
    mechanism, number = assembly.mechanism, {q: i for i, q in enumerate(equations.rates)}
    signals = resolve_signals(mechanism, equations.site, equations.kinematics, equations.read)
    parts = (contribution(assembly, equations, path, signals) for path in mechanism.locals_)
    return Lagrangian(
        equations=equations,
        time=equations.time,
        coordinates=equations.coordinates,
        names=equations.names,
        velocities=equations.speeds,
        velocity_names=equations.speed_names,
        accelerations=equations.accelerations,
        rates=equations.rates,
        moves=tuple(number.get(u) for u in equations.speeds),
        speeds=equations.speeds,
        parts=tuple(one for one in parts if not one.is_nothing),
        inertial=tuple(inertial_terms(equations, signals)),
        rows=equations.rows_with_multipliers or equations.rows,
        constraint_rows=equations.constraint_rows,
        constraints=equations.constraints,
    )


def _along_angles(made: Lagrangian) -> Lagrangian:
    """Return it with the derivatives of Euler angles in place of angular velocities."""
    graph, equations = made.graph, made.equations
    velocities, accelerations = list(made.velocities), list(made.accelerations)
    names, moves, rates = list(made.velocity_names), list(made.moves), list(made.rates)
    spins: dict[Expression, Expression] = {}
    for orientation in equations.orientation_coordinates:
        if len(orientation.speeds) < len(orientation.coordinates):
            raise UsageError(
                "rolling gives some of its angular velocities, so that its angles have no derivatives of their own",
                where=orientation.body,
                advice="Take quaternions, or the dae form.",
            )
        for number, place in zip(orientation.speeds, orientation.coordinates, strict=True):
            one = made.names[place]
            velocities[number] = rates[place] = graph.symbol(f"u:{one.name}")
            accelerations[number] = graph.symbol(f"a:{one.name}")
            names[number], moves[number] = Coordinate(f"{one.name}'", f"{one.unit}/s"), place
        angles = [made.coordinates[i] for i in orientation.coordinates]
        spin = euler_spin(orientation, angles, [velocities[i] for i in orientation.speeds])
        spins |= {made.velocities[i]: graph.convert(w) for i, w in zip(orientation.speeds, spin, strict=True)}
    rates = substitute(rates, spins)
    along: dict[Expression, Expression | float] = dict(zip(made.coordinates, rates, strict=True))
    along |= {made.time: 1.0} | dict(zip(velocities, accelerations, strict=True))
    speeds = [spins.get(u, u) for u in made.velocities]
    turned = dict(zip(made.velocities, speeds, strict=True))
    turned |= dict(zip(made.accelerations, jvp(speeds, along), strict=True))
    slopes = jacobian(speeds, velocities)

    def moved(values: Sequence[Expression]) -> tuple[Expression, ...]:
        return tuple(substitute(list(values), turned))

    def on_angles(values: Sequence[Expression]) -> tuple[Expression, ...]:
        total, there = [graph.zero] * len(velocities), moved(values)
        for row, column, entry in slopes.triples:
            total[column] = total[column] + entry * there[row]
        return tuple(total)

    levels = iter(moved([level for held in made.constraints for level in (held.rate, held.second)]))
    constraints = [replace(held, rate=next(levels), second=next(levels)) for held in made.constraints]
    return replace(
        made,
        velocities=tuple(velocities),
        velocity_names=tuple(names),
        accelerations=tuple(accelerations),
        rates=tuple(rates),
        moves=tuple(moves),
        speeds=tuple(speeds),
        parts=tuple(_moved(one, moved, on_angles) for one in made.parts),
        inertial=on_angles(made.inertial),
        rows=on_angles(made.rows),
        constraint_rows=on_angles(made.constraint_rows),
        constraints=tuple(constraints),
    )


_Put: TypeAlias = Callable[[Sequence[Expression]], tuple[Expression, ...]]


def _moved(part: Contribution, put: _Put, along: _Put) -> Contribution:
    """Return what a part contributes in other coordinates, forces along other velocities."""
    kinetic, potential, total, rayleigh = put([part.kinetic, part.potential, part.lagrangian, part.rayleigh])
    return Contribution(part.path, kinetic, potential, total, rayleigh, along(part.forces))


def with_signs(found: Lagrangian, paths: Collection[str]) -> Lagrangian:
    """Return it with the negatives of some coordinates, by path, in their place; their names have the sign, too."""
    graph, numbers = found.graph, {one.name: i for i, one in enumerate(found.names)}
    coordinates, velocities, accelerations = map(list, (found.coordinates, found.velocities, found.accelerations))
    names, moved, signs = list(found.names), dict[Expression, Expression | float](), [1.0] * len(velocities)
    for path in paths:
        if path not in numbers or numbers[path] not in found.moves:
            raise UsageError(
                "no coordinate whose velocity is its derivative has this path, and only such a one has another sign",
                where=path,
                advice=suggestion(path, numbers) or "Give a letter without a sign.",
            )
        i, k = numbers[path], found.moves.index(numbers[path])
        signs[k], names[i] = -1.0, replace(names[i], name=f"-{path}")
        for values, place, letter in ((coordinates, i, "q"), (velocities, k, "u"), (accelerations, k, "a")):
            symbol = graph.symbol(f"-{letter}:{path}")
            moved[values[place]], values[place] = -symbol, symbol

    def put(values: Sequence[Expression]) -> tuple[Expression, ...]:
        return tuple(substitute(list(values), moved))

    def along(values: Sequence[Expression]) -> tuple[Expression, ...]:
        return tuple(sign * value for sign, value in zip(signs, put(values), strict=True))

    turned = {numbers[path]: -1.0 for path in paths}
    return replace(
        found,
        coordinates=tuple(coordinates),
        names=tuple(names),
        velocities=tuple(velocities),
        accelerations=tuple(accelerations),
        rates=tuple(turned.get(i, 1.0) * rate for i, rate in enumerate(put(found.rates))),
        speeds=put(found.speeds),
        parts=tuple(_moved(one, put, along) for one in found.parts),
        inertial=along(found.inertial),
        rows=along(found.rows),
        constraint_rows=along(found.constraint_rows),
        constraints=tuple(
            replace(
                held,
                value=None if held.value is None else put([held.value])[0],
                rate=put([held.rate])[0],
                second=put([held.second])[0],
            )
            for held in found.constraints
        ),
    )


_MOMENTA: Key[Mapping[str, Observable]] = Key("momenta of coordinates")
_UNITS = {"m": "kg*m/s", "rad": "kg*m^2/s"}


def momenta_of(assembly: Assembly, equations: Equations) -> Mapping[str, Observable]:
    """Return the momenta ``dL/dq'`` of coordinates by path."""
    if equations is assembly.maximal:
        return {}
    form = "reduced" if equations is assembly.reduced else "regular"
    return assembly.shared.get(_MOMENTA, lambda: _momenta(assembly, form), form)


def _momenta(assembly: Assembly, form: Any) -> Mapping[str, Observable]:
    found = lagrangian_of(assembly, form)
    if found.is_restricted:
        return {}
    own = found.equations
    pairs = zip(found.velocities, found.moves, own.speeds, strict=True)
    on_speeds: dict[Any, Any] = {v: own.rates[place] for v, place, u in pairs if v is not u and place is not None}
    momenta = list(found.momenta)
    momenta = substitute(momenta, on_speeds) if on_speeds else momenta
    made = {}
    for value, place in zip(momenta, found.moves, strict=True):
        if place is not None and found.names[place].unit in _UNITS:
            name = found.names[place]
            path, unit = f"{MOMENTUM}{name.name}", _UNITS[name.unit]
            made[path] = Observable(path, unit, f"Momentum of {name.name}.", False, value)
    return made
