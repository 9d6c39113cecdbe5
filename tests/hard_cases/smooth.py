"""Drift, stiffness, coordinates, separatrices, scales, long runs: what moves smoothly without closed loops."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from atwood import Result, Scene
from atwood_library import Damper, Ground, PointMass, Rod, Spring
from atwood_library.scenes import (
    DoublePendulum,
    FreeBody,
    Gyroscope,
    IntermediateAxis,
    LagrangeTop,
    SimplePendulum,
)

from .case import BOTH, REDUCED, Case
from .known import distance, path, times, vector
from .measures import ENERGY, SECOND, closed_form, estimated, formula

LEVELS = {
    **BOTH,
    "dae, index 1 projected": {"form": "dae", "level": "index1-projected"},
    "dae, index 1": {"form": "dae", "level": "index1"},
}


def hung(stiffness: float, damped: bool, stretch: float = 0.0) -> Scene:
    """Return 1 kg that hangs on a spring of 1 m, critically damped or not at all.

    It starts by `stretch` lower than where it would rest.
    """
    scene = Scene(space="line", line_axis=(0.0, 0.0, 1.0), t_end=1.0)
    ground, mass = scene.add("ground", Ground()), scene.add("mass", PointMass(mass=1.0))
    parts: list[Any] = [scene.add("spring", Spring(stiffness=stiffness, natural_length=1.0))]
    if damped:
        parts.append(scene.add("damper", Damper(damping=2.0 * math.sqrt(stiffness))))
    for part in parts:
        scene.connect(ground.frame, part.a)
        scene.connect(part.b, mass.point)
    scene.start.update({"mass.position.z": -1.0 - 9.81 / stiffness - stretch, "mass.velocity.z": 0.0})
    return scene


def settled(stiffness: float) -> Any:
    """Return how far a spring is at the end from its stretch under the weight, over that stretch."""
    rest = 9.81 / stiffness
    return lambda result: abs(-float(result["mass.position.z"][-1]) - 1.0 - rest) / rest


STRETCH = 1e-3
"""How far the springs without dampers are stretched, m."""


def swings(stiffness: float) -> Any:
    """Return the place of the mass on a spring that nothing damps."""
    w = math.sqrt(stiffness)
    return lambda t: -1.0 - 9.81 / stiffness - STRETCH * np.cos(w * t)


SPRINGS = (
    *(
        Case(
            name=f"spring of {stiffness:.0e} N/m on 1 kg, damped".replace("e+", "e"),
            kind="fast and stiff",
            hard=f"A time scale of {1.0 / math.sqrt(stiffness):.0e} s that dies out at once, beside one second.",
            better="Both: `auto` takes IDA once it sees that the problem is stiff.",
            source="rest at m g/k",
            scene=lambda stiffness=stiffness: hung(stiffness, damped=True, stretch=-9.81 / stiffness),
            asked=(1e-3, "of the stretch at rest"),
            error=settled(stiffness),
        )
        for stiffness in (1e3, 1e6, 1e9, 1e12)
    ),
    *(
        Case(
            name=f"spring of {stiffness:.0e} N/m on 1 kg, undamped".replace("e+", "e"),
            kind="fast and stiff",
            hard=f"{math.sqrt(stiffness) * t_end / 2.0 / math.pi:,.0f} oscillations that nothing damps, of a "
            "thousandth of the spring's length.",
            better="Reduced: vibrations that do not die away are smooth, and explicit methods of high order are best.",
            source="harmonic oscillation",
            scene=lambda stiffness=stiffness: hung(stiffness, damped=False, stretch=STRETCH),
            asked=(1e-4, "of the amplitude, at all outputs"),
            error=formula("mass.position.z", swings(stiffness), STRETCH),
            options={"t_end": t_end, "rtol": 1e-13},
            ways={"reduced": {"form": "reduced"}, **({"dae": {"form": "dae"}} if stiffness < 1e5 else {})},
            limits={"dae": 1e-2},
        )
        for stiffness, t_end in ((1e3, 1.0), (1e6, 1.0), (1e12, 1e-3))
    ),
)


def many_turns() -> Scene:
    """Return a rod that turns ten thousand times in ten seconds, without weight."""
    scene = SimplePendulum(length=1.0)
    scene.set("gravity", 0.0)
    scene.start.update({"rod.angular_velocity": 2.0 * math.pi * 1e3, "rod.angle": 0.0})
    return scene


def upright(spin: float) -> Scene:
    """Return a top that stands upright and spins."""
    scene = LagrangeTop(inclination=0.0, spin=spin)
    scene.start.update({"top.spin.x": 0.0, "top.spin.y": 0.0, "top.spin.z": spin})
    return scene


def tilt(result: Result) -> float:
    """Return by how much a top's axis has left the vertical, rad."""
    return float(np.max(np.hypot(result["top.z_axis.x"], result["top.z_axis.y"])))


COORDINATES = (
    Case(
        name="free body in Euler angles",
        kind="coordinates",
        hard="Three angles are singular once in each turn, whichever they are: the gimbals lock.",
        better="Quaternions; Euler angles, where they are asked for, are switched before they are singular.",
        source="Landau and Lifshitz, Mechanics, section 37, with 45 digits",
        scene=FreeBody,
        asked=(1e-6, "angular velocity in rad/s and axis, at all known times"),
        error=distance("euler_top", "generic", {"omega": vector("body.spin"), "axis": vector("body.z_axis")}),
        options={"outputs": times("euler_top", "generic"), "t_end": 50.0, "rtol": 1e-10},
        ways={
            "quaternions": {},
            **{f"angles {names}": {"orientation": f"euler-{names}"} for names in ("zyx", "zxz", "xyz")},
        },
    ),
    Case(
        name="gyroscope",
        kind="coordinates",
        hard="Gimbals whose rings may fall into line.",
        better="Reduced: the rings' angles are the coordinates, and explicit methods take them.",
        source="a second solution",
        scene=Gyroscope,
        asked=(1e-5, SECOND),
        error=estimated,
        options={"rtol": 1e-10},
        quick=False,
    ),
    Case(
        name="upright top that sleeps",
        kind="coordinates",
        hard="Euler angles are singular where it stands.",
        better="Both: quaternions are regular everywhere.",
        source="it stays; Goldstein, section 5.7",
        scene=lambda: upright(50.0),
        asked=(1e-9, "angle from the vertical, rad"),
        error=tilt,
        options={"rtol": 1e-10},
    ),
    Case(
        name="ten thousand turns",
        kind="coordinates",
        hard="Angles are counted beyond one turn, and 1e4 turns leave 1e-12 of one.",
        better="Reduced: a turn without forces costs nothing.",
        source="evenly: w t",
        scene=many_turns,
        asked=(1e-4, "angle, rad"),
        error=formula("rod.angle", lambda t: 2.0 * math.pi * 1e3 * t),
        options={"t_end": 10.0, "rtol": 1e-10, "samples": 30_000},
        ways=REDUCED,
    ),
)


SEPARATRICES = (
    Case(
        name="pendulum let go at 179.9999 degrees",
        kind="separatrices and chaos",
        hard="Errors of the start grow by e^20 before it falls.",
        better="Reduced, with Taylor series where 1e-12 is asked.",
        source="Jacobi's elliptic functions",
        scene=lambda: SimplePendulum(release_angle="179.9999 deg"),
        asked=(1e-3, "angle, rad"),
        error=closed_form("rod.angle"),
        options={"t_end": 10.0, "rtol": 1e-12},
    ),
    Case(
        name="body about its middle axis",
        kind="separatrices and chaos",
        hard="It starts beside the separatrix, and turns over again and again.",
        better="Reduced, with Taylor series.",
        source="a second solution",
        scene=IntermediateAxis,
        asked=(1e-5, SECOND),
        error=estimated,
        options={"rtol": 1e-11},
    ),
    Case(
        name="double pendulum to its horizon",
        kind="separatrices and chaos",
        hard="Neighbouring motions part: from some time on nobody can say where it is.",
        better="Reduced: nearer to rounding, so later. The run says until when it holds.",
        source="a second solution",
        scene=DoublePendulum,
        asked=(1.0 / 15.0, "1/s: the horizon at rtol 1e-12 is after 15 s"),
        error=lambda result: 1.0 / result.accuracy.until,
        options={"t_end": 60.0, "rtol": 1e-12},
    ),
)


def chain_of(masses: tuple[float, ...], lengths: tuple[float, ...], gravity: float = 9.81) -> Scene:
    """Return bobs on rods in a row, let go a little aside."""
    scene = Scene(t_end=2.0, gravity=gravity)
    before = scene.add("ground", Ground()).frame
    for k, (mass, length) in enumerate(zip(masses, lengths, strict=True)):
        rod, bob = scene.add(f"rod{k}", Rod(length=length)), scene.add(f"bob{k}", PointMass(mass=mass))
        scene.connect(before, rod.a)
        scene.connect(rod.b, bob.point)
        before = bob.point
        scene.start.update({f"rod{k}.angle": 0.3 + 0.1 * k, f"rod{k}.angular_velocity": 0.0})
    return scene


def scaled(size: float, mass: float) -> Scene:
    """Return the double pendulum of known motion in another size; it is as many roots of the size as fast."""
    return DoublePendulum(mass1=mass, mass2=mass, length1=size, length2=size)


def scaled_case(size: float, mass: float) -> Case:
    """Return a double pendulum of another size and mass."""
    when = times("double_pendulum_chaotic", "pi/2_pi/2", 5.0)
    as_known = distance(
        "double_pendulum_chaotic", "pi/2_pi/2", {"theta1": path("rod1.angle"), "theta2": path("rod2.angle")}, 5.0
    )
    factor = math.sqrt(size)
    return Case(
        name=f"double pendulum of {size:g} m and {mass:g} kg",
        kind="scales",
        hard="Nothing is near one in SI units; what it does is the same.",
        better="Both: tolerances are shares of the scene's own sizes.",
        source="two independent solutions with 28 digits, in units of the square root of the length",
        scene=lambda: scaled(size, mass),
        asked=(1e-6, "angles, rad, at all known times"),
        error=lambda result: as_known(_Retimed(result, when)),
        options={"outputs": [factor * t for t in when], "t_end": factor * when[-1], "accuracy": 1e-8},
    )


class _Retimed:
    """A run of which other times are told."""

    def __init__(self, result: Result, times_told: list[float]) -> None:
        self._result, self.time = result, np.array(times_told)

    def __getitem__(self, name: str) -> Any:
        return self._result[name]


SCALES = (
    Case(
        name="masses from 1e9 down to 1e-9 kg in one chain",
        kind="scales",
        hard="Eighteen powers of ten in one mass matrix.",
        better="Reduced.",
        source="a second solution",
        scene=lambda: chain_of((1e9, 1e4, 1.0, 1e-4, 1e-9), (1.0,) * 5),
        asked=(1e-5, SECOND),
        error=estimated,
        options={"rtol": 1e-10},
    ),
    *(
        Case(
            name=f"masses from {1.0 / most:.0e} up to {most:.0e} kg in one chain".replace("e-0", "e-").replace(
                "e+0", "e"
            ),
            kind="scales",
            hard="A heavy end falls and pulls light links straight: what they do has no scale of its own.",
            better="Dae: masses do not add up there, so that none is lost beside the others.",
            source="a second solution",
            scene=lambda most=most: chain_of((1.0 / most, most**-0.5, 1.0, most**0.5, most), (1.0,) * 5),
            asked=(1e-3, SECOND),
            error=estimated,
            options={"rtol": 1e-10, "t_end": 0.05},
            ways=ways,
        )
        for most, ways in ((1e8, BOTH), (1e9, {"dae": {"form": "dae"}}))
    ),
    Case(
        name="lengths from 1e6 down to 1e-6 m in one chain",
        kind="scales",
        hard="Twelve powers of ten in lengths, six in time.",
        better="Reduced: angles have no scale.",
        source="a second solution",
        scene=lambda: chain_of((1.0,) * 5, (1e6, 1e3, 1.0, 1e-3, 1e-6)),
        asked=(1e-4, SECOND),
        error=estimated,
        options={"rtol": 1e-10, "t_end": 0.02},
        ways=REDUCED,
    ),
    *(scaled_case(size, mass) for size, mass in ((1e-6, 1e-9), (1e6, 1e9))),
)

LONG = (
    Case(
        name="pendulum for 1,000 s at every level",
        kind="index and drift",
        hard="Position constraints are differentiated twice at index 1, and drift; errors of phase add up.",
        better="Reduced; explicit steps that end on the constraint err seven times as much, and IDA at index 1 a "
        "thousand times and more. Index 1 unprojected drifts, and its length with it.",
        source="Jacobi's elliptic functions",
        scene=lambda: SimplePendulum(release_angle=2.0),
        asked=(1e-3, "angle at all outputs, rad"),
        error=closed_form("rod.angle"),
        options={"t_end": 1000.0, "rtol": 1e-9},
        ways=LEVELS,
        limits={"dae": 0.1, "dae, index 1 projected": 0.5, "dae, index 1": 10.0},
        quick=False,
    ),
    Case(
        name="hundred thousand periods",
        kind="long",
        hard="Errors of the energy add up over 1e5 swings.",
        better="Reduced, with Gauss's method: the error swings and does not grow.",
        source="energy balance",
        scene=lambda: SimplePendulum(release_angle=1.0),
        asked=(1e-8, ENERGY),
        error=lambda result: float(np.max(np.abs(result.energy.total - result.energy.total[0]))) / 4.5,
        options={"t_end": 2.0e5, "outputs": 2001, "samples": 1},
        ways={"reduced, Gauss of order 8": {"solver": "gauss", "order": 8, "step": 0.05}},
        quick=False,
    ),
)

CASES = (*SPRINGS, *COORDINATES, *SEPARATRICES, *SCALES, *LONG)
