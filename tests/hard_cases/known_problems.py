"""Problems whose values are known to many digits."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from atwood import Result, Scene
from atwood_library.scenes import (
    AndrewsSqueezer,
    Bricard,
    CarAxis,
    Chain,
    FlyballGovernor,
    FourBarRow,
    SimplePendulum,
)

from .case import Case
from .flexible_rod import QUANTITIES, flexible_slider_crank
from .known import Found, distance, path, times, vector

TO_EIGHT: Mapping[str, Any] = {"accuracy": 1e-8}
MEANING = "at all known times, in SI units; of what is above one, as a share of its largest value"
BOTH_FORMS = "Both, each as accurate as was asked; the reduced form has fewer unknowns, the dae form the forces."
TEST_SET = "Test Set for Initial Value Problem Solvers"


def case(
    problem: str,
    which: str,
    kind: str,
    scene: Callable[[], Scene],
    quantities: Mapping[str, Found],
    hard: str,
    source: str,
    **more: Any,
) -> Case:
    """Return a case whose values are known at some times."""
    until = more.pop("until", math.inf)
    when = times(problem, which, until)
    return Case(
        name=more.pop("name"),
        kind=kind,
        hard=hard,
        better=more.pop("better", BOTH_FORMS),
        source=source,
        scene=scene,
        asked=(more.pop("asked", 1e-6), more.pop("meaning", MEANING)),
        error=distance(problem, which, quantities, until),
        options={"outputs": when, "t_end": when[-1], **more.pop("options", TO_EIGHT)},
        **more,
    )


def pendulum(angle: float, rate: float = 0.0, gravity: float = 9.81) -> Scene:
    """Return a pendulum of 1 m and 1 kg."""
    scene = SimplePendulum()
    scene.set("gravity", gravity)
    scene.start.update({"rod.angle": angle, "rod.angular_velocity": rate})
    return scene


SWINGS = {
    "rest_0.1": (0.1, 0.0),
    "rest_pi/2": (math.pi / 2.0, 0.0),
    "rest_3.0": (3.0, 0.0),
    "rest_3.14": (3.14, 0.0),
    "rest_3.1415926": (3.1415926, 0.0),
    "rotating_om0_6.5": (0.0, 6.5),
}
BOB = {
    "x": path("bob.position.x"),
    "y": path("bob.position.z"),
    "vx": path("bob.velocity.x"),
    "vy": path("bob.velocity.z"),
    "tension": path("rod.tension"),
}
PERIOD_TWO = 13.7503716360407456549801915596211143958
"""Gravity with which a pendulum of 1 m let go level comes back after 2 s: 4 K(1/2)^2."""

PENDULUMS = (
    *(
        case(
            "pendulum_elliptic",
            which,
            "separatrices and chaos" if start[0] > 3.1 else "index and drift",
            lambda start=start: pendulum(*start),
            {"angle": path("rod.angle"), "rate": path("rod.angular_velocity")},
            "Errors of phase add up; near the top they grow by e each 0.3 s, at every passage.",
            "Jacobi's elliptic functions",
            name=f"pendulum from {start[0]:.8g} rad" if start[0] else "pendulum that goes round",
            until=10.0 if start[0] > 3.1 else math.inf,
            limits={"dae": 1e-4} if start[0] > 3.141 else {},
        )
        for which, start in SWINGS.items()
    ),
    case(
        "pendulum_index3",
        "A01_iftomm",
        "index and drift",
        lambda: pendulum(-math.pi / 2.0),
        BOB,
        "In Cartesian coordinates a pendulum is of index 3.",
        "IFToMM library, A01, where 5e-5 J are asked; values by elliptic functions",
        name="pendulum let go level",
    ),
    case(
        "pendulum_index3",
        "period2",
        "index and drift",
        lambda: pendulum(math.pi / 2.0, gravity=PERIOD_TWO),
        BOB,
        "It comes back to its start after each of 50 periods.",
        "the period is 2 s; 13.7503716373294544 m/s^2, given in places, is wrong from the tenth digit on",
        name="pendulum of period 2 s",
        asked=1e-5,
    ),
)

ANDREWS = {
    "beta": path("k1.angle"),
    "Theta": lambda result: result["k2.angle"] - result["k1.angle"],
    "gamma": path("k3.angle"),
    "delta": path("k5.angle"),
    "Phi": lambda result: result["k4.angle"] - result["k5.angle"] + 0.5 * math.pi,
    "epsilon": path("k7.angle"),
    "Omega": lambda result: result["k6.angle"] - result["k7.angle"],
    "beta_dot": path("k1.angular_velocity"),
    "gamma_dot": path("k3.angular_speed"),
    "delta_dot": path("k5.angular_speed"),
    "lambda3": path("hinge_e4.force.x"),
    "lambda4": path("hinge_e4.force.z"),
    "lambda5": path("hinge_e6.force.x"),
    "lambda6": path("hinge_e6.force.z"),
}
CAR_AXIS = {
    "xl": path("left.position.x"),
    "yl": path("left.position.z"),
    "xr": path("right.position.x"),
    "yr": path("right.position.z"),
    "xl_dot": path("left.velocity.x"),
    "yl_dot": path("left.velocity.z"),
    "xr_dot": path("right.velocity.x"),
    "yr_dot": path("right.velocity.z"),
    "lambda1": path("guide.side_force", -1.0),
}

STIFF = (
    case(
        "andrews",
        "squeezer",
        "fast and stiff",
        AndrewsSqueezer,
        ANDREWS,
        "Seven bodies that turn a hundred times a second, accelerations of 1e6 rad/s^2, three loops.",
        f"{TEST_SET}; Hairer and Wanner, Solving ODEs II, section VII.7. The published digits are those of a time that "
        "is 1e-12 s off: right to 1e-9 in angles, 1e-7 in rates, 1e-6 in forces",
        name="Andrews' squeezing mechanism",
        better="Reduced: its loops are solved by formulas, and two unknowns are left for explicit methods.",
        limits={"dae": 1e-5},
        quick=False,
    ),
    case(
        "car_axis",
        "axis",
        "fast and stiff",
        CarAxis,
        CAR_AXIS,
        "Springs beside which 0.5 g move, a rod that keeps its length, a road that shakes: index 3, driven.",
        f"{TEST_SET}, values to 1e-12",
        name="car axis",
        asked=1e-5,
    ),
    case(
        "iftomm_A05_flyball",
        "governor",
        "fast and stiff",
        FlyballGovernor,
        {
            "s": path("guide.displacement"),
            "beta": path("right_hinge.angle"),
            "s_dot": path("guide.speed"),
            "shaft_speed": path("bearing.angular_velocity"),
        },
        "Springs of 8e5 N/m with dampers of 4e4 N s/m on balls of 5 kg, in space: they relax ten thousand times as "
        "fast as the governor swings.",
        "IFToMM library, A05",
        name="flyball governor with stiff springs",
        better="Both by IDA; explicit methods would take a hundred times the steps.",
    ),
)


def whip(links: int) -> Mapping[str, Found]:
    """Return the quantities of a chain."""
    tip, middle = f"bob[{links - 1}]", f"bob[{links // 2 - 1}]"
    return {
        "tip_x": path(f"{tip}.position.x"),
        "tip_y": path(f"{tip}.position.z"),
        "tip_vx": path(f"{tip}.velocity.x"),
        "tip_vy": path(f"{tip}.velocity.z"),
        "mid_xy": vector(f"{middle}.position", "xz"),
    }


def third_hinge(result: Result) -> Any:
    """Return where the third hinge of Bricard's mechanism is, in the axes of the benchmark, with y up."""
    x, y, z = (2.0 * (result[f"rod2.position.{axis}"] - result[f"rod1.position.{axis}"]) for axis in "xyz")
    return np.stack([x, z, -y], axis=-1)


FLEXIBLE = (
    case(
        "slider_crank_flexible",
        "mechanism",
        "fast and stiff",
        flexible_slider_crank,
        QUANTITIES,
        "A rod of steel vibrates with up to 2e4 rad/s in a mechanism that is driven: bending of a millimetre, "
        "stretching of a hundredth of one.",
        f"{TEST_SET}, problem crank; own solution with 12 digits, since the published start has nine",
        name="slider-crank with an elastic rod",
        better="Reduced: formulas close the loop, and Taylor series follow the vibrations to twelve digits. The rod is "
        "one component, given by its Lagrangian.",
        options={"rtol": 1e-10},
        asked=1e-8,
        meaning="angle, place and elastic coordinates at all known times, rad and m",
    ),
)

LOOPS = (
    case(
        "iftomm_A02_fourbar",
        "N=2",
        "singular positions",
        lambda: FourBarRow(windows=2),
        {"angle": path("foot[0].angle", -1.0, 0.5 * math.pi), "rate": path("foot[0].angular_velocity", -1.0)},
        "All bars come into line ten times: there more can move than elsewhere, and the next path is not determined.",
        "IFToMM library, A02, where 0.1 J are asked; the motion is that of a compound pendulum",
        name="two four-bars through their singular positions",
        better="Both follow the motion through.",
        options={"rtol": 1e-10},
        asked=1e-4,
    ),
    case(
        "iftomm_A04_bricard",
        "mechanism",
        "redundancy",
        Bricard,
        {"P3": third_hinge},
        "Six bars and six hinges that move although a count of constraints says that nothing can.",
        "IFToMM library, A04; motion by one quadrature",
        name="Bricard's mechanism",
        better="Both drop one of the constraints that follow from the others, and say that its reaction is not unique.",
        quick=False,
    ),
    *(
        case(
            "nlink_chain",
            str(links),
            "index and drift",
            lambda links=links: Chain(links=links, mass=1.0, length=1.0),
            whip(links),
            "A chain let go level whips: a dense mass matrix, or as many multipliers as links.",
            "two independent solutions with 22 digits",
            name=f"chain of {links}, let go level",
            quick=links < 10,
        )
        for links in (5, 10)
    ),
)

CASES = (*PENDULUMS, *STIFF, *FLEXIBLE, *LOOPS)
