"""Examples of Modelica.Mechanics.MultiBody.Examples.Elementary."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import pi, sqrt

import numpy as np
from scipy.optimize import root

from atwood import (
    Component,
    Load,
    Point,
    Scalar,
    Scene,
    Vector,
    as_vector,
    connector,
    cos,
    derivative,
    dot,
    exp,
    force,
    norm,
    parameter,
    sin,
    solve_linear,
    state,
)
from atwood_library import (
    Damper,
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
    Slider,
    Spherical,
    Spring,
    Table,
    Torque,
    Universal,
    Weld,
)

from .building import WORLD, Example, bar, box, cylinder, made, orientation, rotation

__all__ = ["EXAMPLES", "filtered_sine"]

Z = (0.0, 0.0, 1.0)


class Knot(Component):
    """Three springs from points to a knot without mass, where their forces balance at any time.

    The knot moves with the ends so that the balance stays: ``sum K_i (v_i - v) = 0`` with the matrix of a spring
    ``K = k e e + T/l (1 - e e)``, direction e, tension T and length l.
    """

    stiffness: tuple[float, float, float] = parameter((1.0, 1.0, 1.0), unit="N/m", size=3, doc="Of each spring.")
    natural_length: float = parameter(0.1, unit="m", minimum=0.0, doc="Of all springs.")
    a: Point = connector(Point, "The end of the first spring.")
    b: Point = connector(Point, "The end of the second spring.")
    c: Point = connector(Point, "The end of the third spring.")
    x: Scalar = state(0.0, unit="m", doc="Place of the knot.")
    y: Scalar = state(0.0, unit="m", doc="Place of the knot.")
    z: Scalar = state(0.0, unit="m", doc="Place of the knot.")

    def springs(self) -> list[tuple[Point, Vector, Scalar, Scalar, Scalar]]:
        """Return ends, directions to them, lengths, stiffnesses and tensions."""
        knot, found = Vector(self.x, self.y, self.z), []
        k = as_vector(self.stiffness)
        for end, stiffness in ((self.a, k.x), (self.b, k.y), (self.c, k.z)):
            way = end.position - knot
            length = norm(way)
            found.append((end, way / length, length, stiffness, stiffness * (length - self.natural_length)))
        return found

    @derivative("x", "y", "z")
    def rates(self) -> tuple[Scalar, Scalar, Scalar]:
        """Return the velocity of the knot."""
        matrix: list[list[Scalar]] = [[0.0] * 3 for _ in range(3)]
        right: list[Scalar] = [0.0] * 3
        for end, e, length, stiffness, tension in self.springs():
            across = tension / length
            pulled = end.velocity * across + e * ((stiffness - across) * dot(e, end.velocity))
            for i, one in enumerate(e):
                right[i] = right[i] + list(pulled)[i]
                for j, other in enumerate(e):
                    matrix[i][j] = matrix[i][j] + (stiffness - across) * one * other + (across if i == j else 0.0)
        x, y, z = solve_linear(matrix, right)
        return x, y, z

    @force
    def pull(self) -> Iterable[Load]:
        """Return what the springs pull their ends with."""
        for end, e, _, _, tension in self.springs():
            yield Load(end, e * -tension)


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


def free_body() -> Scene:
    """Return a body on two springs."""
    start = {"place.position.x": 0.2, "place.position.y": -0.5, "place.position.z": 0.1}
    start |= {f"{what}.{axis}": 0.0 for what in ("place.velocity", "body.solid.spin") for axis in "xyz"}
    return made(
        {
            "ground": Ground(),
            "far": Ground(position=(0.8, 0.0, 0.0)),
            "spring1": Spring(stiffness=20.0),
            "spring2": Spring(stiffness=20.0),
            "body": bar((0.4, 0.0, 0.0), 1.0, (0.2, 0.0, 0.0), 1.0, 1.0, 1.0),
            "place": PositionSensor(),
        },
        "ground.frame - spring1.a, spring1.b - body.a - place.point, far.frame - spring2.a, body.b - spring2.b",
        start | orientation("body.solid", rotation("xyz", 10.0, 10.0, 10.0)),
        **WORLD,
    )


def init_spring_constant() -> Scene:
    """Return a pendulum that a spring holds level: its stiffness is half the weight over its extension."""
    return made(
        {
            "ground": Ground(),
            "above": Ground(position=(1.0, 0.2, 0.0)),
            "rev": Pivot(axis=Z, damping=0.1),
            "body": bar((1.0, 0.0, 0.0), 1.0, (0.5, 0.0, 0.0)),
            "spring": Spring(stiffness=0.5 * WORLD["gravity"] / 0.1, natural_length=0.1),
        },
        "ground.frame - rev.a, rev.b - body.a, above.frame - spring.a, body.b - spring.b",
        {"rev.angle": 0.0, "rev.angular_velocity": 0.0},
        **WORLD,
    )


def line_force_with_two_masses() -> Scene:
    """Return two boxes on hinges, each held by a damper with a mass near either end of it.

    The masses are bodies on a universal joint and on a ball, with a guide between them that has the damper.
    """
    toward = np.array([0.7, 1.2, 0.0]) / np.hypot(0.7, 1.2)
    parts: dict[str, Component] = {}
    joined, start = "", {}
    for n, z in ((1, 0.0), (2, 0.3)):
        parts |= {
            f"above{n}": Ground(position=(0.0, 0.3, z)),
            f"below{n}": Ground(position=(0.0, -0.9, z)),
            f"revolute{n}": Pivot(axis=Z),
            f"box{n}": box((0.7, 0.0, 0.0)),
            f"universal{n}": Universal(axis_a=(0.0, 0.0, 1.0), axis_b=(toward[1], -toward[0], 0.0)),
            f"lower{n}": RigidBody(mass=1.0, center=tuple(0.2 * toward)),
            f"guide{n}": Slider(axis=tuple(toward), damping=3.0),
            f"upper{n}": RigidBody(mass=1.0, center=tuple(-0.2 * toward)),
            f"ball{n}": Spherical(),
        }
        joined += f"""
        above{n}.frame - revolute{n}.a, revolute{n}.b - box{n}.a, box{n}.b - ball{n}.b
        below{n}.frame - universal{n}.a, universal{n}.b - lower{n}.frame - guide{n}.a
        guide{n}.b - upper{n}.frame - ball{n}.a"""
        start |= {f"revolute{n}.angle": 0.0, f"revolute{n}.angular_velocity": 0.0}
    return made(parts, joined, start, **WORLD)


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


def pendulum_with_spring_damper() -> Scene:
    """Return a body on a guide that turns, with a spring and a damper to its hinge."""
    return made(
        {
            "ground": Ground(position=(0.3, 0.0, 0.0)),
            "revolute": Pivot(axis=Z),
            "prismatic": Slider(axis=(1.0, 0.0, 0.0)),
            "body": RigidBody(moments=(1.0, 1.0, 1.0)),
            "spring": Spring(stiffness=20.0, natural_length=0.2),
            "damper": Damper(damping=1.0),
        },
        """ground.frame - revolute.a - spring.a - damper.a, revolute.b - prismatic.a
        prismatic.b - body.frame - spring.b - damper.b""",
        {
            "revolute.angle": 0.0,
            "revolute.angular_velocity": 0.0,
            "prismatic.displacement": 0.5,
            "prismatic.speed": 0.0,
        },
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


def spring_damper_system() -> Scene:
    """Return a body on a spring and a damper, and one on a guide with a spring."""
    start = {"place.position.x": 0.3, "place.position.y": -0.2, "place.position.z": 0.0}
    start |= {f"place.velocity.{axis}": 0.0 for axis in "xyz"}
    start |= {"body1.spin.x": 0.0, "body1.spin.y": 0.0, "body1.spin.z": 0.03490658503988659}
    return made(
        {
            "ground1": Ground(position=(0.3, 0.0, 0.0)),
            "ground2": Ground(position=(0.9, 0.0, 0.0)),
            "body1": RigidBody(center=(0.0, -0.2, 0.0), moments=(0.1, 0.1, 0.1)),
            "place": PositionSensor(),
            "spring1": Spring(stiffness=30.0, natural_length=0.1),
            "damper1": Damper(damping=2.0),
            "p2": Slider(axis=(0.0, -1.0, 0.0)),
            "body2": RigidBody(moments=(1e-3, 1e-3, 1e-3)),
            "spring2": Spring(stiffness=30.0, natural_length=0.1),
        },
        """ground1.frame - spring1.a - damper1.a, body1.frame - spring1.b - damper1.b - place.point
        ground2.frame - p2.a - spring2.a, p2.b - body2.frame - spring2.b""",
        start | orientation("body1", rotation("")) | {"p2.displacement": 0.1, "p2.speed": 0.0},
        **WORLD,
    )


def spring_mass_system() -> Scene:
    """Return two bodies on guides, with a spring of the guide and a spring beside it."""
    return made(
        {
            "ground1": Ground(position=(0.3, 0.0, 0.0)),
            "ground2": Ground(position=(0.6, 0.0, 0.0)),
            "p1": Slider(axis=(0.0, -1.0, 0.0), stiffness=30.0, natural_length=0.1),
            "p2": Slider(axis=(0.0, -1.0, 0.0)),
            "body1": RigidBody(moments=(1e-3, 1e-3, 1e-3)),
            "body2": RigidBody(moments=(1e-3, 1e-3, 1e-3)),
            "spring2": Spring(stiffness=30.0, natural_length=0.1),
        },
        """ground1.frame - p1.a, p1.b - body1.frame
        ground2.frame - p2.a - spring2.a, p2.b - body2.frame - spring2.b""",
        {f"p{n}.{what}": value for n in (1, 2) for what, value in (("displacement", 0.1), ("speed", 0.0))},
        **WORLD,
    )


def spring_with_mass() -> Scene:
    """Return a body on a spring that has a mass in its middle."""
    start = {"body.position.x": 0.0, "body.position.y": -0.3, "body.position.z": 0.0}
    start |= {f"body.{what}.{axis}": 0.0 for what in ("velocity", "spin") for axis in "xyz"}
    return made(
        {
            "ground": Ground(),
            "spring": Spring(stiffness=40.0, natural_length=0.2, mass=0.5, mass_at=0.5),
            "body": RigidBody(moments=(1e-3, 1e-3, 1e-3)),
        },
        "ground.frame - spring.a, body.frame - spring.b",
        start | orientation("body", rotation("")),
        **WORLD,
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


def three_springs() -> Scene:
    """Return a body that hangs on three springs, which meet in a point without mass."""
    ends, stiffness = np.array([(0.3, 0.0, 0.0), (0.0, 0.0, 0.3), (0.5, -0.3, 0.0)]), np.array([20.0, 20.0, 40.0])

    def unbalanced(knot: np.ndarray) -> np.ndarray:
        ways = ends - knot
        lengths = np.linalg.norm(ways, axis=1)
        balance: np.ndarray = (stiffness * (1.0 - 0.1 / lengths)) @ ways
        return balance

    knot = root(unbalanced, ends.mean(axis=0), tol=1e-14).x
    start = {f"place.position.{axis}": value for axis, value in zip("xyz", (0.5, -0.3, 0.0), strict=True)}
    start |= {f"{what}.{axis}": 0.0 for what in ("place.velocity", "body1.spin") for axis in "xyz"}
    return made(
        {
            "ground1": Ground(position=(0.3, 0.0, 0.0)),
            "ground2": Ground(position=(0.0, 0.0, 0.3)),
            "springs": Knot(stiffness=tuple(stiffness)),
            "body1": RigidBody(mass=0.8, center=(0.0, -0.2, 0.0), moments=(0.1, 0.1, 0.1)),
            "place": PositionSensor(),
        },
        "ground1.frame - springs.a, ground2.frame - springs.b, body1.frame - springs.c - place.point",
        start
        | {f"springs.{axis}": value for axis, value in zip("xyz", knot, strict=True)}
        | orientation("body1", rotation("")),
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


def _vector(theirs: str, ours: str) -> dict[str, str]:
    """Return the three components of a vector."""
    return {f"{theirs}[{i}]": f"{ours}.{axis}" for i, axis in enumerate("xyz", 1)}


def _hinges(*names: str) -> dict[str, str]:
    """Return the signals of hinges that have the same names here."""
    return {
        f"{name}.{m}": f"{name}.{ours}" for name in names for m, ours in (("phi", "angle"), ("w", "angular_velocity"))
    }


def _guides(*names: str) -> dict[str, str]:
    """Return the signals of guides that have the same names here."""
    return {f"{name}.{m}": f"{name}.{ours}" for name in names for m, ours in (("s", "displacement"), ("v", "speed"))}


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
    "DoublePendulum": Example(double_pendulum, _hinges("revolute1", "revolute2")),
    "DoublePendulumInitTip": Example(double_pendulum_init_tip, _hinges("revolute1", "revolute2")),
    "ForceAndTorque": Example(force_and_torque, _hinges("revolute1", "revolute2")),
    "FreeBody": Example(
        free_body,
        {
            **_vector("body.body.frame_a.r_0", "place.position"),
            **_vector("body.body.w_a", "body.solid.spin"),
            **_vector("body.v_0", "place.velocity"),
        },
    ),
    "InitSpringConstant": Example(init_spring_constant, _hinges("rev")),
    "LineForceWithTwoMasses": Example(line_force_with_two_masses, _hinges("revolute1", "revolute2")),
    "Pendulum": Example(pendulum, _hinges("rev")),
    "PendulumWithSpringDamper": Example(pendulum_with_spring_damper, _hinges("revolute") | _guides("prismatic")),
    "PointGravity": Example(
        point_gravity,
        {
            name: path
            for n in (1, 2)
            for theirs, ours in (("frame_a.r_0", "position"), ("v_0", "velocity"), ("w_a", "spin"))
            for name, path in _vector(f"body{n}.{theirs}", f"body{n}.{ours}").items()
        },
    ),
    "PointGravityWithPointMasses": Example(
        point_gravity_with_point_masses,
        {
            name: path
            for n in (1, 2, 3, 4)
            for theirs, ours in (("r_0", "position"), ("v_0", "velocity"))
            for name, path in _vector(f"body{n}.{theirs}", f"body{n}.{ours}").items()
        },
    ),
    "PointGravityWithPointMasses2": Example(
        point_gravity_with_point_masses_2,
        {
            **_vector("freeMotion.r_rel_a", "hub.position"),
            **_vector("freeMotion.v_rel_a", "hub.velocity"),
            **_vector("referenceSystem.pointMass1.w_a", "hub.spin"),
            "referenceSystem.pointMass3.v_0[1]": "mass3.velocity.x",
            **_vector("referenceSystem.pointMass6.frame_a.r_0", "mass6.position"),
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
    "SpringDamperSystem": Example(
        spring_damper_system,
        {
            **_vector("body1.frame_a.r_0", "place.position"),
            **_vector("body1.v_0", "place.velocity"),
            **_vector("body1.w_a", "body1.spin"),
            **_guides("p2"),
        },
    ),
    "SpringMassSystem": Example(spring_mass_system, _guides("p1", "p2")),
    "SpringWithMass": Example(
        spring_with_mass,
        {
            **_vector("body.frame_a.r_0", "body.position"),
            **_vector("body.v_0", "body.velocity"),
            **_vector("body.w_a", "body.spin"),
        },
    ),
    "Surfaces": Example(surfaces, {"prismatic.s": "place.position.x", "prismatic.v": "place.velocity.x"}),
    "ThreeSprings": Example(
        three_springs,
        {
            **_vector("body1.frame_a.r_0", "place.position"),
            **_vector("body1.v_0", "place.velocity"),
            **_vector("body1.w_a", "body1.spin"),
        },
    ),
    "UserDefinedGravityField": Example(user_defined_gravity_field, _hinges("rev")),
}
"""By the name of the model."""
