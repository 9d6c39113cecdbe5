"""Examples of Modelica.Mechanics.MultiBody.Examples.Loops."""

from __future__ import annotations

from collections.abc import Callable
from math import asin, cos, pi, radians, sin, sqrt

from atwood import Component, Scalar, Scene, select
from atwood_library import (
    FirstOrder,
    Ground,
    Inertia,
    Pivot,
    PointOnLine,
    RigidBody,
    Rod,
    RotaryDrive,
    RotationalCoupling,
    RotationalResistance,
    Slider,
    TranslationalSource,
    Weld,
)

from .building import WORLD, Example, bar, box, cylinder, made, overlong
from .elementary import filtered_sine

__all__ = ["EXAMPLES"]

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


def gas(stroke: float, diameter: float = 0.1) -> TranslationalSource:
    """Return the force of the gas in a cylinder by GasForce2, a rough law of Modelica's engines.

    The displacement is the distance of the piston from the end of the cylinder; the law differs as the gas expands and
    as it shrinks.
    """

    def law(x: Scalar, v: Scalar) -> Scalar:
        place = 1.0 - x / stroke
        shrinks = select(
            place < 0.986061,
            _polynomial(place, 177.4132, -287.2189, 151.8252, -24.9973, 2.4),
            _polynomial(place, 2836360.0, -10569296.0, 14761814.0, -9158505.0, 2129670.0),
        )
        expands = select(
            place > 0.933,
            _polynomial(place, -3929704.0, 14748765.0, -20747000.0, 12964477.0, -3036495.0),
            _polynomial(place, 145.930, -131.707, 17.3438, 17.9272, 2.4),
        )
        return 1e5 * pi * diameter**2 / 4.0 * select(v < 0.0, shrinks, expands)

    return TranslationalSource(law=law)


def _polynomial(x: Scalar, *coefficients: float) -> Scalar:
    """Return a polynomial, by Horner's rule."""
    total: Scalar = 0.0
    for coefficient in coefficients:
        total = total * x + coefficient
    return total


def engine1a(burning: bool = False) -> Scene:
    """Return a cylinder of an engine: crank, connecting rod, piston and a flywheel."""
    return made(
        {
            **({"gas": gas(0.35)} if burning else {}),
            "ground": Ground(),
            "above": Ground(position=(0.15, 0.45, 0.0)),
            "bearing": Pivot(axis=X),
            "inertia": Inertia(moment=1.0, axis=X),
            "shaft": RotationalCoupling(),
            "crank1": cylinder((0.1, 0.0, 0.0), 0.05),
            "crank2": box((0.0, 0.1, 0.0), 0.02, 0.05, X),
            "crank3": cylinder((0.1, 0.0, 0.0), 0.03),
            "crank4": box((0.0, -0.1, 0.0), 0.02, 0.05, X),
            "mid": Weld(displacement=(0.05, 0.0, 0.0)),
            "rod": box((0.0, -0.2, 0.0), 0.02, 0.06, X),
            "piston": cylinder((0.0, -0.1, 0.0), 0.1),
            "b1": Pivot(axis=X),
            "b2": Pivot(axis=X),
            "cylinder": Slider(axis=(0.0, -1.0, 0.0)),
        },
        """ground.frame - bearing.a, bearing.b - crank1.a, bearing.shaft - shaft.b, inertia.flange - shaft.a
        crank1.b - crank2.a, crank2.b - crank3.a - mid.a, crank3.b - crank4.a
        above.frame - cylinder.a, cylinder.b - piston.a, piston.b - b1.a, b1.b - rod.a, rod.b - b2.b, mid.b - b2.a"""
        + ("\ncylinder.carriage - gas.b" if burning else ""),
        {"inertia.angle": 0.0, "inertia.angular_velocity": 10.0},
        **WORLD,
    )


def engine1b() -> Scene:
    """Return the cylinder with a gas force."""
    return engine1a(burning=True)


def engine_v6(
    cylinder: Callable[[str], tuple[dict[str, Component], str]], length: float, throw: float, rod: float, torque: float
) -> Scene:
    """Return six cylinders in two rows, a load and a filter of the torque between them.

    Parameters
    ----------
    cylinder
        Returns the parts of a cylinder, and how they are joined, with `crank.a` at the crank and `row.a` at the row;
        all names begin with its own. Its loop is closed in its plane alone, so that no reaction is left open.
    length, throw, rod
        Distance of one cylinder from the next, throw of the crank, length of the rod, m.
    torque
        Torque on the load at the start, at which the filter is at rest, N m.
    """
    rate = 2.0 * pi * 5.0 / sqrt(sqrt(2.0) - 1.0)
    parts: dict[str, Component] = {
        "ground": Ground(),
        "bearing": Pivot(axis=X),
        "crank": RigidBody(mass=0.0),
        "load": Inertia(axis=X),
        "fan": RotationalResistance(quadratic=100.0 / 200.0**2),
        "sensor": RotationalCoupling(),
        "filter1": FirstOrder(time_constant=1.0 / rate),
        "filter2": FirstOrder(time_constant=1.0 / rate),
    }
    joined = """ground.frame - bearing.a, bearing.b - crank.frame
    bearing.shaft - sensor.a, load.flange - sensor.b - fan.b
    sensor.torque > filter1.u, filter1.y > filter2.u"""
    guess = {}
    for n, (turn, tilt) in enumerate(((-30, -30), (90, 30), (210, -30), (210, 30), (90, -30), (-30, 30))):
        name = f"c{n + 1}"
        more, text = cylinder(name)
        parts |= more | {
            f"{name}_turn": Weld(displacement=(n * length, 0.0, 0.0), axis=X, angle=radians(turn)),
            f"{name}_tilt": Weld(displacement=(n * length, 0.0, 0.0), axis=X, angle=radians(tilt)),
        }
        joined += f"""
        crank.frame - {name}_turn.a, {name}_turn.b - {name}_crank.a, ground.frame - {name}_tilt.a
        {name}_tilt.b - {name}_row.a
        {text}"""
        apart = radians(turn - tilt)
        lean = asin(throw * sin(apart) / rod)
        guess[f"{name}_slider.displacement"] = 0.42 - 0.1 - throw * cos(apart) - rod * cos(lean)
        guess[f"{name}_b1.angle"] = -lean - apart
    start = {"load.angle": 0.0, "load.angular_velocity": 10.0, "filter1.y": torque, "filter2.y": torque}
    scene = made(parts, joined, start, **WORLD)
    scene.guess = guess
    return scene


def engine_v6_of_shapes() -> Scene:
    """Return the engine with cranks, rods and pistons of steel."""

    def cylinder_of(name: str) -> tuple[dict[str, Component], str]:
        parts = {
            "crank": overlong((0.1, 0.0, 0.0), cylinder((0.12, 0.0, 0.0), 0.05), (0.05, 0.0, 0.0)),
            "web": box((0.0, 0.1, 0.0), 0.02, 0.05, X),
            "pin": overlong((0.1, 0.0, 0.0), cylinder((0.12, 0.0, 0.0), 0.03), (0.05, 0.0, 0.0)),
            "back": box((0.0, -0.1, 0.0), 0.02, 0.05, X),
            "mid": Weld(displacement=(0.05, 0.0, 0.0)),
            "row": Weld(displacement=(0.15, 0.42, 0.0)),
            "slider": Slider(axis=(0.0, -1.0, 0.0)),
            "piston": cylinder((0.0, 0.1, 0.0), 0.1),
            "rod": overlong((0.0, 0.2, 0.0), box((0.0, 0.22, 0.0), 0.02, 0.06, X), (0.0, 0.09, 0.0)),
            "b1": Pivot(axis=X),
            "b2": PointOnLine(axis=X),
            "gas": gas(0.22),
        }
        joined = f"""{name}_crank.b - {name}_web.a, {name}_web.b - {name}_pin.a - {name}_mid.a
        {name}_pin.b - {name}_back.a
        {name}_row.b - {name}_slider.a, {name}_slider.b - {name}_piston.b, {name}_piston.a - {name}_b2.a
        {name}_mid.b - {name}_b1.a, {name}_b1.b - {name}_rod.a, {name}_rod.b - {name}_b2.b
        {name}_slider.carriage - {name}_gas.b"""
        return {f"{name}_{part}": component for part, component in parts.items()}, joined

    return engine_v6(cylinder_of, 0.2, 0.1, 0.2, 563.186235502)


def engine_v6_of_numbers() -> Scene:
    """Return the engine with bodies given by mass and inertia."""

    def cylinder_of(name: str) -> tuple[dict[str, Component], str]:
        parts = {
            "crank": Weld(displacement=(0.09, 0.05, 0.0)),
            "row": Weld(displacement=(0.09, 0.42, 0.0)),
            "slider": Slider(axis=(0.0, -1.0, 0.0)),
            "piston": bar((0.0, 0.1, 0.0), 6.0, (0.0, 0.05, 0.0), 0.0088, 0.0076, 0.0088),
            "rod": bar((0.0, 0.175, 0.0), 1.0, (0.0, 0.0875, 0.0), 0.006, 0.0005, 0.006),
            "b1": Pivot(axis=X),
            "b2": PointOnLine(axis=X),
            "gas": gas(0.195),
        }
        joined = f"""{name}_row.b - {name}_slider.a, {name}_slider.b - {name}_piston.b, {name}_piston.a - {name}_b2.a
        {name}_crank.b - {name}_b1.a, {name}_b1.b - {name}_rod.a, {name}_rod.b - {name}_b2.b
        {name}_slider.carriage - {name}_gas.b"""
        return {f"{name}_{part}": component for part, component in parts.items()}, joined

    scene = engine_v6(cylinder_of, 0.14, 0.05, 0.175, 238.056148886)
    scene.crank.mass, scene.crank.center, scene.crank.moments = 180.0, (0.3, 0.0, 0.0), (0.1, 0.1, 0.1)
    return scene


def _fourbar(parts: dict, joined: str) -> Scene:
    """Return a crank, and a body that slides on a bar, with a rod between them."""
    return made(
        {
            "ground": Ground(),
            "right": Ground(position=(1.2, 0.0, 0.0)),
            "j1": Pivot(axis=X),
            "j2": Slider(axis=X),
            "b1": cylinder((0.0, 0.5, 0.1), 0.05),
            "b2": cylinder((0.0, 0.2, 0.0), 0.05),
            **parts,
        },
        "ground.frame - j1.a, j1.b - b1.a, right.frame - j2.a, j2.b - b2.a\n" + joined,
        {"j1.angle": 0.0, "j1.angular_velocity": 5.235987755982989},
        **WORLD,
    )


def fourbar1() -> Scene:
    """Return the mechanism with a heavy rod on hinges."""
    hinges = {"rev": Y, "rev1": Z, "j3": X, "j4": Y, "j5": Z}
    scene = _fourbar(
        {"b3": cylinder((-1.0, 0.3, 0.1), 0.05), **{name: Pivot(axis=axis) for name, axis in hinges.items()}},
        "b2.b - rev.a, rev.b - rev1.a, rev1.b - b3.a, b1.b - j3.a, j3.b - j4.a, j4.b - j5.a, j5.b - b3.b",
    )
    scene.guess = {"j2.displacement": -0.2}
    return scene


def fourbar2() -> Scene:
    """Return the mechanism with a rod without mass."""
    scene = _fourbar({"rod": Rod(length=1.1**0.5)}, "b2.b - rod.a, b1.b - rod.b")
    scene.guess = {"j2.displacement": -0.2}
    return scene


def planar_fourbar() -> Scene:
    """Return four boxes in a loop of four hinges, one of them damped."""
    return made(
        {
            "ground": Ground(),
            "revolute1": Pivot(axis=Z, damping=0.1),
            "revolute2": Pivot(axis=Z),
            "revolute3": Pivot(axis=Z),
            "revolute4": Pivot(axis=Z),
            "body1": box((0.4, 0.0, 0.0), 0.05),
            "body2": box((0.1, 1.1, 0.0), 0.05),
            "body3": box((-0.15, 1.0, 0.0), 0.05),
            "body4": box((0.65, 0.1, 0.0), 0.05),
        },
        """ground.frame - revolute1.a - body3.a, revolute1.b - body1.a, body1.b - revolute2.a, revolute2.b - body2.a
        body3.b - revolute3.a, revolute3.b - body4.a, body4.b - revolute4.a, body2.b - revolute4.b""",
        {"revolute1.angle": 0.0, "revolute1.angular_velocity": 0.0},
        **WORLD,
    )


def planar_loops() -> Scene:
    """Return three loops of hinges in a row, the first of which is driven."""
    first, second, third = (0.6 - 0.0, 0.0, 0.0), (0.5, 0.1, 0.0), (0.4, -0.05, 0.0)
    ends = {1: (0.1, 0.5, 0.0), 2: (0.1, 0.6, 0.0), 3: (0.0, 0.55, 0.0)}
    parts = {
        "ground": Ground(),
        "rev": RotaryDrive(axis=Z, rotation=filtered_sine(0.7, 1.0)),
        "lever0": RigidBody(mass=0.0),
        "arm0": Weld(displacement=(0.0, 0.5, 0.0)),
    }
    joined = "ground.frame - rev.a, rev.b - lever0.frame - arm0.a\n"
    for n, way in ((1, first), (2, second), (3, third)):
        parts |= {
            f"base{n}": Ground(position=(0.5 * n, 0.0, 0.0)),
            f"hinge{n}": Pivot(axis=Z),
            f"lever{n}": RigidBody(mass=0.0),
            f"arm{n}": Weld(displacement=ends[n]),
            f"near{n}": Pivot(axis=Z),
            f"far{n}": Pivot(axis=Z),
            f"rod{n}": bar(way, 1.0, tuple(0.5 * x for x in way)),
        }
        joined += f"""
        base{n}.frame - hinge{n}.a, hinge{n}.b - lever{n}.frame - arm{n}.a
        arm{n - 1}.b - near{n}.a, near{n}.b - rod{n}.a, rod{n}.b - far{n}.a, arm{n}.b - far{n}.b"""
    return made(parts, joined, None, **WORLD)


_V6 = {
    "filter.x[1]": "filter1.y",
    "filter.x[2]": "filter2.y",
    "load.phi": "load.angle",
    "load.w": "load.angular_velocity",
}

EXAMPLES = {
    "Engine1a": Example(engine1a, {"inertia.phi": "inertia.angle", "inertia.w": "inertia.angular_velocity"}),
    "Engine1b": Example(engine1b, {"inertia.phi": "inertia.angle", "inertia.w": "inertia.angular_velocity"}),
    "Engine1b_analytic": Example(engine1b, {"inertia.phi": "inertia.angle", "inertia.w": "inertia.angular_velocity"}),
    "EngineV6": Example(engine_v6_of_shapes, _V6, long=True),
    "EngineV6_analytic": Example(engine_v6_of_numbers, _V6, long=True),
    "Fourbar1": Example(fourbar1, {"j1.phi": "j1.angle", "j1.w": "j1.angular_velocity"}),
    "Fourbar2": Example(fourbar2, {"j1.phi": "j1.angle", "j1.w": "j1.angular_velocity"}),
    "Fourbar_analytic": Example(fourbar2, {"j1.phi": "j1.angle", "j1.w": "j1.angular_velocity"}),
    "PlanarFourbar": Example(
        planar_fourbar, {"revolute1.phi": "revolute1.angle", "revolute1.w": "revolute1.angular_velocity"}
    ),
    "PlanarLoops_analytic": Example(planar_loops, {"rev.phi": "rev.angle", "rev.w": "lever0.spin.z"}),
}
"""By the name of the model."""
