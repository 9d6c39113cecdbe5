"""Examples of Modelica.Mechanics.MultiBody.Examples.Elementary: bodies on springs and dampers."""

from __future__ import annotations

from collections.abc import Iterable

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
    derivative,
    dot,
    force,
    norm,
    parameter,
    solve_linear,
    state,
)
from atwood_library import (
    Damper,
    Ground,
    Pivot,
    PositionSensor,
    RigidBody,
    Slider,
    Spherical,
    Spring,
    Universal,
)

from .building import WORLD, Example, bar, box, guides, hinges, made, orientation, rotation, vector

__all__ = ["EXAMPLES"]

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


EXAMPLES = {
    "FreeBody": Example(
        free_body,
        {
            **vector("body.body.frame_a.r_0", "place.position"),
            **vector("body.body.w_a", "body.solid.spin"),
            **vector("body.v_0", "place.velocity"),
        },
    ),
    "InitSpringConstant": Example(init_spring_constant, hinges("rev")),
    "LineForceWithTwoMasses": Example(line_force_with_two_masses, hinges("revolute1", "revolute2")),
    "PendulumWithSpringDamper": Example(pendulum_with_spring_damper, hinges("revolute") | guides("prismatic")),
    "SpringDamperSystem": Example(
        spring_damper_system,
        {
            **vector("body1.frame_a.r_0", "place.position"),
            **vector("body1.v_0", "place.velocity"),
            **vector("body1.w_a", "body1.spin"),
            **guides("p2"),
        },
    ),
    "SpringMassSystem": Example(spring_mass_system, guides("p1", "p2")),
    "SpringWithMass": Example(
        spring_with_mass,
        {
            **vector("body.frame_a.r_0", "body.position"),
            **vector("body.v_0", "body.velocity"),
            **vector("body.w_a", "body.spin"),
        },
    ),
    "ThreeSprings": Example(
        three_springs,
        {
            **vector("body1.frame_a.r_0", "place.position"),
            **vector("body1.v_0", "place.velocity"),
            **vector("body1.w_a", "body1.spin"),
        },
    ),
}
"""By the name of the model."""
