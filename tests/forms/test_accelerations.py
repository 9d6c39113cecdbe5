"""Accelerations written out as programs: their values, what they cost, and how the cost grows."""

import itertools
from collections.abc import Callable
from functools import partial

import numpy as np
import pytest

from atwood import Component, Model, Scene
from atwood.expr import Graph
from atwood.forms.accelerations import AccelerationProgram, acceleration_program
from atwood.mechanics.dynamics.augmented import (
    SymmetricSystem,
    back_substitute,
    difference,
    eliminate,
    fill_of,
    minimum_degree,
)
from atwood.pipeline import assemble
from atwood_library import (
    Cylindrical,
    FreeJoint,
    Ground,
    Link,
    Pivot,
    PointMass,
    RigidBody,
    Rod,
    Screw,
    Slider,
    Spherical,
    Spring,
    Universal,
    Weld,
)
from atwood_library.scenes import SCENES, Chain

from ..helpers.mechanisms import parallel_four_bar
from ..helpers.runs import nearby_states, prepare

METHODS = (None, "mass matrix", "joint forces", "leaves to root", "numeric")
UNCONSTRAINED = [name for name in SCENES if not assemble(SCENES[name]()).reduced.constraints]


def links(count: int) -> Scene:
    """Return a chain of rigid bodies on pivots."""
    scene = Scene(t_end=1.0)
    end = scene.add("ground", Ground()).frame
    for i in range(count):
        pivot, link = scene.add(f"pivot{i}", Pivot()), scene.add(f"link{i}", Link(length=0.5 + 0.1 * i, mass=1.0 + i))
        scene.connect(end, pivot.a)
        scene.connect(pivot.b, link.a)
        end = link.b
        scene.start.update({f"link{i}.angle": 0.3 * i - 1.0, f"link{i}.angular_velocity": 0.0})
    return scene


def heavy_rods(count: int) -> Scene:
    """Return a chain of uniform rods without masses between them."""
    scene = Scene(t_end=1.0)
    end = scene.add("ground", Ground()).frame
    for i in range(count):
        rod = scene.add(f"rod{i}", Rod(length=0.5 + 0.1 * i, mass=1.0 + i))
        scene.connect(end, rod.a)
        end = rod.b
        scene.start.update({f"rod{i}.angle": 0.3 * i + 0.2, f"rod{i}.angular_velocity": 0.0})
    return scene


def branches(generations: int) -> Scene:
    """Return a tree of point masses, two below each, with a spring across the first pair."""
    scene = Scene(t_end=1.0)
    ground = scene.add("ground", Ground())
    above = [ground.frame]
    number = 0
    for _ in range(generations):
        below = []
        for point in above:
            for _ in range(2):
                rod, bob = scene.add(f"rod{number}", Rod(length=1.0)), scene.add(f"bob{number}", PointMass())
                scene.connect(point, rod.a)
                scene.connect(rod.b, bob.point)
                scene.start.update({f"rod{number}.angle": 0.4 * number + 0.1, f"rod{number}.angular_velocity": 0.0})
                below.append(bob.point)
                number += 1
        above = below
    spring = scene.add("spring", Spring(stiffness=3.0, natural_length=0.2))
    scene.connect(scene["bob0"].point, spring.a)
    scene.connect(scene["bob1"].point, spring.b)
    return scene


def dumbbell() -> Scene:
    """Return two point masses on a rod that nothing holds, with a third on a rod below."""
    scene = Scene(t_end=1.0)
    a, b, c = (scene.add(name, PointMass()) for name in ("a", "b", "c"))
    first, second = scene.add("first", Rod(length=1.0)), scene.add("second", Rod(length=0.7))
    for rod, p, q in ((first, a, b), (second, b, c)):
        scene.connect(p.point, rod.a)
        scene.connect(rod.b, q.point)
    scene.start.update({f"a.{what}.{axis}": 0.1 for what in ("position", "velocity") for axis in "xz"})
    for name in ("first", "second"):
        scene.start.update({f"{name}.angle": 0.3, f"{name}.angular_velocity": 0.0})
    return scene


def on_a_slope() -> Scene:
    """Return a cart on a slope with a pendulum on it."""
    scene = Scene(t_end=1.0)
    ground, slider = scene.add("ground", Ground()), scene.add("slider", Slider(axis=(0.6, 0.0, 0.8)))
    cart, pivot = scene.add("cart", Link(mass=2.0, length=0.3)), scene.add("pivot", Pivot())
    link = scene.add("link", Link())
    for a, b in ((ground.frame, slider.a), (slider.b, cart.a), (cart.b, pivot.a), (pivot.b, link.a)):
        scene.connect(a, b)
    scene.start.update({"slider.displacement": 0.1, "link.angle": 0.3})
    return scene


def on_a_turning_guide() -> Scene:
    """Return a block on a guide that turns, with a bob on a rod below it."""
    scene = Scene(t_end=1.0)
    ground, pivot, link = scene.add("ground", Ground()), scene.add("pivot", Pivot()), scene.add("link", Link())
    slider, block = scene.add("slider", Slider(axis=(0.6, 0.0, 0.8))), scene.add("block", Link(mass=2.0, length=0.3))
    rod, bob = scene.add("rod", Rod(length=0.4)), scene.add("bob", PointMass())
    for a, b in (
        (ground.frame, pivot.a),
        (pivot.b, link.a),
        (link.b, slider.a),
        (slider.b, block.a),
        (block.b, rod.a),
        (rod.b, bob.point),
    ):
        scene.connect(a, b)
    scene.start.update({"slider.displacement": 0.1, "link.angle": 0.3, "rod.angle": 1.0})
    return scene


def driven() -> Scene:
    """Return a double pendulum below a mass that moves as prescribed."""
    scene = SCENES["driven-pendulum"]()
    assert isinstance(scene, Scene)
    extra, rod, bob = (
        scene.add("extra", PointMass()),
        scene.add("rod2", Rod(length=0.3)),
        scene.add("bob2", PointMass()),
    )
    for a, b in ((scene["drive"].b, extra.point), (scene["bob"].point, rod.a), (rod.b, bob.point)):
        scene.connect(a, b)
    scene.start.update({"rod2.angle": 0.2, "rod2.angular_velocity": 0.0})
    return scene


def bodies_in_space(joint: Callable[[], Component], count: int) -> Scene:
    """Return a chain of rigid bodies in space, each on a joint at the end of the one before."""
    scene = Scene(space="space", t_end=1.0)
    end = scene.add("ground", Ground()).frame
    for i in range(count):
        placed, weld = scene.add(f"joint{i}", joint()), scene.add(f"weld{i}", Weld(displacement=(0.1, 0.2, -0.8)))
        body = scene.add(f"body{i}", RigidBody(mass=1.0 + i, center=(0.1, 0.0, -0.4), moments=(0.2, 0.25, 0.1)))
        for a, b in ((end, placed.a), (placed.b, body.frame), (body.frame, weld.a)):
            scene.connect(a, b)
        end = weld.b
    return scene


IN_SPACE: dict[str, Callable[[], Component]] = {
    "balls": Spherical,
    "hinges": lambda: Pivot(axis=(0.3, 1.0, -0.2)),
    "universal joints": Universal,
    "cylinders": lambda: Cylindrical(axis=(1.0, 0.2, 0.5)),
    "screws": lambda: Screw(axis=(0.1, 0.2, 1.0), pitch=0.7),
    "free joints": FreeJoint,
}

MADE: dict[str, Callable[[], Model]] = {
    **{name: partial(bodies_in_space, joint, 3) for name, joint in IN_SPACE.items()},
    **{name: SCENES[name] for name in UNCONSTRAINED},
    "three links": lambda: links(3),
    "ten links": lambda: links(10),
    "heavy rods": lambda: heavy_rods(4),
    "branches": lambda: branches(3),
    "dumbbell": dumbbell,
    "on a slope": on_a_slope,
    "driven": driven,
    "on a turning guide": on_a_turning_guide,
    "chain of three": lambda: Chain(links=3),
}


def made_for(scene: Model, method: str | None = None) -> AccelerationProgram:
    found = acceleration_program(assemble(scene), method)  # type: ignore[arg-type]
    assert found is not None
    return found


def operations(scene: Model, method: str | None = None) -> int:
    return sum(made_for(scene, method).program.operations.values())


@pytest.mark.sample(16)
@pytest.mark.parametrize("name", MADE)
def test_values_are_those_of_the_balance_of_forces(name: str) -> None:
    prepared = prepare(MADE[name](), "reduced")
    states = [(prepared.q, prepared.u), *nearby_states(prepared, 4)]
    for method in METHODS:
        made = acceleration_program(prepared.assembly, method)  # type: ignore[arg-type]
        if made is None:
            assert method in ("joint forces", "leaves to root")
            continue
        assert method in (None, made.method)
        kernel = prepared.assembly.kernel(made.program)
        for q, u in states:
            t = prepared.time + 0.37
            expected, _ = prepared.plan.balance.accelerate(t, q, u)
            found = np.array(kernel([t], q, u)[-1])
            assert np.max(np.abs(found - expected)) <= 1e-11 * max(1.0, float(np.max(np.abs(expected))))


@pytest.mark.parametrize(
    "name", ["chain", "ten links", "heavy rods", "branches", "dumbbell", "on a turning guide", *IN_SPACE]
)
def test_trees_are_eliminated_in_the_bodies_coordinates(name: str) -> None:
    assert acceleration_program(assemble(MADE[name]()), "leaves to root") is not None


def test_constraints_that_are_left_have_no_such_program() -> None:
    for scene in (SCENES["four-bar"](), SCENES["slider-crank"](), parallel_four_bar()):
        assert acceleration_program(assemble(scene)) is None


@pytest.mark.sample(4)
@pytest.mark.parametrize(
    ("make", "method", "each"),
    [
        (lambda n: Chain(links=n), "joint forces", 20),
        (lambda n: Chain(links=n), "leaves to root", 53),
        (links, "leaves to root", None),
        (partial(bodies_in_space, Spherical), "joint forces", None),
        (partial(bodies_in_space, Spherical), "leaves to root", None),
        (partial(bodies_in_space, IN_SPACE["hinges"]), "leaves to root", None),
        (heavy_rods, "leaves to root", None),
    ],
)
def test_each_link_costs_the_same(make: Callable[[int], Scene], method: str, each: int | None) -> None:
    counts = [operations(make(n), method) for n in (6, 12, 18, 24)]
    steps = {b - a for a, b in itertools.pairwise(counts)}
    assert len(steps) == 1
    assert each is None or steps == {6 * each}


def test_a_long_chain_is_solved_by_joint_forces() -> None:
    # by hand: sine and cosine of the angle from the neighbour (3), the tension by a tridiagonal system (9), of which
    # the right-hand side takes 2 and the coupling 1, and the acceleration from two neighbours' tensions (5)
    made = made_for(Chain(links=40))
    assert made.method == "joint forces"
    assert sum(made.program.operations.values()) <= 40 * 20


def test_few_coordinates_cost_what_they_cost_by_hand() -> None:
    # double pendulum by hand: two sines, sine and cosine of the difference, the difference, two squares, two weights,
    # two centrifugal terms with their sums, and a system of two unknowns (9)
    by_hand = 4 + 1 + 2 + 2 + 4 + 9
    assert operations(SCENES["double-pendulum"](), "mass matrix") <= 1.2 * by_hand
    assert operations(SCENES["double-pendulum"]()) <= 1.35 * by_hand  # with two calls of the library, not three
    assert operations(SCENES["simple-pendulum"]()) <= 3
    assert operations(SCENES["mass-spring-chain"]()) <= 12


def test_elimination_solves_systems_in_any_safe_order() -> None:
    random = np.random.default_rng(1)
    graph = Graph()
    n, m = 4, 2
    root = random.standard_normal((n, n))
    mass, slope = root @ root.T + np.eye(n), random.standard_normal((m, n))
    right = random.standard_normal(n + m)
    entries = {(i, j): graph.constant(mass[i, j]) for i in range(n) for j in range(i, n)}
    entries |= {(i, n + k): graph.constant(slope[k, i]) for i in range(n) for k in range(m)}
    system = SymmetricSystem(entries, [graph.constant(x) for x in right], [1] * n + [-1] * m)
    whole = np.block([[mass, -slope.T], [slope, np.zeros((m, m))]])
    for order in ([0, 1, 2, 3, 4, 5], [3, 2, 5, 1, 4, 0]):
        known: dict[int, object] = {}
        for step in reversed(eliminate(system, order)):
            known[step.unknown] = back_substitute(step, known)  # type: ignore[arg-type]
        found = [float(known[i]) for i in range(n + m)]  # type: ignore[arg-type]
        assert np.allclose(found, np.linalg.solve(whole, right), rtol=1e-10, atol=1e-12)


def test_minimum_degree_adds_nothing_to_a_tree() -> None:
    star = [(0, i) for i in range(1, 6)]
    order = minimum_degree(star, 6)
    assert order.index(0) >= 4
    assert fill_of(star, order) == 5 * 4 < fill_of(star, range(6))


def test_differences_lose_what_both_sides_have() -> None:
    graph = Graph()
    x, y, z, w = (graph.symbol(name) for name in "xyzw")
    assert difference((x + y) + z, x + y) is z
    assert difference(-(x + y), -(x + y + z)) is z
    assert difference(x, y) is x - y
    assert difference((x - y) + w, z - y) is (x + w) - z
    assert difference(x + y, y + x).is_zero
