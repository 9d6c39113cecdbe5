"""Examples of Modelica.Mechanics.MultiBody.Examples.Elementary."""

from __future__ import annotations

from collections.abc import Callable
from math import pi, sqrt

from atwood import (
    Scalar,
    Scene,
    cos,
    exp,
    sin,
)
from atwood_library import (
    Drive,
    Force,
    Ground,
    OrientationSensor,
    Pivot,
    Planar,
    PointMass,
    PositionSensor,
    Potential,
    RigidBody,
    RollingDisc,
    Sine,
    Spring,
    Table,
    Torque,
    Weld,
)

from .building import WORLD, Example, bar, box, cylinder, hinges, made, orientation, rotation, vector

__all__ = ["EXAMPLES", "filtered_sine"]

Z = (0.0, 0.0, 1.0)


def double_pendulum() -> Scene:
    """Return a double pendulum of two boxes with a damper."""
    return made(
        {
            "ground": Ground(),
            "revolute1": Pivot(axis=Z, damping=0.1),
            "box1": box((0.5, 0.0, 0.0), 0.06),
            "revolute2": Pivot(axis=Z),
            "box2": box((0.5, 0.0, 0.0), 0.06),
            "tip": PositionSensor(),
        },
        """ground.frame - revolute1.a, revolute1.b - box1.a, box1.b - revolute2.a, revolute2.b - box2.a
        box2.b - tip.point""",
        {f"revolute{n}.{what}": 0.0 for n in (1, 2) for what in ("angle", "angular_velocity")},
        **WORLD,
    )


def double_pendulum_init_tip() -> Scene:
    """Return the double pendulum with its tip at rest at a given place."""
    scene = double_pendulum()
    scene.start = {"tip.position.x": 0.7, "tip.position.y": 0.3, "tip.velocity.x": 0.0, "tip.velocity.y": 0.0}
    scene.guess = {"revolute2.angle": pi / 2.0}
    return scene


def force_and_torque() -> Scene:
    """Return a rod on two hinges, with a force and a torque at its end that are given in a turned frame."""
    return made(
        {
            "ground": Ground(position=(0.0, -0.5, 0.0)),
            "turned": Weld(angle=pi / 6.0, axis=Z),
            "revolute1": Pivot(axis=Z),
            "revolute2": Pivot(axis=(0.0, 1.0, 0.0)),
            "body": cylinder((1.0, 0.0, 0.0)),
            "force": Force(direction=(0.0, 1.0, 0.0), value=1000.0, resolved_in="other"),
            "torque": Torque(axis=(-1.0, 1.0, 0.0), value=100.0 * sqrt(2.0), resolved_in="other"),
        },
        """ground.frame - revolute1.a - turned.a, revolute1.b - revolute2.a, revolute2.b - body.a
        body.b - force.point - torque.frame, turned.b - force.other - torque.other""",
        {f"revolute{n}.{what}": 0.0 for n in (1, 2) for what in ("angle", "angular_velocity")},
        **WORLD,
    )


def pendulum() -> Scene:
    """Return a damped pendulum."""
    return made(
        {
            "ground": Ground(),
            "rev": Pivot(axis=Z, damping=0.1),
            "body": bar((0.5, 0.0, 0.0), 1.0, (0.5, 0.0, 0.0)),
        },
        "ground.frame - rev.a, rev.b - body.a",
        {"rev.angle": 0.0, "rev.angular_velocity": 0.0},
        **WORLD,
    )


_POINT_GRAVITY = {"space": "space", "gravity": 0.0, "gravity_potential": "-1/sqrt(x**2 + y**2 + z**2)"}


def point_gravity() -> Scene:
    """Return two bodies that a point attracts."""
    return made(
        {f"body{n}": RigidBody(moments=(0.1, 0.1, 0.1)) for n in (1, 2)},
        "",
        {
            "body1.position.x": 0.0, "body1.position.y": 0.6, "body1.position.z": 0.0,
            "body1.velocity.x": 1.0, "body1.velocity.y": 0.0, "body1.velocity.z": 0.0,
            "body2.position.x": 0.6, "body2.position.y": 0.6, "body2.position.z": 0.0,
            "body2.velocity.x": 0.6, "body2.velocity.y": 0.0, "body2.velocity.z": 0.0,
            **{f"body{n}.spin.{axis}": 0.0 for n in (1, 2) for axis in "xyz"},
            **orientation("body1", rotation("")), **orientation("body2", rotation("")),
        },
        **_POINT_GRAVITY,
    )  # fmt: skip


def point_gravity_with_point_masses() -> Scene:
    """Return four points that another attracts, two of them joined by a spring."""
    places = {1: (0.0, 0.6, 1.0), 2: (0.6, 0.6, 0.6), 3: (0.0, 0.8, 0.6), 4: (0.3, 0.8, 0.6)}
    start = {}
    for n, (x, y, speed) in places.items():
        start |= {f"body{n}.position.{axis}": value for axis, value in zip("xyz", (x, y, 0.0), strict=True)}
        start |= {f"body{n}.velocity.{axis}": value for axis, value in zip("xyz", (speed, 0.0, 0.0), strict=True)}
    return made(
        {**{f"body{n}": PointMass() for n in places}, "spring": Spring(stiffness=10.0)},
        "body3.point - spring.a, body4.point - spring.b",
        start,
        **_POINT_GRAVITY,
    )


def point_gravity_with_point_masses_2() -> Scene:
    """Return six points at the ends of a rigid cross, each of them attracted by another."""
    ways = [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]
    parts = {"hub": RigidBody(mass=0.0)}
    joined = []
    for n, way in enumerate(ways, 1):
        parts |= {
            f"rod{n}": Weld(displacement=way),
            f"mass{n}": PointMass(),
            f"pull{n}": Potential(energy_function="-5/sqrt(x**2 + y**2 + z**2)"),
        }
        joined += [f"hub.frame - rod{n}.a, rod{n}.b - mass{n}.point - pull{n}.point"]
    start = {"hub.position.x": 2.0, "hub.velocity.z": -1.0, **{f"hub.spin.{axis}": 0.0 for axis in "xyz"}}
    start |= {"hub.position.y": 0.0, "hub.position.z": 0.0, "hub.velocity.x": 0.0, "hub.velocity.y": 0.0}
    return made(parts, "\n".join(joined), start | orientation("hub", rotation("")), space="space", gravity=0.0)


def rolling_wheel() -> Scene:
    """Return a wheel that rolls on a plane."""
    return made(
        {
            "ground": Ground(),
            "wheel": RigidBody(mass=2.0, moments=(0.12, 0.06, 0.12)),
            "contact": RollingDisc(radius=0.3),
            "angles": OrientationSensor(convention="zyx"),
        },
        "ground.frame - contact.a - angles.a, wheel.frame - contact.b - angles.b",
        {
            "wheel.position.x": 0.2, "wheel.position.y": 0.2, **orientation("wheel", rotation("")),
            "wheel.spin.x": 1.0, "wheel.spin.y": 5.0, "wheel.spin.z": 0.0,
        },
        space="space",
        gravity=9.80665,
    )  # fmt: skip


def _wheel_set(drive: dict, joined: str) -> Scene:
    """Return two wheels on an axle that stays level, with a body before it."""
    parts = {
        "ground": Ground(),
        "table": Ground(position=(0.0, 0.0, 0.1)),
        "plate": Planar(axis=Z),
        "axle": RigidBody(mass=0.0),
        "ahead": Weld(displacement=(0.2, 0.0, 0.0)),
        "body": RigidBody(mass=0.01, moments=(1e-3, 1e-3, 1e-3)),
    }
    text = "table.frame - plate.a, plate.b - axle.frame - ahead.a, ahead.b - body.frame\n" + joined
    for n, y in ((1, 0.25), (2, -0.25)):
        parts |= {
            f"side{n}": Weld(displacement=(0.0, y, 0.0)),
            f"bearing{n}": Pivot(axis=(0.0, 1.0, 0.0)),
            f"wheel{n}": RigidBody(mass=0.5, moments=(0.02, 0.01, 0.02)),
            f"contact{n}": RollingDisc(radius=0.1),
        }
        text += f"""
        axle.frame - side{n}.a, side{n}.b - bearing{n}.a, bearing{n}.b - wheel{n}.frame - contact{n}.b
        ground.frame - contact{n}.a"""
    start = {"axle.position.x": 0.1, "axle.position.y": 0.1, "plate.angle": 0.0}
    start |= {f"bearing{n}.{what}": 0.0 for n in (1, 2) for what in ("angle", "angular_velocity")}
    return made(parts | drive, text, start, space="space", gravity=9.80665)


def rolling_wheel_set_driving() -> Scene:
    """Return a set of wheels that a torque on each drives; Torque2 of Modelica turns its flange a backwards."""
    drive = {
        "sine1": Sine(amplitude=-2.0, angular_frequency=2.0 * pi),
        "sine2": Sine(amplitude=-2.0, angular_frequency=2.0 * pi, phase=pi / 2.0),
    }
    return _wheel_set(drive, "sine1.value > bearing1.motor, sine2.value > bearing2.motor")


def rolling_wheel_set_pulling() -> Scene:
    """Return a set of wheels that a force ahead of it pulls."""
    drive = {
        "force_x": Force(direction=(1.0, 0.0, 0.0)),
        "force_y": Force(direction=(0.0, 1.0, 0.0)),
        "table_x": Table(table=[(0.0, 1.0), (1.0, 1.0), (2.0, 0.0), (3.0, 0.0)]),
        "table_y": Table(table=[(0.0, 0.0), (1.0, 0.0), (2.0, 2.0), (3.0, 2.0)]),
    }
    return _wheel_set(
        drive,
        """ahead.b - force_x.point - force_y.point
        table_x.value > force_x.value, table_y.value > force_y.value""",
    )


def surfaces() -> Scene:
    """Return a guide whose displacement follows a filtered signal."""
    return made(
        {
            "ground": Ground(),
            "body": RigidBody(),
            "prismatic": Drive(motion=filtered_sine(2.0, 0.5)),
            "place": PositionSensor(),
        },
        "ground.frame - prismatic.a, prismatic.b - body.frame - place.point",
        None,
        **WORLD,
    )


def filtered_sine(amplitude: float, frequency: float) -> Callable[[Scalar], Scalar]:
    """Return what the filter in Modelica's sources of position makes of a sine, as a function of time.

    It begins at the sine's value, at rest: ``y'' = ((u - y) w_c - a y') w_c/b`` with 50 Hz, a = 1.3617, b = 0.6180.
    """
    critical, af, bf, w = 2.0 * pi * 50.0, 1.3617, 0.6180, 2.0 * pi * frequency
    decay, square = af * critical / (2.0 * bf), critical**2 / bf
    fast = sqrt(square - decay**2)
    p, q = square - w**2, 2.0 * decay * w
    along, across = amplitude * square * p / (p * p + q * q), -amplitude * square * q / (p * p + q * q)
    sine = (-w * along - decay * across) / fast

    def value(t: Scalar) -> Scalar:
        left = exp(-decay * t) * (-across * cos(fast * t) + sine * sin(fast * t))
        return along * sin(w * t) + across * cos(w * t) + left

    return value


def user_defined_gravity_field() -> Scene:
    """Return a pendulum in the normal gravity of the earth's ellipsoid at the equator."""
    a, b, g_e = 6378137.0, 6356752.3142, 9.7803253359
    m = 7292115e-11**2 * a**2 * b / 3986004.418e8
    f = 1.0 / 298.257223563
    return made(
        {
            "ground": Ground(position=(0.0, 20.0, 0.0)),
            "rev": Pivot(axis=Z, damping=0.1),
            "body": bar((10.0, 0.0, 0.0), 1000.0, (10.0, 0.0, 0.0)),
        },
        "ground.frame - rev.a, rev.b - body.a",
        {"rev.angle": 0.0, "rev.angular_velocity": 0.0},
        space="space",
        gravity=0.0,
        gravity_potential=f"{g_e}*(y - {1.0 + f + m}*y**2/{a} - (y/{a})**2*y)",
    )


_WHEEL_SET = {
    "wheelSet.der_theta1": "bearing1.angular_velocity",
    "wheelSet.der_theta2": "bearing2.angular_velocity",
    "wheelSet.phi": "plate.angle",
    "wheelSet.theta1": "bearing1.angle",
    "wheelSet.theta2": "bearing2.angle",
    "wheelSet.x": "axle.position.x",
    "wheelSet.y": "axle.position.y",
}

EXAMPLES = {
    "DoublePendulum": Example(double_pendulum, hinges("revolute1", "revolute2")),
    "DoublePendulumInitTip": Example(double_pendulum_init_tip, hinges("revolute1", "revolute2")),
    "ForceAndTorque": Example(force_and_torque, hinges("revolute1", "revolute2")),
    "Pendulum": Example(pendulum, hinges("rev")),
    "PointGravity": Example(
        point_gravity,
        {
            name: path
            for n in (1, 2)
            for theirs, ours in (("frame_a.r_0", "position"), ("v_0", "velocity"), ("w_a", "spin"))
            for name, path in vector(f"body{n}.{theirs}", f"body{n}.{ours}").items()
        },
    ),
    "PointGravityWithPointMasses": Example(
        point_gravity_with_point_masses,
        {
            name: path
            for n in (1, 2, 3, 4)
            for theirs, ours in (("r_0", "position"), ("v_0", "velocity"))
            for name, path in vector(f"body{n}.{theirs}", f"body{n}.{ours}").items()
        },
    ),
    "PointGravityWithPointMasses2": Example(
        point_gravity_with_point_masses_2,
        {
            **vector("freeMotion.r_rel_a", "hub.position"),
            **vector("freeMotion.v_rel_a", "hub.velocity"),
            **vector("referenceSystem.pointMass1.w_a", "hub.spin"),
            "referenceSystem.pointMass3.v_0[1]": "mass3.velocity.x",
            **vector("referenceSystem.pointMass6.frame_a.r_0", "mass6.position"),
            "referenceSystem.pointMass6.v_0[2]": "mass6.velocity.y",
            "referenceSystem.pointMass6.v_0[3]": "mass6.velocity.z",
        },
    ),
    "RollingWheel": Example(
        rolling_wheel,
        {
            **{f"wheel1.angles[{n}]": f"angles.angle_{n}" for n in (1, 2, 3)},
            **{f"wheel1.der_angles[{n}]": f"angles.rate_{n}" for n in (1, 2, 3)},
            "wheel1.x": "wheel.position.x",
            "wheel1.y": "wheel.position.y",
        },
    ),
    "RollingWheelSetDriving": Example(rolling_wheel_set_driving, _WHEEL_SET),
    "RollingWheelSetPulling": Example(rolling_wheel_set_pulling, _WHEEL_SET),
    "Surfaces": Example(surfaces, {"prismatic.s": "place.position.x", "prismatic.v": "place.velocity.x"}),
    "UserDefinedGravityField": Example(user_defined_gravity_field, hinges("rev")),
}
"""By the name of the model."""
