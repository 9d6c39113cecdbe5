"""Examples of Modelica.Mechanics.MultiBody.Examples.Systems.RobotR3."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians
from typing import Any

from atwood import Component, Number, Scalar, Scene, derivative, observable, parameter, signal, state
from atwood_library import (
    Gear,
    Ground,
    Inertia,
    Pivot,
    PointToPoint,
    RigidBody,
    RotationalFriction,
    RotationalSensor,
    RotationalSource,
    RotationalSpringDamper,
    ServoController,
    Weld,
)

from .building import WORLD, Example, made

__all__ = ["EXAMPLES"]

AXIS = {1: (0.0, 1.0, 0.0), 2: (1.0, 0.0, 0.0), 3: (1.0, 0.0, 0.0), 4: (0.0, 1.0, 0.0), 5: (1.0, 0.0, 0.0),
        6: (0.0, 1.0, 0.0)}  # fmt: skip
WAY = {0: (0.0, 0.351, 0.0), 1: (0.0, 0.324, 0.3), 2: (0.0, 0.65, 0.0), 3: (0.0, 0.414, -0.155),
       4: (0.0, 0.186, 0.0), 5: (0.0, 0.125, 0.0)}  # fmt: skip
BODIES = {
    1: {"mass": 1.0, "moments": (0.58, 1.16, 0.58)},  # turns about y alone; 1e-3 about x and z, as there, no body has
    2: {"mass": 56.5, "center": (0.172, 0.205, 0.0), "moments": (2.58, 0.64, 2.73), "products": (-0.46, 0.0, 0.0)},
    3: {"mass": 26.4, "center": (0.064, -0.034, 0.0), "moments": (0.279, 0.245, 0.413), "products": (-0.07, 0.0, 0.0)},
    4: {"mass": 28.7, "moments": (1.67, 0.081, 1.67)},
    5: {"mass": 5.2, "moments": (1.25, 0.81, 1.53)},
    6: {"mass": 0.5, "center": (0.05, 0.05, 0.05), "moments": (1e-3, 1e-3, 1e-3)},
}
HOLDING = {
    1: 0.0,
    2: -1.8880913340679804,
    3: -3.6788347723912715,
    4: -0.60042439319676211,
    5: -0.72427931539319579,
    6: 0.0,
}
"""A. The currents that hold the weights at the start."""

LOAD = {"mass": 15.0, "center": (0.1, 0.25, 0.1), "moments": (1e-3, 1e-3, 1e-3)}


class ServoMotor(Component):
    """The windings of a motor of direct current behind a current controller of operational amplifiers.

    Of the controller there is the voltage v of a capacitor, ``0.04 d/w v' = i - wanted``; the windings have 250 ohm and
    ``250/(2 d w)`` henry, five times -v at one end and the voltage ``k speed`` of the rotor at the other.
    """

    k: Number = parameter(1.1616, unit="N*m", doc="Torque for a unit of current.")
    w: Number = parameter(4590.0, unit="1/s", above=0.0, doc="How fast the current follows.")
    d: Number = parameter(0.6, above=0.0, doc="How it is damped.")
    wanted: Number = signal(0.0, unit="any", doc="The current that is asked for.")
    speed: Number = signal(0.0, unit="rad/s", doc="Of the rotor.")
    voltage: Scalar = state(0.0, unit="any", doc="Of the capacitor.")
    current: Scalar = state(0.0, unit="any", doc="In the windings.")

    @derivative("voltage")
    def charging(self) -> Scalar:
        """Return the rate of the capacitor's voltage."""
        return (self.current - self.wanted) * self.w / (0.04 * self.d)

    @derivative("current")
    def winding(self) -> Scalar:
        """Return the rate of the current."""
        drop = 5.0 * self.voltage + 250.0 * self.current + self.k * self.speed
        return -drop * 2.0 * self.d * self.w / 250.0

    @observable(unit="N*m", doc="Torque on the rotor.")
    def torque(self) -> Scalar:
        """Return the torque."""
        return self.k * self.current


@dataclass(frozen=True)
class Axis:
    """An axis: its way, the ratio of its gear, its friction, its motor and, of the first three, its elasticity."""

    way: tuple[float, float]
    ratio: float
    friction: tuple[float, float, float]
    motor: dict[str, float]
    rotor: float = 0.0013
    elastic: tuple[float, float] | None = None


AXES = {
    1: Axis((-60.0, 60.0), -105.0, (0.4, 0.13 / 160.0, 1.0), {}, elastic=(43.0, 0.005)),
    2: Axis((20.0, -70.0), 210.0, (0.5, 0.1 / 130.0, 1.0), {"w": 5500.0}, elastic=(8.0, 0.01)),
    3: Axis((90.0, -35.0), 60.0, (0.7, 0.2 / 130.0, 1.0), {"w": 5500.0}, elastic=(58.0, 0.04)),
    4: Axis((0.0, 45.0), -99.0, (21.8, 9.8, 26.7 / 21.8), {"k": 0.2365, "w": 6250.0, "d": 0.55}, 1.6e-4),
    5: Axis((-110.0, 110.0), 79.2, (30.1, 0.03, 39.6 / 30.1), {"k": 0.2608, "w": 6250.0, "d": 0.55}, 1.8e-4),
    6: Axis((0.0, 45.0), -99.0, (10.9, 3.92, 16.8 / 10.9), {"k": 0.0842, "w": 7400.0, "d": 0.27}, 4.3e-5),
}
FASTEST = {1: (3.0, 15.0), 2: (1.5, 15.0), 3: (5.0, 15.0), 4: (3.1, 60.0), 5: (3.1, 60.0), 6: (4.1, 60.0)}


def driven(n: int, axis: Axis, rate: float, acceleration: float, shaft: str) -> tuple[dict[str, Component], str]:
    """Return the parts of an axis, and how they are joined with each other and with what it turns.

    Parameters
    ----------
    n, axis
        Its number, and the axis.
    rate, acceleration
        The largest ones on its way, as shares of it.
    shaft
        The connector of what it turns.
    """
    begin, end = (axis.ratio * radians(one) for one in axis.way)
    size = abs(end - begin)
    sliding, viscous, peak = axis.friction
    rub = RotationalFriction(sliding=repr(sliding), viscous=viscous, peak=peak, against="ground")
    parts: dict[str, Any] = {
        f"path{n}": PointToPoint(
            travel=end - begin, offset=begin, largest_rate=rate * size, largest_acceleration=acceleration * size
        ),
        f"controller{n}": ServoController(position_gain=5.0, gain=0.5, integral_time=0.05),
        f"motor{n}": ServoMotor(**axis.motor),
        f"torque{n}": RotationalSource(against="ground"),
        f"rotor{n}": Inertia(moment=axis.rotor),
        f"friction{n}": rub,
        f"gear{n}": Gear(ratio=axis.ratio),
    }
    joined = f"""path{n}.value > controller{n}.set_point, path{n}.rate > controller{n}.set_rate
        rotor{n}.angle > controller{n}.measurement, rotor{n}.angular_velocity > controller{n}.measured_rate
        controller{n}.y > motor{n}.wanted, rotor{n}.angular_velocity > motor{n}.speed, motor{n}.torque > torque{n}.value
        """
    if axis.elastic is None:
        joined += f"rotor{n}.flange - torque{n}.b - gear{n}.a, gear{n}.b - friction{n}.b - {shaft}\n"
    else:
        parts |= {f"spring{n}": RotationalSpringDamper(stiffness=axis.elastic[0], damping=axis.elastic[1])}
        parts |= {f"wheel{n}": Inertia(moment=0.0), f"twist{n}": RotationalSensor(against="flange")}
        joined += f"""rotor{n}.flange - torque{n}.b - friction{n}.b - spring{n}.a - twist{n}.a
            spring{n}.b - twist{n}.b - wheel{n}.flange - gear{n}.a, gear{n}.b - {shaft}
            """
    return parts, joined


def one_axis() -> Scene:
    """Return one axis that turns a load by 120 degrees."""
    axis = Axis((0.0, 120.0), 210.0, (0.5, 0.1 / 130.0, 1.0), {"w": 5500.0}, elastic=(8.0, 0.01))
    way = radians(120.0)
    parts, joined = driven(1, axis, 3.0 / way, 10.0 / way, "load.flange")
    start = {f"{part}.{what}": 0.0 for part in ("load", "rotor1") for what in ("angle", "angular_velocity")}
    return made({**parts, "load": Inertia(moment=1.14**2 * 15.0)}, joined, start)


def full_robot() -> Scene:
    """Return the robot: six axes that begin and end their ways together, and hold their weights at first."""
    ways = {n: abs(radians(axis.way[1] - axis.way[0])) for n, axis in AXES.items()}
    rate, acceleration = (min(FASTEST[n][k] / way for n, way in ways.items()) for k in (0, 1))
    parts: dict[str, Any] = {"ground": Ground(), "way0": Weld(displacement=WAY[0])}
    joined, start = "ground.frame - way0.a\n", {}
    for n, axis in AXES.items():
        own, lines = driven(n, axis, rate, acceleration, f"r{n}.shaft")
        parts |= own | {f"r{n}": Pivot(axis=AXIS[n]), f"b{n}": RigidBody(**BODIES[n])}
        joined += f"{lines}way{n - 1}.b - r{n}.a, r{n}.b - b{n}.frame\n"
        if n in WAY:
            parts[f"way{n}"] = Weld(displacement=WAY[n])
            joined += f"b{n}.frame - way{n}.a\n"
        start |= at_rest(n, axis)
    parts["load"] = RigidBody(**LOAD)
    joined += "b6.frame - load.frame"
    return made(parts, joined, start, **{**WORLD, "gravity": 9.81})


def at_rest(n: int, axis: Axis) -> dict[str, float]:
    """Return the start of an axis at rest, with the current that holds its weight."""
    current, place = HOLDING[n], radians(axis.way[0])
    turned = 0.0 if axis.elastic is None else -axis.motor.get("k", 1.1616) * current / axis.elastic[0]
    return {
        f"r{n}.angle": place,
        f"r{n}.angular_velocity": 0.0,
        **({} if axis.elastic is None else {f"rotor{n}.angle": axis.ratio * place - turned}),
        **({} if axis.elastic is None else {f"rotor{n}.angular_velocity": 0.0}),
        f"controller{n}.integral": 2.0 * current - 5.0 * turned,
        f"motor{n}.voltage": -50.0 * current,
        f"motor{n}.current": current,
    }


def states(n: int, axis: str, joint: str, elastic: bool) -> dict[str, str]:
    """Return the signals of an axis and of the joint that it turns by their names in Modelica."""
    return {
        f"{axis}.controller.PI.x": f"controller{n}.integral",
        f"{axis}.motor.C.v": f"motor{n}.voltage",
        f"{axis}.motor.La.i": f"motor{n}.current",
        **({f"{axis}.gear.spring.phi_rel": f"twist{n}.angle"} if elastic else {}),
        **({f"{axis}.gear.spring.w_rel": f"twist{n}.angular_velocity"} if elastic else {}),
        **{f"{joint}.{theirs}": f"r{n}.{ours}" for theirs, ours in (("phi", "angle"), ("w", "angular_velocity"))},
    }


_LOAD = {"axis.initializeFlange.phi_flange": "load.angle", "axis.initializeFlange.w_flange": "load.angular_velocity"}
EXAMPLES = {
    "OneAxis": Example(one_axis, {**states(1, "axis", "joint", elastic=True), **_LOAD}),
    "FullRobot": Example(
        full_robot,
        {"mechanics.b2.body.w_a[1]": "r2.angular_velocity"}
        | {
            theirs: ours
            for n, axis in AXES.items()
            for theirs, ours in states(n, f"axis{n}", f"mechanics.r{n}", axis.elastic is not None).items()
        },
        long=True,
    ),
}
