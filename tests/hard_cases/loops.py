"""Closed loops: singular positions, dead centres, redundancy."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from atwood import Result, Scene
from atwood_library import Ground, Pivot, PointOnPlane, RigidBody, Weld
from atwood_library.scenes import (
    DoubleCardanTwice,
    FourBar,
    FourBarRow,
    RigidBodies,
    ScottRussellLift,
    SliderCrank,
    Strandbeest,
)

from ..references.pendulum import FourBarRow as Row, PlanePendulum
from .case import Case
from .measures import SECOND, estimated, formula, largest, open_loops

ROW = "All bars come into line twice a turn: there more can move than anywhere else, and the path is not determined."


def row(windows: int, t_end: float, space: str = "plane", **more: Any) -> Case:
    """Return a row of four-bars, which moves as one compound pendulum."""
    return Case(
        name=f"row of {windows} four-bar linkages{' in space' if space == 'space' else ''} for {t_end:g} s",
        kind="singular positions",
        hard=ROW + (" In space three constraints of each loop follow from the others." if space == "space" else ""),
        better="Dae: explicit steps end on the constraints, and most go over a singular position without one there.",
        source="IFToMM library, A02: a compound pendulum, by elliptic functions",
        scene=lambda: FourBarRow(windows=windows, space=space),
        asked=(1e-3, "angle of the first crank at all outputs, rad"),
        error=formula("foot[0].angle", lambda t: 0.5 * math.pi - Row(windows).crank_angle(t)),
        options={"rtol": 1e-9, "t_end": t_end},
        **more,
    )


def crank_of_equal_lengths(t: NDArray[np.float64], rate: float) -> NDArray[np.float64]:
    """Return the crank's angle of a slider-crank whose crank and rod have the same length, 1 m.

    The rod leans as much as the crank, so that the motion is that of one angle q with the inertia M(q) and the weight's
    moment: M q'' + M'/2 q'^2 + V' = 0.
    """
    crank, rod, piston, g = 0.25, 0.5, 0.5, 9.81

    def rates(_: float, y: Any) -> list[float]:
        q, u = y
        s, c = math.sin(q), math.cos(q)
        inertia = crank / 3.0 + rod * (2.25 * s * s + 0.25 * c * c + 1.0 / 12.0) + piston * 4.0 * s * s
        slope = (4.0 * rod + 8.0 * piston) * s * c
        return [u, -(0.5 * slope * u * u + g * 0.5 * (crank + rod) * c) / inertia]

    found = solve_ivp(rates, (0.0, float(t[-1])), [0.5, rate], method="DOP853", rtol=1e-13, atol=1e-13, t_eval=t)
    return np.asarray(found.y[0])


def equal_slider_crank() -> Scene:
    """Return a slider-crank that folds up twice a turn."""
    scene = SliderCrank(crank_length=1.0, rod_length=1.0)
    scene.start.update({"crank.angle": 0.5, "crank.angular_velocity": 8.0})
    scene.guess["connecting_rod.angle"] = -0.5
    return scene


def parallelogram() -> Scene:
    """Return a parallelogram that goes round through its positions in line."""
    scene = FourBar(crank_length=1.0, coupler_length=2.0, rocker_length=1.0, frame_length=2.0)
    scene.start.update({"crank.angle": 1.0, "crank.angular_velocity": 9.0})
    scene.guess.update({"coupler.angle": 0.0, "rocker.angle": 1.0})
    return scene


def parallelogram_angle(t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the crank's angle of `parallelogram`: a compound pendulum, counted from where it hangs."""
    crank, coupler, rocker = 0.1, 0.25, 0.2
    kappa = 9.81 * (0.5 * (crank + rocker) + coupler) / ((crank + rocker) / 3.0 + coupler)
    return PlanePendulum(kappa, 1.0 + 0.5 * math.pi, 9.0).angle(t) - 0.5 * math.pi


def triple_rocker() -> Scene:
    """Return a four-bar none of whose links turns fully: a dead centre in each swing."""
    scene = FourBar(crank_length=1.2, coupler_length=1.0, rocker_length=1.2, frame_length=2.0)
    scene.start.update({"crank.angle": 1.0, "crank.angular_velocity": 2.0})
    scene.guess.update({"coupler.angle": 0.0, "rocker.angle": 2.1})
    return scene


def rotation(axis: tuple[float, float, float], angle: float) -> NDArray[np.float64]:
    """Return the matrix of a rotation (Rodrigues)."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross  # type: ignore[no-any-return]


CRANK, COUPLER, ROCKER, FRAME = 1.0, 2.5, 2.0, 2.5


def turned_four_bar(turn: NDArray[np.float64]) -> Scene:
    """Return `FourBar` without weight from joints of space, in another plane."""
    scene = Scene(space="space", gravity=0.0, t_end=3.0)
    along, normal = tuple(map(float, turn @ [1.0, 0.0, 0.0])), tuple(map(float, turn @ [0.0, -1.0, 0.0]))
    left, right = scene.add("left", Ground()), scene.add("right", Ground(position=tuple(FRAME * a for a in along)))
    pivots = [scene.add(f"pivot{k}", Pivot(axis=normal)) for k in range(1, 5)]
    outer = np.outer(along, along)
    bodies, ends = {}, {}
    for name, length, mass in (("crank", CRANK, 0.1), ("coupler", COUPLER, 0.25), ("rocker", ROCKER, 0.2)):
        tensor = mass * length**2 / 12.0 * (np.eye(3) - outer) + 1e-3 * outer
        bodies[name] = scene.add(
            name,
            RigidBody(
                mass=mass,
                center=tuple(0.5 * length * a for a in along),
                moments=tuple(map(float, np.diag(tensor))),
                products=(float(tensor[0, 1]), float(tensor[0, 2]), float(tensor[1, 2])),
            ),
        )
        ends[name] = scene.add(f"{name}_end", Weld(displacement=tuple(length * a for a in along)))
        scene.connect(bodies[name].frame, ends[name].a)
    scene.connect(left.frame, pivots[0].a)
    scene.connect(pivots[0].b, bodies["crank"].frame)
    scene.connect(ends["crank"].b, pivots[1].a)
    scene.connect(pivots[1].b, bodies["coupler"].frame)
    scene.connect(right.frame, pivots[3].a)
    scene.connect(pivots[3].b, bodies["rocker"].frame)
    scene.connect(ends["coupler"].b, pivots[2].a)
    scene.connect(pivots[2].b, ends["rocker"].b)
    scene.start.update({"pivot1.angle": 1.0, "pivot1.angular_velocity": 2.0})
    scene.guess.update({"pivot2.angle": 0.3 - 1.0, "pivot4.angle": 1.9, "pivot3.angle": 1.6})
    return scene


def flat_four_bar(t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the angle of the same crank by the equation of one angle, closed by the law of cosines."""

    def inertia(q: float) -> float:
        x, y = CRANK * math.cos(q), CRANK * math.sin(q)
        ex, ey = FRAME - x, -y
        square = ex * ex + ey * ey
        along = 0.5 * ((COUPLER**2 - ROCKER**2) / square + 1.0)
        across = math.sqrt(COUPLER**2 / square - along * along)
        bx, by = along * ex - across * ey, along * ey + across * ex
        cx, cy = bx - ex, by - ey
        det = bx * cy - by * cx
        k, n = (y * cx - x * cy) / det, (y * bx - x * by) / det
        v, w = -y - 0.5 * k * by, x + 0.5 * k * bx
        turning = 0.25 * COUPLER**2 / 12.0 * k * k + 0.2 * ROCKER**2 / 3.0 * n * n
        return 0.1 * CRANK**2 / 3.0 + 0.25 * (v * v + w * w) + turning

    constant = 2.0 * math.sqrt(inertia(1.0))
    found = solve_ivp(
        lambda _, q: [constant / math.sqrt(inertia(float(q[0])))],
        (0.0, float(t[-1])),
        [1.0],
        method="DOP853",
        rtol=1e-13,
        atol=1e-13,
        t_eval=t,
    )
    return np.asarray(found.y[0])


TURNS: Mapping[str, NDArray[np.float64]] = {
    "upright": np.eye(3),
    "lying": rotation((1.0, 0.0, 0.0), 0.5 * math.pi),
    "askew": rotation((0.3, -0.8, 0.5), 1.1),
}

SINGULAR = (
    row(1, 5.0),
    row(10, 5.0, quick=False),
    row(2, 3.0, "space", quick=False),
    row(40, 20.0, quick=False),
    Case(
        name="equal-length slider-crank through its dead centre",
        kind="singular positions",
        hard="When crank and rod stand on each other the piston is at the crank's bearing, and could stay there.",
        better="Both follow the motion through.",
        source="Lagrange's equation of its one angle",
        scene=equal_slider_crank,
        asked=(1e-4, "angle of the crank at all outputs, rad"),
        error=formula("crank.angle", lambda t: crank_of_equal_lengths(t, 8.0)),
        options={"rtol": 1e-10, "t_end": 3.0},
    ),
    Case(
        name="parallelogram that may flip",
        kind="singular positions",
        hard="In line it could go on as an antiparallelogram.",
        better="Both follow the motion through.",
        source="a compound pendulum, by elliptic functions",
        scene=parallelogram,
        asked=(1e-4, "angle of the crank at all outputs, rad"),
        error=formula("crank.angle", parallelogram_angle),
        options={"rtol": 1e-10, "t_end": 3.0},
    ),
    Case(
        name="four-bar with a dead centre in each swing",
        kind="singular positions",
        hard="No link turns fully: at each end of a swing the angle that drives the others must change.",
        better="Reduced: formulas solve the loop, and the driving angle changes unseen.",
        source="a second solution",
        scene=triple_rocker,
        asked=(1e-6, SECOND),
        error=estimated,
        options={"accuracy": 1e-8, "t_end": 5.0},
    ),
)


def five_masses() -> Callable[[Result], float]:
    """Return the largest distance of the five masses from where a rigid body would take them."""
    places = RigidBodies().places()

    def along(n: int, axis: str) -> Callable[[Any], Any]:
        x, y, z = places[n]
        turns: Mapping[str, Callable[[Any], Any]] = {
            "x": lambda t: x * np.cos(3.0 * t) - y * np.sin(3.0 * t),
            "y": lambda t: x * np.sin(3.0 * t) + y * np.cos(3.0 * t),
            "z": lambda t: z + 0.0 * t,
        }
        return turns[axis]

    return largest(
        *(formula(f"frame.mass{n}.position.{axis}", along(n, axis)) for n in range(len(places)) for axis in "xyz")
    )


def table() -> Scene:
    """Return a table on four legs that glides and turns on a smooth floor."""
    scene = Scene(space="space", t_end=2.0)
    top = scene.add("top", RigidBody(mass=20.0, moments=(2.0, 2.0, 3.0)))
    floor = scene.add("floor", Ground())
    for k, (x, y) in enumerate(((1.0, 0.5), (-1.0, 0.5), (-1.0, -0.5), (1.0, -0.5))):
        leg, foot = scene.add(f"leg{k}", Weld(displacement=(x, y, -0.7))), scene.add(f"foot{k}", PointOnPlane())
        scene.connect(top.frame, leg.a)
        scene.connect(floor.frame, foot.a)
        scene.connect(foot.b, leg.b)
    scene.start.update({"top.position.x": 0.0, "top.position.y": 0.0, "top.velocity.x": 0.4, "top.velocity.y": -0.2})
    scene.start.update({"top.phi": 0.0, "top.theta": 0.0, "top.psi": 0.0, "top.spin.z": 2.0})
    scene.guess.update({"top.position.z": 0.7, "top.spin.x": 0.0, "top.spin.y": 0.0})
    return scene


def table_error(result: Result) -> float:
    """Return how far its place, its direction and the forces of its legs are from what they must be."""
    t = result.time
    forces = sum(np.asarray(result[f"foot{k}.normal_force"]) for k in range(4))
    apart = [
        result["top.position.x"] - 0.4 * t,
        result["top.position.y"] + 0.2 * t,
        result["top.x_axis.x"] - np.cos(2.0 * t),
        forces / (20.0 * 9.81) - 1.0,
        result["foot0.normal_force"] / (5.0 * 9.81) - 1.0,
    ]
    return float(np.max(np.abs(apart)))


def shaft_error(result: Result, bearing: int) -> float:
    """Return by how much a shaft that is parallel to the first turns otherwise, rad."""
    return float(np.max(np.abs(result[f"bearing{bearing}.angle"] - result["bearing1.angle"])))


REDUNDANT = (
    *(
        Case(
            name=f"four-bar of spatial joints, {name}",
            kind="redundancy",
            hard="Hinges of space hold each other parallel: three of its constraints follow from the others, unless "
            "rounding says that they contradict.",
            better="Reduced: the loop is found to lie in a plane, and formulas solve it.",
            source="the equation of its one angle",
            scene=lambda turn=turn: turned_four_bar(turn),
            asked=(1e-6, "angle of the crank at all outputs, rad"),
            error=formula("pivot1.angle", flat_four_bar),
            options={"rtol": 1e-10},
            quick=name == "askew",
        )
        for name, turn in TURNS.items()
    ),
    Case(
        name="five masses on ten rods",
        kind="redundancy",
        hard="One rod more than needed holds five masses together; which tension it has nothing says.",
        better="Both.",
        source="they turn evenly as a rigid body",
        scene=RigidBodies,
        asked=(1e-5, "places at all outputs, m"),
        error=five_masses(),
        options={"rtol": 1e-10},
    ),
    Case(
        name="two double Cardan shafts side by side",
        kind="redundancy",
        hard="Two paths of shafts and four universal joints drive the same shaft.",
        better="Both.",
        source="output angle = input angle",
        scene=DoubleCardanTwice,
        asked=(1e-7, "angles, rad, and by a second solution"),
        error=largest(estimated, lambda result: max(shaft_error(result, k) for k in (2, 3))),
        options={"rtol": 1e-10},
        quick=False,
    ),
    Case(
        name="four-legged table",
        kind="redundancy",
        hard="Three legs would do: how its weight is shared no law of rigid bodies says.",
        better="Both: the shares of least size are told, and that they are not unique.",
        source="it glides and turns evenly, and its legs carry its weight",
        scene=table,
        asked=(1e-7, "places, directions and shares"),
        error=table_error,
        options={"rtol": 1e-10},
    ),
    Case(
        name="Scott Russell lift",
        kind="redundancy",
        hard="A straight-line linkage: its foot and its head are guided by the same law twice.",
        better="Both.",
        source="a second solution",
        scene=ScottRussellLift,
        asked=(1e-7, SECOND),
        error=estimated,
        options={"rtol": 1e-10},
    ),
    Case(
        name="strandbeest",
        kind="redundancy",
        hard="Two of Jansen's legs on one crank: nine loops, one degree of freedom.",
        better="Reduced: all nine loops are solved by formulas.",
        source="closure of all loops",
        scene=Strandbeest,
        asked=(1e-10, "open loops over the extent of the scene"),
        error=open_loops,
        options={"rtol": 1e-10},
    ),
)

CASES = (*SINGULAR, *REDUNDANT)
