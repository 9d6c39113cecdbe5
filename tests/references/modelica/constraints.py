"""Examples of Modelica.Mechanics.MultiBody.Examples.Constraints: a body on a joint, and one on constraints.

Here a joint is both: there is one body, and what is published of either is compared with it.
"""

from __future__ import annotations

from math import radians

from atwood import Component, Scene
from atwood_library import Ground, Pivot, PositionSensor, Slider, Spherical, Spring, Universal, Weld

from .building import WORLD, Example, bar, made, orientation, rotation

__all__ = ["EXAMPLES"]

TURNED = rotation("xyz", 10.0, 55.0, 68.0)


def _held(
    joints: dict[str, Component], joined: str, start: dict, more: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> Scene:
    """Return the body on a spring, on joints whose first frame is at `mount.b`."""
    return made(
        {
            "ground": Ground(),
            "mount": Weld(
                displacement=(0.2, -0.3, 0.2),
                turned_by="three angles",
                angles=(radians(10.0), radians(55.0), radians(68.0)),
            ),
            "far": Ground(position=(0.8, 0.0, 0.3)),
            "body": bar((0.4, 0.0, 0.0), 1.0, (0.2, 0.0, 0.0), 1.0, 1.0, 1.0),
            "arm": Weld(displacement=more),
            "spring": Spring(stiffness=20.0),
            "place": PositionSensor(),
            **joints,
        },
        "ground.frame - mount.a, body.a - place.point, body.b - arm.a, arm.b - spring.b, far.frame - spring.a\n"
        + joined,
        start,
        **WORLD,
    )


def prismatic() -> Scene:
    """Return the body on two guides."""
    return _held(
        {"x": Slider(axis=(1.0, 0.0, 0.0)), "y": Slider(axis=(0.0, 1.0, 0.0))},
        "mount.b - x.a, x.b - y.a, y.b - body.a",
        {f"{name}.{what}": 0.0 for name in "xy" for what in ("displacement", "speed")},
    )


def revolute() -> Scene:
    """Return the body on a hinge."""
    return _held(
        {"joint": Pivot(axis=(0.0, 1.0, 0.0))},
        "mount.b - joint.a, joint.b - body.a",
        {"joint.angle": 0.0, "joint.angular_velocity": 0.0},
    )


def spherical() -> Scene:
    """Return the body on a ball."""
    return _held(
        {"joint": Spherical()},
        "mount.b - joint.a, joint.b - body.a",
        {**orientation("body.solid", TURNED), **{f"body.solid.spin.{axis}": 0.0 for axis in "xyz"}},
    )


def universal() -> Scene:
    """Return the body on a universal joint."""
    return _held(
        {"joint": Universal(axis_a=(0.0, 0.0, 1.0), axis_b=(1.0, 0.0, 0.0))},
        "mount.b - joint.a, joint.b - body.a",
        {f"joint.{what}": 0.0 for what in ("angle_a", "angle_b", "rate_a", "rate_b")},
        (0.1, 0.15, 0.2),
    )


_SPIN = {f"bodyOfConstraint.body.w_a[{i}]": f"body.solid.spin.{axis}" for i, axis in enumerate("xyz", 1)}

EXAMPLES = {
    "PrismaticConstraint": Example(
        prismatic,
        {
            **{f"bodyOfConstraint.r_0[{i}]": f"place.position.{axis}" for i, axis in enumerate("xyz", 1)},
            **{f"bodyOfConstraint.v_0[{i}]": f"place.velocity.{axis}" for i, axis in enumerate("xyz", 1)},
            **{f"jointPrismatic_{name}.s": f"{name}.displacement" for name in "xy"},
            **{f"jointPrismatic_{name}.v": f"{name}.speed" for name in "xy"},
        },
    ),
    "RevoluteConstraint": Example(
        revolute, {**_SPIN, "bodyOfJoint.body.w_a[2]": "body.solid.spin.y", "joint.phi": "joint.angle"}
    ),
    "SphericalConstraint": Example(spherical, _SPIN),
    "UniversalConstraint": Example(
        universal,
        {
            **_SPIN,
            "joint.phi_a": "joint.angle_a",
            "joint.phi_b": "joint.angle_b",
            "joint.w_a": "joint.rate_a",
            "joint.w_b": "joint.rate_b",
        },
    ),
}
"""By the name of the model."""
