"""Examples of Modelica.Mechanics.Translational.

A mass of Modelica has a length, and its flanges are at its ends; here every displacement is that of the mass itself, so
that lengths are parts of the natural extensions.
"""

from __future__ import annotations

from collections.abc import Callable
from math import atan, cos, pi, sin

from atwood import Component, Scalar, Scene, select
from atwood_library import (
    Inertia,
    Mass1D,
    RackAndPinion,
    RotationalSource,
    Sine,
    TranslationalCoupling,
    TranslationalGap,
    TranslationalMotion,
    TranslationalResistance,
    TranslationalSource,
    TranslationalSpringDamper,
)

from .building import Example, Signal, made

__all__ = ["EXAMPLES", "compare_braking_force"]


def accelerate() -> Scene:
    """Return a mass whose acceleration is given."""
    return made(
        {
            "mass": Mass1D(mass=1.0),
            "drive": TranslationalMotion(follows="acceleration", acceleration=1.0),
        },
        "mass.slide - drive.b",
        {"mass.displacement": 0.0},
        gravity=0.0,
    )


def damper() -> Scene:
    """Return masses that run against a wall through a damper, and through a spring and a damper."""
    start = {f"{name}.{what}": value for name in ("mass1", "mass2", "mass3") for what, value in
             (("displacement", 3.0), ("speed", 10.0))}  # fmt: skip
    # The wall is at 4.5, the end of the mass 0.5 ahead of its middle, and the springs are at rest at a length of one.
    return made(
        {
            "mass1": Mass1D(),
            "mass2": Mass1D(),
            "mass3": Mass1D(),
            "damper1": TranslationalSpringDamper(damping=25.0, against="ground"),
            "damper2": TranslationalSpringDamper(damping=25.0, against="ground"),
            "spring2": TranslationalSpringDamper(stiffness=1.0, natural=3.0, against="ground"),
            "spring3": TranslationalSpringDamper(stiffness=1.0, damping=25.0, natural=3.0, against="ground"),
        },
        "mass1.slide - damper1.b, mass2.slide - damper2.b - spring2.b, mass3.slide - spring3.b",
        start,
        gravity=0.0,
    )


def elasto_gap() -> Scene:
    """Return a mass between two springs, and one that meets two springs only at either end."""
    return made(
        {
            "mass1": Mass1D(),
            "mass2": Mass1D(),
            "left": TranslationalSpringDamper(stiffness=10.0, damping=1.5, natural=-1.0, against="ground"),
            "right": TranslationalSpringDamper(stiffness=10.0, damping=1.5, natural=1.0, against="ground"),
            "gap": TranslationalGap(stiffness=10.0, damping=1.5, lower=-0.5, upper=0.5, against="ground"),
        },
        "mass1.slide - left.b - right.b, mass2.slide - gap.b",
        {"mass1.displacement": 2.0, "mass1.speed": 0.0, "mass2.displacement": 2.0, "mass2.speed": 0.0},
        gravity=0.0,
    )


def generation_of_fmus() -> Scene:
    """Return two masses joined rigidly, by a spring and a damper, and by a spring, each pair driven alike."""
    masses = {"1a": 1.1, "1b": 2.2, "2a": 1.1, "2b": 2.2, "3a": 1.1, "3b": 2.2}
    parts = {
        **{f"mass{name}": Mass1D(mass=mass) for name, mass in masses.items()},
        **{f"force{n}": TranslationalSource() for n in (1, 2, 3)},
        "rigid": TranslationalCoupling(),
        "damped": TranslationalSpringDamper(stiffness=1e4, damping=100.0),
        "spring": TranslationalSpringDamper(stiffness=1e4),
        "sine": Sine(amplitude=10.0, angular_frequency=4.0 * pi),
    }
    joined = """
    mass1a.slide - force1.b - rigid.a, mass1b.slide - rigid.b
    mass2a.slide - force2.b - damped.a, mass2b.slide - damped.b
    mass3a.slide - force3.b - spring.a, mass3b.slide - spring.b
    sine.value > force1.value, sine.value > force2.value, sine.value > force3.value
    """
    paths = ["mass1a", "mass2a", "mass2b", "mass3a", "mass3b"]
    start = {f"{path}.{what}": 0.0 for path in paths for what in ("displacement", "speed")}
    return made(parts, joined, start, gravity=0.0)


def initial_conditions() -> Scene:
    """Return rows of masses and springs, one of which starts out of balance."""
    return made(
        {
            "m1": Mass1D(),
            "m2": Mass1D(),
            "m3": Mass1D(),
            "m4": Mass1D(),
            "s1": TranslationalSpringDamper(stiffness=1e3, natural=0.5, against="ground"),
            "sd1": TranslationalSpringDamper(stiffness=111.0, damping=1.0, natural=2.5),
            "s2": TranslationalSpringDamper(stiffness=1e3, natural=4.5, against="ground"),
            "sd2": TranslationalSpringDamper(stiffness=111.0, damping=1.0, natural=8.0),
        },
        "m1.slide - s1.b - sd1.a, m2.slide - sd1.b, m3.slide - s2.b - sd2.a, m4.slide - sd2.b",
        {
            "s1.extension": 0.0, "m1.speed": 0.0, "sd1.extension": 2.5, "m2.speed": 0.0,
            "m3.displacement": 4.5, "m3.speed": 0.0, "m4.displacement": 12.5, "m4.speed": 0.0,
        },
        gravity=0.0,
    )  # fmt: skip


def oscillator() -> Scene:
    """Return two oscillators driven at resonance, one of them damped."""
    return made(
        {
            "mass1": Mass1D(),
            "mass2": Mass1D(),
            "spring1": TranslationalSpringDamper(stiffness=1e4, natural=-0.5, against="ground"),
            "spring2": TranslationalSpringDamper(stiffness=1e4, damping=10.0, natural=-0.5, against="ground"),
            "force1": TranslationalSource(),
            "force2": TranslationalSource(),
            "sine": Sine(angular_frequency=2.0 * pi * 15.9155),
        },
        """mass1.slide - spring1.b - force1.b, mass2.slide - spring2.b - force2.b
        sine.value > force1.value, sine.value > force2.value""",
        {"mass1.displacement": -0.5, "mass1.speed": 0.0, "mass2.displacement": -0.5, "mass2.speed": 0.0},
        gravity=0.0,
    )


def preload() -> Scene:
    """Return a spool between two plates that a preloaded spring presses against stops."""
    contact = {"stiffness": 1e6, "damping": 250.0}
    return made(
        {
            "spool": Mass1D(mass=0.15),
            "plate_a": Mass1D(mass=0.01),
            "plate_b": Mass1D(mass=0.01),
            "spring": TranslationalSpringDamper(stiffness=20e3, natural=0.027),
            "friction": TranslationalSpringDamper(damping=2500.0, against="ground"),
            "outer_a": TranslationalGap(**contact, ends="lower", lower=-0.093, upper=1.0, against="ground"),
            "outer_b": TranslationalGap(**contact, ends="upper", lower=-1.0, upper=-0.0675, against="ground"),
            "inner_a": TranslationalGap(**contact, ends="lower", lower=-0.10775, upper=1.0),
            "inner_b": TranslationalGap(**contact, ends="lower", lower=0.08225, upper=1.0),
            "force": TranslationalSource(),
            "sine": Sine(amplitude=150.0, angular_frequency=0.02 * pi),
        },
        """
        spool.slide - friction.b - force.b - inner_a.a - inner_b.b
        plate_a.slide - outer_a.b - inner_a.b - spring.a
        plate_b.slide - outer_b.b - inner_b.a - spring.b
        sine.value > force.value
        """,
        {
            "spool.displacement": 0.01475, "spool.speed": 0.0, "plate_a.displacement": -0.093, "plate_a.speed": 0.0,
            "plate_b.displacement": -0.06925, "plate_b.speed": 0.0,
        },
        gravity=0.0,
    )  # fmt: skip


def sensors() -> Scene:
    """Return a mass that is pushed through a force sensor."""
    return made(
        {
            "end": Mass1D(mass=0.0),
            "mass": Mass1D(),
            "sensor": TranslationalCoupling(offset=0.5),
            "force": TranslationalSource(),
            "sine": Sine(amplitude=10.0, angular_frequency=8.0 * pi),
        },
        "end.slide - force.b - sensor.a, mass.slide - sensor.b, sine.value > force.value",
        {"mass.displacement": 0.0, "mass.speed": 0.0},
        gravity=0.0,
    )


def sign_convention() -> Scene:
    """Return masses that are pushed at either end, which is the same."""
    names = ("mass1", "mass2", "mass3")
    forces = {f"{name}_force": TranslationalSource(value=1.0) for name in names}
    start = {f"{name}.{what}": 0.0 for name in names for what in ("displacement", "speed")}
    joined = ", ".join(f"{name}.slide - {name}_force.b" for name in names)
    return made({name: Mass1D() for name in names} | forces, joined, start, gravity=0.0)


def compare_braking_force() -> Scene:
    """Return four masses that are slowed down, each by another law."""
    laws = {
        "sign": {"constant": 100.0, "smooth_below": 1.0},
        "linear": {"linear": 1.0},
        "quadratic": {"quadratic": 0.01},
        "inverse": {"power": 1e4, "smooth_below": 1.0},
    }
    parts = {name: Mass1D() for name in laws} | {
        f"{name}_brake": TranslationalResistance(**law) for name, law in laws.items()
    }
    start = {f"{name}.{what}": value for name in laws for what, value in (("displacement", 0.0), ("speed", 100.0))}
    return made(parts, ", ".join(f"{name}.slide - {name}_brake.b" for name in laws), start, gravity=0.0)


def _steps(*levels: tuple[float, float]) -> Callable[[Scalar], Scalar]:
    """Return a function of time that jumps: times and what it is from then on; zero before."""
    before = (0.0, *(value for _, value in levels))

    def value(t: Scalar) -> Scalar:
        total: Scalar = 0.0
        for (since, level), last in zip(levels, before, strict=False):
            total = total + select(t < since, 0.0, level - last)
        return total

    return value


def vehicle() -> Scene:
    """Return a vehicle, and one with a trailer, on a road that rises for a while."""
    gravity, mass, radius, slope = 9.80665, 100.0, 0.25, atan(0.05)
    rolling = 0.01 * mass * gravity
    nominal = (0.5 * 1.0 * 1.18 * (25.0 / 3.5) ** 2 / 2.0 + rolling) * radius
    torque = [(5.0, 5.6), (10.8, 1.0), (20.0, 2.8), (25.0, 1.0), (50.0, -5.0), (55.0, 0.0)]
    parts: dict[str, Component] = {"coupling": TranslationalCoupling()}
    joined = "vehicle1.slide - coupling.a, trailer.slide - coupling.b\n"
    for name, factor in (("vehicle", 1.0), ("vehicle1", 2.0), ("trailer", 0.0)):
        parts |= {
            name: Mass1D(mass=mass),
            f"{name}_air": TranslationalResistance(quadratic=0.5 * 1.2 / 2.0),
            f"{name}_road": TranslationalResistance(
                constant=rolling, level=_steps((0.0, 1.0), (20.0, cos(slope)), (25.0, 1.0))
            ),
            f"{name}_hill": TranslationalSource(value=_steps((20.0, -mass * gravity * sin(slope)), (25.0, 0.0))),
        }
        joined += f"{name}.slide - {name}_air.b - {name}_road.b - {name}_hill.b\n"
        if factor:
            parts |= {
                f"{name}_wheel": Inertia(moment=0.0),
                f"{name}_rolling": RackAndPinion(radius=radius),
                f"{name}_drive": RotationalSource(
                    value=_steps(*((t, factor * nominal * level) for t, level in torque))
                ),
            }
            joined += (
                f"{name}_wheel.flange - {name}_rolling.pinion - {name}_drive.b, {name}.slide - {name}_rolling.rack\n"
            )
    start = {f"{name}.{what}": 0.0 for name in ("vehicle", "vehicle1") for what in ("displacement", "speed")}
    return made(parts, joined, start, gravity=0.0)


def why_arrows() -> Scene:
    """Return two masses on springs, whichever way their arrows point."""
    names = ("mass1", "mass2")
    spring = {"stiffness": 11.0, "natural": -0.9, "against": "ground"}
    springs = {f"{name}_spring": TranslationalSpringDamper(**spring) for name in names}
    start = {f"{name}.{what}": 0.0 for name in names for what in ("displacement", "speed")}
    joined = ", ".join(f"{name}.slide - {name}_spring.b" for name in names)
    return made({name: Mass1D() for name in names} | springs, joined, start, gravity=0.0)


def _moving(*names: str) -> dict[str, str]:
    """Return the signals of masses that have the same names here."""
    return {f"{name}.{m}": f"{name}.{ours}" for name in names for m, ours in (("s", "displacement"), ("v", "speed"))}


EXAMPLES = {
    "Accelerate": Example(accelerate, {"accelerate.s": "mass.displacement", "accelerate.v": "mass.speed"}),
    "Damper": Example(
        damper,
        {
            "damper1.s_rel": Signal("mass1.displacement", -1.0, 4.0),
            "damper1.v_rel": Signal("mass1.speed", -1.0),
            "damper2.s_rel": Signal("mass2.displacement", -1.0, 4.0),
            "damper2.v_rel": Signal("mass2.speed", -1.0),
            "springDamper3.s_rel": Signal("mass3.displacement", -1.0, 4.0),
            "springDamper3.v_rel": Signal("mass3.speed", -1.0),
        },
    ),
    "ElastoGap": Example(
        elasto_gap,
        {
            "elastoGap1.v_rel": "mass2.speed",
            "elastoGap2.s_rel": Signal("mass2.displacement", -1.0, 2.0),
            "springDamper1.v_rel": "mass1.speed",
            "springDamper2.s_rel": Signal("mass1.displacement", -1.0, 2.0),
        },
    ),
    "GenerationOfFMUs": Example(
        generation_of_fmus,
        {
            "directMass.mass.s": "mass1a.displacement",
            "directMass.mass.v": "mass1a.speed",
            **_moving("mass2a", "mass2b", "mass3a", "mass3b"),
        },
    ),
    "InitialConditions": Example(
        initial_conditions,
        {
            "m1.s": "m1.displacement",
            "m1.v": "m1.speed",
            "m3.s": "m3.displacement",
            "m3.v": "m3.speed",
            "sd1.s_rel": Signal("sd1.extension", 1.0, -1.5),
            "sd2.s_rel": Signal("sd2.extension", 1.0, -4.0),
        },
    ),
    "Oscillator": Example(
        oscillator,
        {
            **_moving("mass1"),
            "damper1.s_rel": Signal("mass2.displacement", -1.0, 0.5),
            "damper1.v_rel": Signal("mass2.speed", -1.0),
        },
    ),
    "PreLoad": Example(
        preload,
        {
            "friction.v_rel": "spool.speed",
            "innerContactA.s_rel": Signal("inner_a.extension", 1.0, 0.10875),
            "innerContactB.s_rel": Signal("inner_b.extension", 1.0, -0.08125),
            "outerContactA.v_rel": "plate_a.speed",
            "outerContactB.s_rel": Signal("plate_b.displacement", -1.0, -0.066),
            "outerContactB.v_rel": Signal("plate_b.speed", -1.0),
        },
    ),
    "Sensors": Example(sensors, _moving("mass")),
    "SignConvention": Example(sign_convention, _moving("mass1", "mass2", "mass3")),
    "Vehicle": Example(vehicle, _moving("vehicle", "vehicle1", "trailer")),
    "WhyArrows": Example(
        why_arrows, {**_moving("mass1"), "inertia2.s": "mass2.displacement", "inertia2.v": "mass2.speed"}
    ),
}
"""By the name of the model."""
