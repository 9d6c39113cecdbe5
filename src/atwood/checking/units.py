"""Whether laws give what their units say.

If lengths, masses, times and currents are counted in other units, each quantity comes out as its own unit says, and
nothing else: a law that adds metres to seconds, or holds a number with a unit, does not.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from atwood.checking.samples import Finding
from atwood.consistency.trials import Body, Trial
from atwood.lazy_dataclasses import dataclass, replace
from atwood.model.declare.component import Binding, Component, bind
from atwood.model.declare.connectors import JointCoordinate, Motion, Slide
from atwood.model.declare.function_values import Function
from atwood.model.declare.law_results import BodyInertia, CoordinateLoad, Load, Placement, PointInertia
from atwood.model.declare.laws import Law, scalars
from atwood.model.values.rotation import Rotation
from atwood.model.values.space import Vector
from atwood.model.values.units import Exponents, parse_unit

NOTHING: Exponents = (0, 0, 0, 0)
LENGTH: Exponents = (0, 1, 0, 0)
BASES: tuple[Exponents, ...] = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))
SCALES = (2.3, 1.7, 0.6, 1.4)
"""How many new units a kilogramme, a metre, a second and an ampere are."""
TOLERANCE = 1e-7
"""Relative: other units round a law by some 1e-12, and a wrong unit changes it by more than the units differ."""

Values = list[tuple[float, Exponents]]
"""Numbers, with the unit that they are said to be in."""


@dataclass(frozen=True)
class Units:
    """How many new units there are to each old one."""

    sizes: Sequence[float]

    def of(self, exponents: Exponents) -> float:
        """Return how many new units a unit with these powers is."""
        return math.prod(size**power for size, power in zip(self.sizes, exponents, strict=True))


def wrong_units(trial: Trial, mode: str) -> Iterator[Finding | None]:
    """Yield, for each law, what is wrong with its units, or None."""
    for law in type(trial.component)._laws.values():
        if not (law.holds_in(trial.space.name) and law.acts_in(mode)):
            continue
        try:
            before, after = _values(trial, law, Units((1.0,) * 4)), _values(trial, law, Units(SCALES))
            wrong = _differing(before, after, Units(SCALES))
            if not wrong:
                yield None
                continue
            measured = _measured(trial, law, before, wrong[0])
        except Exception:  # whatever a law of somebody's own can raise; what is amiss is said elsewhere
            continue
        said = _in_words(before[wrong[0]][1])
        if measured is None:
            message = (
                f"it is said to be in {said}, and is in no unit at all: it adds what has different units, or holds a "
                "number that has one; make such a number a parameter"
            )
        else:
            message = f"it is said to be in {said}, and is in {_in_words(measured)}"
        yield Finding("failure", "units", law.name, trial.space.name, message)


def _differing(before: Values, after: Values, units: Units) -> list[int]:
    """Return the numbers that are not scaled as their unit is; those of one unit are compared with the largest."""
    sizes: dict[Exponents, float] = {}
    for (old, unit), (new, _) in zip(before, after, strict=True):
        sizes[unit] = max(sizes.get(unit, 0.0), abs(old) * units.of(unit), abs(new))
    return [
        i
        for i, ((old, unit), (new, _)) in enumerate(zip(before, after, strict=True))
        if abs(new - old * units.of(unit)) > TOLERANCE * sizes[unit] + 1e-12 * units.of(unit)
    ]


def _measured(trial: Trial, law: Law, before: Values, number: int) -> Exponents | None:
    """Return the unit that a number is in, or None if it is in none."""
    powers = []
    for i in range(4):
        sizes = [1.0] * 4
        sizes[i] = 2.0
        ratio = _values(trial, law, Units(sizes))[number][0] / before[number][0]
        power = math.log2(ratio) if ratio > 0.0 else math.nan
        if not math.isfinite(power) or abs(power - round(power)) > 1e-6:
            return None
        powers.append(round(power))
    return powers[0], powers[1], powers[2], powers[3]


def _values(trial: Trial, law: Law, units: Units) -> Values:
    """Return what a law gives where everything is counted in other units."""
    bound = _bound(trial, units)
    names = {one.name: one.options.unit for one in trial.component.laws("observable")}
    coordinates = [
        trial.coordinates[name][0] * units.of(parse_unit(names.get(name, "1")).exponents)
        for name in getattr(law.options, "coordinates", ())
    ]
    made = getattr(bound, law.name)(*coordinates)
    return list(_UNITS[law.kind](trial, law, made))


def _bound(trial: Trial, units: Units) -> Any:
    """Return the component in the state of the trial, with everything in other units."""
    binding = Binding(
        values=_values_in(units, trial),
        motions=_motions_in(units, trial),
        time=0.8 * units.of(BASES[2]),
        space=trial.space.name,
        line=trial.space.line,
        line_signs=trial.line_signs,
        reactions=_reactions_in(units, trial.component),
        energies=_totals_in(units),
    )
    return bind(trial.component, binding)


def _values_in(units: Units, trial: Trial) -> dict[str, Any]:
    """Return parameters, states and inputs in other units."""
    component = trial.component
    values: dict[str, Any] = {}
    for name, spec in component.parameter_specs().items():
        value, size = trial.values[name], units.of(spec.unit.exponents)
        if isinstance(value, Function):
            value = value.scaled([units.of(one.exponents) for one in spec.function_of.values()], size)
        elif isinstance(value, Vector):
            value = value if spec.direction else value * size
        elif isinstance(value, tuple) and not spec.array:
            value = tuple(one * size for one in value)
        elif isinstance(value, float) and not spec.integer:
            value = value * size
        values[name] = value
    for name, state in component.state_specs().items():
        value, size = trial.values[name], units.of(state.unit.exponents)
        values[name] = tuple(one * size for one in value) if isinstance(value, tuple) else value * size
    for name, signal in component.signal_specs().items():
        values[name] = trial.inputs[name][0] * units.of(signal.unit.exponents)
    return values


def _motions_in(units: Units, trial: Trial) -> dict[str, Motion]:
    """Return how each connector moves in other units, with accelerations and the body that it is on."""
    length, time, mass = (units.of(base) for base in (LENGTH, BASES[2], BASES[0]))
    motions: dict[str, Motion] = {}
    for name, one in trial.component.connectors().items():
        if isinstance(one, JointCoordinate):
            value, rate = trial.joint_references.get(name, (0.5, 0.3))
            size = length if isinstance(one, Slide) else 1.0
            second = 0.7 * rate * size / time**2
            motions[name] = Motion(value=value * size, rate=rate * size / time, second_rate=partial(float, second))
            continue
        held, body = trial.poses[name], trial.bodies[name]
        scaled = Body(body.mass * mass, body.center_of_mass * length, _scaled(body.inertia, mass * length**2))
        spin = trial.angular_velocities[name] * (1.0 / time)
        motion = trial.motion(name, held, trial.velocities[name] * (length / time), spin)
        motions[name] = replace(
            motion,
            position=held.position * length,
            acceleration=trial.velocities[name] * (0.7 * length / time**2),
            angular_acceleration=trial.angular_velocities[name] * (0.4 / time**2),
            body=scaled,
        )
    return motions


def _reactions_in(units: Units, component: Component) -> dict[str, float]:
    """Return some reactions of each constraint and joint in other units."""
    reactions = {}
    for law in component.laws("constraint"):
        for number, reaction in enumerate(law.options.reactions):
            size = units.of(parse_unit(law.options.unit).exponents)
            for tail, part in (("", 0.3), (".x", 0.5), (".y", -0.4), (".z", 0.7)):
                reactions[reaction + tail] = (part + 0.1 * number) * size
    if component.laws("joint"):
        for kind, unit in (("force", "N"), ("torque", "N*m")):
            size = units.of(parse_unit(unit).exponents)
            reactions.update({f"{kind}{tail}": 0.6 * size for tail in ("", ".x", ".y", ".z")})
    return reactions


def _totals_in(units: Units) -> dict[str, Any]:
    """Return some energies, momenta and inertia of the parts around a component in other units."""
    length, time, mass = (units.of(base) for base in (LENGTH, BASES[2], BASES[0]))
    joule = units.of(parse_unit("J").exponents)
    return {
        "kinetic": 0.7 * joule,
        "potential": -0.2 * joule,
        "power": 0.3 * joule / time,
        "mass": 1.3 * mass,
        "first_moment": Vector(0.4, -0.3, 0.8) * (mass * length),
        "momentum": Vector(0.6, 0.9, -0.5) * (mass * length / time),
        "angular_momentum": Vector(-0.2, 0.7, 0.3) * (joule * time),
        "moments": Vector(1.1, 1.2, 1.4) * (mass * length**2),
        "products": Vector(0.1, -0.2, 0.15) * (mass * length**2),
    }


def _scaled(axes: Any, size: float) -> Any:
    return tuple(column * size for column in axes)


def _said(unit: str) -> Callable[[Trial, Law, Any], Iterator[tuple[float, Exponents]]]:
    def found(trial: Trial, law: Law, made: Any) -> Iterator[tuple[float, Exponents]]:
        yield float(made), parse_unit(unit).exponents

    return found


def _of_observable(trial: Trial, law: Law, made: Any) -> Iterator[tuple[float, Exponents]]:
    if law.options.unit != "any":
        for one in scalars(made):
            yield float(one), parse_unit(law.options.unit).exponents


def _of_constraint(trial: Trial, law: Law, made: Any) -> Iterator[tuple[float, Exponents]]:
    """Yield what stays zero: times the reaction it is an energy, or a power if it is about velocities."""
    slow = getattr(_bound_at_rest(trial), law.name)()
    moves = any(
        float(a) != float(b)
        for a, b in zip(scalars(getattr(_bound(trial, Units((1.0,) * 4)), law.name)()), scalars(slow), strict=True)
    )
    reaction = parse_unit(law.options.unit).exponents
    product = parse_unit("W" if moves else "J").exponents
    for one in scalars(made):
        a, b, c, d = (p - r for p, r in zip(product, reaction, strict=True))
        yield float(one), (a, b, c, d)


def _bound_at_rest(trial: Trial) -> Any:
    still = {name: Vector(0.0, 0.0, 0.0) for name in trial.velocities}
    held = {name: (value, 0.0) for name, (value, _) in trial.joint_references.items()}
    at_rest = replace(trial, velocities=still, angular_velocities=still, joint_references=held)
    return _bound(at_rest, Units((1.0,) * 4))


def _of_loads(trial: Trial, law: Law, made: Any) -> Iterator[tuple[float, Exponents]]:
    for load in made:
        if isinstance(load, CoordinateLoad):
            yield float(load.value), parse_unit("N" if isinstance(load.at, Slide) else "N*m").exponents
            continue
        assert isinstance(load, Load)
        for one in load.force:
            yield float(one), parse_unit("N").exponents
        for one in load.torque:
            yield float(one), parse_unit("N*m").exponents


def _of_inertia(trial: Trial, law: Law, made: Any) -> Iterator[tuple[float, Exponents]]:
    for one in made:
        if isinstance(one, PointInertia):
            for row in one.masses:
                for mass in row:
                    yield float(mass), BASES[0]
        elif isinstance(one, BodyInertia):
            yield float(one.mass), BASES[0]
            for component in one.center_of_mass:
                yield float(component), LENGTH
            for entry in [one.moment, *(entry for row in one.tensor or () for entry in row)]:
                yield float(entry), (1, 2, 0, 0)


def _of_joint(trial: Trial, law: Law, made: Any) -> Iterator[tuple[float, Exponents]]:
    assert isinstance(made, Placement)
    for one in made.displacement:
        yield float(one), LENGTH
    turns = [one.angle for one in made.rotation.turns] if isinstance(made.rotation, Rotation) else [made.rotation]
    for angle in turns:
        if isinstance(angle, (int, float)):
            yield float(angle), NOTHING


def _of_derivative(trial: Trial, law: Law, made: Any) -> Iterator[tuple[float, Exponents]]:
    """Yield rates of states, in the unit of each a second."""
    given = iter(scalars(made))
    for name in law.options.states:
        spec = trial.component.state_specs()[name]
        mass, length, time, current = spec.unit.exponents
        for one in [next(given) for _ in spec.names(trial.part.values)]:
            if spec.unit.text != "any":
                yield float(one), (mass, length, time - 1, current)


def _of_event(trial: Trial, law: Law, made: Any) -> Iterator[tuple[float, Exponents]]:
    if any(spec.array for spec in trial.component.parameter_specs().values()):
        return  # what stands in its columns has units that nobody says
    yield float(made), parse_unit(law.options.unit).exponents


_UNITS: Mapping[str, Callable[[Trial, Law, Any], Iterator[tuple[float, Exponents]]]] = {
    "derivative": _of_derivative,
    "potential": _said("J"),
    "lagrangian": _said("J"),
    "dissipation": _said("W"),
    "observable": _of_observable,
    "constraint": _of_constraint,
    "force": _of_loads,
    "inertia": _of_inertia,
    "joint": _of_joint,
    "event": _of_event,
}


def _in_words(exponents: Exponents) -> str:
    """Return a unit by its powers of kg, m, s and A."""
    for known in ("1", "m", "m^2", "m/s", "m/s^2", "rad/s", "kg", "kg*m^2", "s", "N", "N*m", "W", "N/m", "kg*m/s"):
        if parse_unit(known).exponents == exponents:
            return "N*m or J" if known == "N*m" else "1 or rad" if known == "1" else known
    parts = [(name, power) for name, power in zip(("kg", "m", "s", "A"), exponents, strict=True) if power]
    return "*".join(name if power == 1 else f"{name}^{power}" for name, power in parts)
