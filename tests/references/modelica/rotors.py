"""Examples of Modelica.Mechanics.MultiBody.Examples.Rotational3DEffects."""

from __future__ import annotations

from math import pi

from atwood import Scene
from atwood_library import (
    Gear,
    Ground,
    Inertia,
    Pivot,
    RigidBody,
    RotaryDrive,
    RotationalSource,
    Rotor,
    Sine,
    Spherical,
    Torque,
    Weld,
)

from .building import WORLD, Example, cylinder, made, moments, orientation, rotation
from .elementary import filtered_sine

__all__ = ["EXAMPLES"]

X = (1.0, 0.0, 0.0)
WEIGHTLESS = {**WORLD, "gravity": 0.0}


def actuated_drive() -> Scene:
    """Return a body and a rotor that are driven alike."""
    return made(
        {
            "ground": Ground(),
            "revolute": Pivot(axis=X),
            "body": RigidBody(mass=0.0, moments=(2.0, 1.0, 1.0)),
            "torque": Torque(axis=X, reacts_on="other"),
            "rotor": Rotor(moment=2.0, axis=X),
            "turning": RigidBody(mass=0.0),
            "motor": RotationalSource(),
            "sine": Sine(angular_frequency=2.0 * pi),
        },
        """ground.frame - revolute.a - torque.other, revolute.b - body.frame - torque.frame
        ground.frame - rotor.a, rotor.b - turning.frame, rotor.shaft - motor.b
        sine.value > torque.value, sine.value > motor.value""",
        {f"{name}.{what}": 0.0 for name in ("revolute", "rotor") for what in ("angle", "angular_velocity")},
        **WEIGHTLESS,
    )


def gear_constraint() -> Scene:
    """Return two shafts with a gear between them, as bodies and as rotors."""
    shafts = {1: cylinder((0.4, 0.0, 0.0), 0.1), 2: cylinder((0.4, 0.0, 0.0), 0.2)}
    return made(
        {
            "ground": Ground(),
            "hinge1": Pivot(axis=X),
            "hinge2": Pivot(axis=X),
            "shaft1": shafts[1],
            "shaft2": shafts[2],
            "gear": Gear(ratio=10.0),
            "torque": Torque(axis=X),
            "rotor1": Inertia(moment=moments(shafts[1])[0], axis=X),
            "rotor2": Inertia(moment=moments(shafts[2])[0], axis=X),
            "plain_gear": Gear(ratio=10.0),
            "motor": RotationalSource(),
            "sine": Sine(amplitude=2.0, angular_frequency=2.0 * pi),
        },
        """ground.frame - hinge1.a - hinge2.a, hinge1.b - shaft1.b, hinge2.b - shaft2.a
        hinge1.shaft - gear.a, hinge2.shaft - gear.b, shaft1.a - torque.frame
        rotor1.flange - plain_gear.a - motor.b, rotor2.flange - plain_gear.b
        sine.value > torque.value, sine.value > motor.value""",
        {f"{name}.{what}": 0.0 for name in ("hinge2", "rotor2") for what in ("angle", "angular_velocity")},
        **WEIGHTLESS,
    )


def gyroscopic_effects() -> Scene:
    """Return a rod on a ball with a cylinder that spins at its end; and one with a rotor in a housing.

    The housing has what the cylinder has across its axis, and nothing about it, which Modelica counts there, too.
    """
    spun = cylinder((0.2, 0.0, 0.0), 0.1)
    axial, across, _ = moments(spun)
    return made(
        {
            "ground": Ground(),
            "ball": Spherical(),
            "rod": cylinder((0.25, 0.0, 0.0), 0.05),
            "bend": Weld(angle=pi / 4.0, axis=(0.0, 1.0, 0.0)),
            "revolute": Pivot(axis=X),
            "back": Weld(displacement=(-0.1, 0.0, 0.0)),
            "cylinder": spun,
            "ball2": Spherical(),
            "rod2": cylinder((0.25, 0.0, 0.0), 0.05),
            "bend2": Weld(angle=pi / 4.0, axis=(0.0, 1.0, 0.0)),
            "housing": RigidBody(mass=spun.total_mass(), moments=(0.0, across, across)),
            "rotor": Rotor(moment=axial, axis=X),
            "turning": RigidBody(mass=0.0),
        },
        """ground.frame - ball.a, ball.b - rod.a, rod.b - bend.a, bend.b - revolute.a, revolute.b - back.a
        back.b - cylinder.a
        ground.frame - ball2.a, ball2.b - rod2.a, rod2.b - bend2.a, bend2.b - housing.frame - rotor.a
        rotor.b - turning.frame""",
        {
            **orientation("rod", rotation("")) | orientation("rod2", rotation("")),
            **{f"{name}.spin.{axis}": 0.0 for name in ("rod", "rod2") for axis in "xyz"},
            "revolute.angle": 0.0, "revolute.angular_velocity": 10.0,
            "rotor.angle": 0.0, "rotor.angular_velocity": 10.0,
        },
        **WORLD,
    )  # fmt: skip


def moving_actuated_drive() -> Scene:
    """Return a body that turns on a hinge, which is itself turned to and fro across its axis."""
    return made(
        {
            "ground": Ground(),
            "r1": RotaryDrive(axis=(0.0, 1.0, 0.0), rotation=filtered_sine(2.0, 1.0)),
            "carrier": RigidBody(mass=0.0),
            "revolute": Pivot(axis=X),
            "body": RigidBody(mass=0.0, moments=(2.0, 1.0, 1.0)),
            "torque": Torque(axis=X, resolved_in="other", reacts_on="other"),
            "r2": RotaryDrive(axis=(0.0, 1.0, 0.0), rotation=filtered_sine(2.0, 1.0)),
            "mount": RigidBody(mass=0.0),
            "rotor": Rotor(moment=2.0, axis=X),
            "turning": RigidBody(mass=0.0),
            "motor": RotationalSource(),
            "sine": Sine(angular_frequency=2.0 * pi),
        },
        """ground.frame - r1.a - r2.a, r1.b - carrier.frame - revolute.a - torque.other
        revolute.b - body.frame - torque.frame, sine.value > torque.value
        r2.b - mount.frame - rotor.a, rotor.b - turning.frame, rotor.shaft - motor.b, sine.value > motor.value""",
        {f"{name}.{what}": 0.0 for name in ("revolute", "rotor") for what in ("angle", "angular_velocity")},
        **WEIGHTLESS,
    )


def _turning(theirs: str, ours: str) -> dict[str, str]:
    """Return angle and rate."""
    return {f"{theirs}.phi": f"{ours}.angle", f"{theirs}.w": f"{ours}.angular_velocity"}


EXAMPLES = {
    "ActuatedDrive": Example(actuated_drive, _turning("revolute", "revolute") | _turning("rotor1D", "rotor")),
    "GearConstraint": Example(
        gear_constraint, _turning("gearConstraint.actuatedRevolute_b", "hinge2") | _turning("inertia2", "rotor2")
    ),
    "GyroscopicEffects": Example(
        gyroscopic_effects,
        {
            **{f"bodyCylinder2.body.w_a[{i}]": f"cylinder.spin.{axis}" for i, axis in enumerate("xyz", 1)},
            **{f"bodyCylinder3.body.w_a[{i}]": f"rod2.spin.{axis}" for i, axis in enumerate("xyz", 1)},
            **_turning("revolute", "revolute"),
            **_turning("rotor1D", "rotor"),
        },
    ),
    "MovingActuatedDrive": Example(
        moving_actuated_drive,
        {
            "position1.w": "carrier.spin.y",
            "position2.w": "mount.spin.y",
            "r1.phi": "r1.angle",
            "r2.phi": "r2.angle",
            **_turning("revolute", "revolute"),
            **_turning("rotor1D", "rotor"),
        },
    ),
}
"""By the name of the model."""
