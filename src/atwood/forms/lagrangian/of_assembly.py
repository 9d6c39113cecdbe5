"""The Lagrangian of an assembly, part by part, and its momenta dL/dq' as quantities by path."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from atwood.errors import UsageError
from atwood.expr import Expression, jacobian, jvp, substitute, vjp
from atwood.forms.assembly import Assembly, FormName
from atwood.forms.kept import Key
from atwood.forms.lagrangian.terms import Contribution, Lagrangian, contribution, inertial_terms
from atwood.lazy_dataclasses import replace
from atwood.mechanics.build import resolve_signals
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.kinematics.orientation import euler_spin
from atwood.mechanics.outputs.observables import Observable
from atwood.mechanics.outputs.reading import MOMENTUM
from atwood.topology.spanning_forest import Coordinate


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
    along: dict[Expression, Expression | float] = {found.time: 1.0}
    along |= dict(zip(found.coordinates, found.rates, strict=True))
    along |= dict(zip(found.velocities, found.accelerations, strict=True))
    places = [place for place in found.moves if place is not None]
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
        for row, column, entry in zip(slopes.rows, slopes.columns, slopes.entries, strict=True):
            total[column] = total[column] + entry * there[row]
        return tuple(total)

    parts = []
    for part in made.parts:
        kinetic, potential, total, rayleigh = moved([part.kinetic, part.potential, part.lagrangian, part.rayleigh])
        parts.append(Contribution(part.path, kinetic, potential, total, rayleigh, on_angles(part.forces)))
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
        parts=tuple(parts),
        inertial=on_angles(made.inertial),
        rows=on_angles(made.rows),
        constraint_rows=on_angles(made.constraint_rows),
        constraints=tuple(constraints),
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
