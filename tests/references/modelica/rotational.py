"""Examples of Modelica.Mechanics.Rotational."""

from __future__ import annotations

from math import pi

from atwood import Scene
from atwood_library import (
    Gear,
    Inertia,
    Mass1D,
    RackAndPinion,
    Ramp,
    RotationalCoupling,
    RotationalGap,
    RotationalResistance,
    RotationalSource,
    RotationalSpringDamper,
    Sine,
    Step,
    TranslationalResistance,
)

from .building import Example, Signal, made

__all__ = ["EXAMPLES", "compare_braking_torque"]


def first() -> Scene:
    """Return a drive train: a motor, a gear with a bearing, a spring and a load."""
    return made(
        {
            "motor": Inertia(moment=0.1),
            "wheel": Inertia(moment=2.0),
            "load": Inertia(moment=2.0),
            "gear": Gear(ratio=10.0),
            "spring": RotationalSpringDamper(stiffness=1e4),
            "bearing": RotationalSpringDamper(damping=10.0, against="ground"),
            "torque": RotationalSource(),
            "sine": Sine(amplitude=10.0, angular_frequency=10.0 * pi),
        },
        """
        motor.flange - torque.b - gear.a, wheel.flange - gear.b - spring.a - bearing.b, load.flange - spring.b
        sine.value > torque.value
        """,
        {"wheel.angle": 0.0, "wheel.angular_velocity": 0.0, "spring.extension": 0.0, "load.angular_velocity": 0.0},
        gravity=0.0,
    )


def backlash() -> Scene:
    """Return a rotor without play, and one with it."""
    return made(
        {
            "stiff_rotor": Inertia(moment=5.0),
            "play_rotor": Inertia(moment=5.0),
            "stiff": RotationalSpringDamper(stiffness=20e3, damping=50.0, against="ground"),
            "play": RotationalGap(stiffness=20e3, damping=50.0, lower=-pi / 8.0, upper=pi / 8.0, against="ground"),
        },
        "stiff_rotor.flange - stiff.b, play_rotor.flange - play.b",
        {
            "stiff_rotor.angle": pi / 2.0, "stiff_rotor.angular_velocity": 0.0,
            "play_rotor.angle": pi / 2.0, "play_rotor.angular_velocity": 0.0,
        },
        gravity=0.0,
    )  # fmt: skip


def compare_braking_torque() -> Scene:
    """Return four rotors that are slowed down, each by another law."""
    laws = {
        "sign": {"constant": 100.0, "smooth_below": 1.0},
        "linear": {"linear": 1.0},
        "quadratic": {"quadratic": 0.01},
        "inverse": {"power": 1e4, "smooth_below": 1.0},
    }
    parts = {name: Inertia() for name in laws} | {
        f"{name}_brake": RotationalResistance(**law) for name, law in laws.items()
    }
    start = {f"{name}.{what}": value for name in laws for what, value in (("angle", 0.0), ("angular_velocity", 100.0))}
    return made(parts, ", ".join(f"{name}.flange - {name}_brake.b" for name in laws), start, gravity=0.0)


def elastic_bearing() -> Scene:
    """Return a gear whose housing gives."""
    return made(
        {
            "shaft": Inertia(moment=1.0),
            "load": Inertia(moment=50.0),
            "housing": Inertia(moment=5.0),
            # The last of the three on the gear is eliminated, and the housing turns little where the others turn far.
            "wheel": Inertia(moment=0.0),
            "gear": Gear(ratio=3.0, support="flange"),
            "spring": RotationalSpringDamper(stiffness=1e3),
            "bearing": RotationalSpringDamper(stiffness=1e5, damping=5.0, against="ground"),
            "torque": RotationalSource(),
            "ramp": Ramp(slope=20.0, start_time=0.0, duration=5.0),
        },
        """
        shaft.flange - torque.b - gear.a, wheel.flange - gear.b - spring.a, load.flange - spring.b
        housing.flange - gear.housing - bearing.b, ramp.value > torque.value
        """,
        {
            "shaft.angle": 0.0, "shaft.angular_velocity": 0.0, "load.angular_velocity": 0.0, "spring.extension": 0.0,
            "housing.angle": 0.0, "housing.angular_velocity": 0.0,
        },
        gravity=0.0,
    )  # fmt: skip


def generation_of_fmus() -> Scene:
    """Return two rotors joined rigidly, by a spring and a damper, and by a spring, each pair driven alike."""
    moments = {"1a": 1.1, "1b": 2.2, "2a": 1.1, "2b": 2.2, "3a": 1.1, "3b": 2.2}
    parts = {
        **{f"inertia{name}": Inertia(moment=moment) for name, moment in moments.items()},
        **{f"torque{n}": RotationalSource() for n in (1, 2, 3)},
        "rigid": RotationalCoupling(),
        "damped": RotationalSpringDamper(stiffness=1e4, damping=100.0),
        "spring": RotationalSpringDamper(stiffness=1e4),
        "sine": Sine(amplitude=10.0, angular_frequency=4.0 * pi),
    }
    joined = """
    inertia1a.flange - torque1.b - rigid.a, inertia1b.flange - rigid.b
    inertia2a.flange - torque2.b - damped.a, inertia2b.flange - damped.b
    inertia3a.flange - torque3.b - spring.a, inertia3b.flange - spring.b
    sine.value > torque1.value, sine.value > torque2.value, sine.value > torque3.value
    """
    paths = ["inertia1a", "inertia2a", "inertia2b", "inertia3a", "inertia3b"]
    start = {f"{path}.{what}": 0.0 for path in paths for what in ("angle", "angular_velocity")}
    return made(parts, joined, start, gravity=0.0)


def rolling_wheel() -> Scene:
    """Return a wheel that drives a mass against the square of its speed."""
    return made(
        {
            "inertia": Inertia(moment=1.0),
            "mass": Mass1D(mass=1.0),
            "wheel": RackAndPinion(radius=1.0),
            "drag": TranslationalResistance(quadratic=0.4),
            "torque": RotationalSource(),
            "step": Step(height=10.0, start_time=0.1),
        },
        """
        inertia.flange - wheel.pinion - torque.b, mass.slide - wheel.rack - drag.b
        step.value > torque.value
        """,
        {"inertia.angle": 0.0, "inertia.angular_velocity": 0.0},
        gravity=0.0,
    )


def _turning(*names: str) -> dict[str, str]:
    """Return the signals of rotors that have the same names here."""
    return {
        f"{name}.{m}": f"{name}.{ours}" for name in names for m, ours in (("phi", "angle"), ("w", "angular_velocity"))
    }


_FIRST = Example(
    first,
    {
        "damper.phi_rel": Signal("wheel.angle", -1.0),
        "damper.w_rel": Signal("wheel.angular_velocity", -1.0),
        "inertia3.phi": "load.angle",
        "inertia3.w": "load.angular_velocity",
    },
)

EXAMPLES = {
    "Backlash": Example(
        backlash,
        {
            "elastoBacklash.phi_rel": "play_rotor.angle",
            "elastoBacklash.w_rel": "play_rotor.angular_velocity",
            "springDamper.phi_rel": "stiff_rotor.angle",
            "springDamper.w_rel": "stiff_rotor.angular_velocity",
        },
    ),
    "ElasticBearing": Example(
        elastic_bearing,
        {
            **_turning("load", "shaft"),
            "springDamper.phi_rel": "housing.angle",
            "springDamper.w_rel": "housing.angular_velocity",
        },
        {"atol": 1e-13},  # the housing turns by a millionth of what the shaft does; Modelica says a nominal value
    ),
    "First": _FIRST,
    "FirstGrounded": _FIRST,
    "GenerationOfFMUs": Example(
        generation_of_fmus,
        {
            "directInertia.inertia.phi": "inertia1a.angle",
            "directInertia.inertia.w": "inertia1a.angular_velocity",
            **_turning("inertia2a", "inertia2b", "inertia3a", "inertia3b"),
        },
    ),
    "RollingWheel": Example(rolling_wheel, _turning("inertia")),
}
"""By the name of the model."""
