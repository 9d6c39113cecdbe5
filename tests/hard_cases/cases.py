"""The cases."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from atwood import Result, Scene
from atwood_library import Damper, Ground, PointMass, Rod, Spring
from atwood_library.scenes import (
    AndrewsSqueezer,
    Bricard,
    CarAxis,
    Chain,
    DoubleCardanTwice,
    DoublePendulum,
    FlyballGovernor,
    FourBarRow,
    Gyroscope,
    IntermediateAxis,
    Kepler,
    LagrangeTop,
    RigidBodies,
    ScottRussellLift,
    SimplePendulum,
    SphericalPendulum,
    Strandbeest,
)

from .case import BOTH, Case

LEVELS = {
    **BOTH,
    "dae, index 1 projected": {"form": "dae", "level": "index1-projected"},
    "dae, index 1": {"form": "dae", "level": "index1"},
}


def energy(result: Result) -> float:
    """Return the drift of the energy balance, relative to what the scene exchanges."""
    return float(result.energy.max_drift)


def estimated(result: Result) -> float:
    """Return the error by a second solution."""
    return float(result.accuracy.reached)


def closed_form(path: str) -> Callable[[Result], float]:
    """Return the largest distance of a quantity from the scene's closed form."""

    def error(result: Result) -> float:
        exact = result.assembly.source.scene.closed_form(result.time)[path]  # type: ignore[union-attr]
        return float(np.max(np.abs(result[path] - exact)))

    return error


def kepler_error(result: Result) -> float:
    """Return the distance at the end from the place after whole revolutions: the start."""
    return max(abs(float(result[f"body.position.{axis}"][-1] - result[f"body.position.{axis}"][0])) for axis in "xz")


def feet(result: Result) -> float:
    """Return by how much the loops are open, relative to the extent of the scene."""
    return float(result.constraint_max["position"])


def many_turns() -> Scene:
    """Return a wheel that turns ten thousand times against a weak spring."""
    scene = SimplePendulum(length=1.0)
    scene.set("gravity", 0.0)
    scene.start["rod.angular_velocity"] = 2.0 * math.pi * 1e4 / 10.0
    scene.start["rod.angle"] = 0.0
    return scene


def unequal_masses() -> Scene:
    """Return a chain whose masses go from 1e9 down to 1e-9 kg."""
    scene = Scene(t_end=2.0)
    before = scene.add("ground", Ground()).frame
    for k, mass in enumerate((1e9, 1e4, 1.0, 1e-4, 1e-9)):
        rod, bob = scene.add(f"rod{k}", Rod(length=1.0)), scene.add(f"bob{k}", PointMass(mass=mass))
        scene.connect(before, rod.a)
        scene.connect(rod.b, bob.point)
        before = bob.point
        scene.start[f"rod{k}.angle"] = 0.3 + 0.1 * k
    return scene


def stiff_spring(stiffness: float) -> Scene:
    """Return 1 kg that hangs on a spring of 1 m, critically damped, and starts where the spring has no force."""
    scene = Scene(t_end=1.0)
    ground, mass = scene.add("ground", Ground()), scene.add("mass", PointMass(mass=1.0))
    spring = scene.add("spring", Spring(stiffness=stiffness, natural_length=1.0))
    damper = scene.add("damper", Damper(damping=2.0 * math.sqrt(stiffness)))
    for part in (spring, damper):
        scene.connect(ground.frame, part.a)
        scene.connect(part.b, mass.point)
    scene.start.update({"mass.position.x": 0.0, "mass.position.z": -1.0})
    return scene


def stretch(stiffness: float) -> Callable[[Result], float]:
    """Return how far a spring is from its stretch under the weight, as a share of it."""
    rest = 9.81 / stiffness
    return lambda result: abs(-float(result["mass.position.z"][-1]) - 1.0 - rest) / rest


CASES = (
    Case(
        "pendulum for 1,000 s",
        "index and drift",
        "Position constraints are differentiated twice at index 1, and drift; errors of phase add up.",
        "Reduced: the explicit method errs a thousand times less, in a tenth of the time. Index 1 unprojected drifts.",
        "Jacobi's elliptic functions",
        lambda: SimplePendulum(release_angle=2.0),
        closed_form("rod.angle"),
        (0.3, "angle at all outputs, rad"),
        {"t_end": 1000.0, "rtol": 1e-9},
        {name: way for name, way in LEVELS.items() if name != "dae, index 1"},
        quick=False,
    ),
    Case(
        "Andrews' squeezing mechanism",
        "fast and stiff",
        "Seven bodies that turn a hundred times a second, forces of 1e5 m/s^2, three loops.",
        "Both reach the published digits; the reduced form has fewer unknowns.",
        "Hairer and Wanner, Solving ODEs II, section VII.7; test set for IVP solvers",
        AndrewsSqueezer,
        estimated,
        (1e-5, "angles, rad, by a second solution"),
        {"rtol": 1e-10},
    ),
    Case(
        "car axis",
        "fast and stiff",
        "Springs beside which 0.5 g move, two rods that keep their length, a road that shakes: index 3.",
        "Both; the dae form keeps the forces in the rods as unknowns.",
        "Test set for IVP solvers",
        CarAxis,
        estimated,
        (1e-6, "positions over the extent of the scene, by a second solution"),
        {"rtol": 1e-10},
    ),
    Case(
        "flyball governor with stiff springs",
        "fast and stiff",
        "Springs of 8e5 N/m with dampers of 4e4 N s/m on balls of 5 kg, in space.",
        "Both by IDA; explicit methods would take a hundred times the steps.",
        "IFToMM library of computational benchmark problems, A05",
        FlyballGovernor,
        estimated,
        (1e-6, "positions over the extent of the scene, by a second solution"),
        {"t_end": 1.0, "rtol": 1e-10},
    ),
    *(
        Case(
            f"spring of {stiffness:g} N/m on 1 kg, damped",
            "fast and stiff",
            "A time scale of microseconds that dies out within them, beside one second.",
            "Both: `auto` takes IDA once it sees that the problem is stiff.",
            "rest at m g/k",
            lambda stiffness=stiffness: stiff_spring(stiffness),
            stretch(stiffness),
            (1e-3, "of the stretch at rest"),
        )
        for stiffness in (1e6, 1e12)
    ),
    *(
        Case(
            f"row of {windows} four-bar linkages",
            "singular positions",
            "All bars come into line: there more can move than anywhere else, and the next path is not determined.",
            "Both pass on collocation arcs; the reduced form in fewer steps.",
            "IFToMM library, A02: a compound pendulum" if windows == 2 else "energy balance",
            lambda windows=windows: FourBarRow(windows=windows),
            energy,
            (1e-5, "energy over what is exchanged"),
            {"rtol": 1e-9, "t_end": 5.0},
            quick=windows < 3,
        )
        for windows in (1, 2, 10)
    ),
    Case(
        "Bricard's mechanism",
        "redundancy",
        "Six bars and six hinges that move although a count of constraints says that nothing can.",
        "Both drop one of the constraints that follow from the others; its reaction is not unique, which is said.",
        "IFToMM library, A04",
        Bricard,
        energy,
        (1e-6, "energy over what is exchanged"),
        {"rtol": 1e-10},
        quick=False,
    ),
    Case(
        "five masses on ten rods",
        "redundancy",
        "One rod more than needed holds five masses together; which tension it has nothing says.",
        "Both.",
        "energy balance",
        RigidBodies,
        energy,
        (1e-6, "energy over what is exchanged"),
        {"rtol": 1e-10},
    ),
    Case(
        "two double Cardan shafts side by side",
        "redundancy",
        "Two paths of shafts and four universal joints drive the same shaft.",
        "Both.",
        "output angle = input angle",
        DoubleCardanTwice,
        estimated,
        (1e-7, "angles, rad, by a second solution"),
        {"rtol": 1e-10},
    ),
    Case(
        "Scott Russell lift",
        "redundancy",
        "A straight-line linkage: its foot and its head are guided by the same law twice.",
        "Both.",
        "energy balance with the actuator's work",
        ScottRussellLift,
        estimated,
        (1e-7, "positions over the extent of the scene, by a second solution"),
        {"rtol": 1e-10},
    ),
    Case(
        "strandbeest",
        "redundancy",
        "Two of Jansen's legs on one crank: nine loops, one degree of freedom.",
        "Both; feet stay on the intersections of circles.",
        "closure of all loops",
        Strandbeest,
        feet,
        (1e-10, "open loops over the extent of the scene"),
        {"rtol": 1e-10},
    ),
    Case(
        "spherical pendulum through its lowest point",
        "coordinates",
        "Spherical angles have no value at the pole.",
        "Both: coordinates are Cartesian, and regular everywhere.",
        "energy balance",
        SphericalPendulum,
        energy,
        (1e-6, "energy over what is exchanged"),
        {"rtol": 1e-10, "t_end": 10.0},
    ),
    Case(
        "gyroscope",
        "coordinates",
        "Gimbals whose rings may fall into line.",
        "Both.",
        "a second solution",
        Gyroscope,
        estimated,
        (1e-5, "angles, rad"),
        {"rtol": 1e-10},
    ),
    Case(
        "heavy symmetric top",
        "coordinates",
        "Euler angles are singular where it stands upright.",
        "Reduced: quaternions and an explicit method.",
        "energy balance; the exact motion is in the tests of the top",
        LagrangeTop,
        energy,
        (1e-6, "energy over what is exchanged"),
        {"rtol": 1e-10},
    ),
    Case(
        "ten thousand turns",
        "coordinates",
        "Angles are counted beyond one turn, and 1e4 turns leave 1e-12 of one.",
        "Reduced: a turn costs nothing.",
        "evenly: w t",
        many_turns,
        lambda result: float(np.max(np.abs(result["rod.angle"] - 2.0 * math.pi * 1e3 * result.time))),
        (1e-4, "angle, rad"),
        {"t_end": 10.0, "rtol": 1e-10},
        {"reduced": {"form": "reduced"}},
    ),
    Case(
        "pendulum let go at 179.9999 degrees",
        "separatrices and chaos",
        "Errors of the start grow by e^20 before it falls.",
        "Reduced, with Taylor series where 1e-12 is asked.",
        "Jacobi's elliptic functions",
        lambda: SimplePendulum(release_angle="179.9999 deg"),
        closed_form("rod.angle"),
        (1e-3, "angle, rad"),
        {"t_end": 10.0, "rtol": 1e-12},
    ),
    Case(
        "body about its middle axis",
        "separatrices and chaos",
        "It starts beside the separatrix, and turns over again and again.",
        "Reduced.",
        "a second solution",
        IntermediateAxis,
        estimated,
        (1e-5, "angles, rad"),
        {"rtol": 1e-11},
    ),
    Case(
        "double pendulum to its horizon",
        "separatrices and chaos",
        "Neighbouring motions part: from some time on nobody can say where it is.",
        "Reduced: nearer to rounding, so later. The run says until when it holds.",
        "a second solution",
        DoublePendulum,
        lambda result: 1.0 / result.accuracy.until,
        (1.0 / 15.0, "1/s, the horizon at rtol 1e-12 is after 15 s"),
        {"t_end": 60.0, "rtol": 1e-12},
    ),
    Case(
        "masses from 1e-9 to 1e9 kg in one chain",
        "scales",
        "Eighteen powers of ten in one mass matrix.",
        "Reduced.",
        "a second solution",
        unequal_masses,
        estimated,
        (1e-5, "angles, rad"),
        {"rtol": 1e-10},
    ),
    Case(
        "Kepler's ellipse of eccentricity 0.99",
        "scales",
        "At the pericentre everything is a thousand times as fast as at the apocentre.",
        "Reduced: step sizes follow, and an explicit method of order 8 errs less than IDA.",
        "it returns to its start",
        lambda: Kepler(eccentricity=0.99),
        kepler_error,
        (1e-4, "of the semi-major axis, after one revolution"),
        {"rtol": 1e-12},
    ),
    *(
        Case(
            f"chain of {links} links",
            "large",
            "Thousands of unknowns; dense algebra would take their cube.",
            "Reduced: accelerations in O(N).",
            "energy balance",
            lambda links=links: Chain(links=links, mass=1.0 / links),
            energy,
            (1e-4, "energy over what is exchanged"),
            {"t_end": 0.1, "rtol": 1e-6},
            {"reduced": {"form": "reduced"}},
            quick=False,
        )
        for links in (1000,)
    ),
    Case(
        "let go at an unstable equilibrium",
        "starts",
        "Nothing moves until rounding does; a method that errs falls early.",
        "Both stay, as the start is exact.",
        "it stays",
        lambda: SimplePendulum(release_angle=math.pi),
        lambda result: float(np.max(np.abs(result["rod.angle"] - math.pi))),
        (1e-6, "angle, rad"),
        {"t_end": 2.0, "rtol": 1e-10},
    ),
    Case(
        "hundred thousand periods",
        "long",
        "Errors of the energy add up over 1e5 swings.",
        "Reduced, with Gauss's method: the error swings and does not grow.",
        "energy balance",
        lambda: SimplePendulum(release_angle=1.0),
        lambda result: float(np.max(np.abs(result.energy.total - result.energy.total[0]))) / 4.5,
        (1e-8, "energy over what is exchanged"),
        {"t_end": 2.0e5, "outputs": 2001, "samples": 1},
        {"reduced, Gauss of order 8": {"solver": "gauss", "order": 8, "step": 0.05}},
        quick=False,
    ),
)
