"""Undefined values: which law of which part has none, at which of some states, and why."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import pytest

import atwood
from atwood import Component, Expression, Load, Point, Scalar, Scene, Vector, connector, force
from atwood.expr import Graph
from atwood.model.declare.laws import constraint, dissipation, potential
from atwood.simulation.dynamics import numerical_failure as undefined_values
from atwood.simulation.dynamics.numerical_failure import (
    UndefinedValue,
    find_undefined_value,
    states_ahead,
    undefined_value_at,
)
from atwood_library import Force, PointMass

# -- where it is looked ------------------------------------------------------------------------------------------------


def ahead(
    q: list[float], u: list[float], rates: tuple[list[float], list[float]], horizon: float = 10.0, t: float = 3.0
):
    state, derivatives = (tuple(np.array(one, dtype=float) for one in pair) for pair in ((q, u), rates))
    return states_ahead(t, state, derivatives, horizon)


def test_the_state_itself_comes_first_and_the_farthest_is_a_small_share_of_the_run() -> None:
    t, q, u = ahead([1.0], [2.0], ([2.0], [0.0]))
    assert (t[0], q[0, 0], u[0, 0]) == (3.0, 1.0, 2.0)
    assert t[-1] - 3.0 == pytest.approx(1e-4 * 10.0)
    assert t.shape == (98,)
    assert q.shape == u.shape == (1, 98)
    assert np.all(np.diff(t) >= 0.0)
    assert t[2] - t[1] < 1e-14
    near, far = (ahead([0.0], [1.0], ([1.0], [0.0]), horizon, t=0.0)[0] for horizon in (1.0, 100.0))
    assert np.allclose(far, 100.0 * near)
    assert near[1] == pytest.approx(1e-16, rel=1e-9, abs=0.0)


def test_coordinates_go_along_a_parabola_and_speeds_along_a_line() -> None:
    t, q, u = ahead([1.0, 5.0], [2.0, 0.0], ([2.0, 0.0], [-400.0, 0.0]), horizon=1e4, t=0.0)
    assert np.allclose(q[0], 1.0 + 2.0 * t - 200.0 * t * t)
    assert np.allclose(u[0], 2.0 - 400.0 * t)
    assert np.all(q[1] == 5.0)


def test_orientations_go_straight_ahead() -> None:
    """Four coordinates with three speeds: accelerations are of no coordinate."""
    t, q, _ = ahead([1.0, 0.0, 0.0, 0.0], [0.0] * 3, ([0.0, 2.0, 0.0, 0.0], [1e6] * 3), horizon=1e4, t=0.0)
    assert np.allclose(q[1], 2.0 * t)
    assert np.all(q[0] == 1.0)


def test_rates_that_are_not_known_move_nothing() -> None:
    _, q, u = ahead([1.0, 2.0], [3.0, 4.0], ([math.nan, 4.0], [math.inf, 5.0]))
    assert np.all(q[0] == 1.0)
    assert np.all(u[0] == 3.0)
    assert q[1, -1] > 2.0
    assert u[1, -1] > 4.0


# -- what is said ------------------------------------------------------------------------------------------------------


def test_it_is_said_in_words() -> None:
    one = UndefinedValue(1.25, "spring", "the law 'pull'", "the square root of -1")
    assert one.describe() == "at t = 1.25 the law 'pull' has no value (the square root of -1)"
    assert UndefinedValue(0.5, "spring", "the input 'value'", "").describe() == (
        "at t = 0.5 the input 'value' has no value"
    )


def node(make) -> Expression:
    graph = Graph()
    return make(graph.symbol("x"), graph.symbol("y"))


OPERATIONS = [
    (lambda x, y: x / y, [2.0, 0.0], math.inf, "2 divided by 0"),
    (lambda x, y: x**y, [-8.0, 0.333333], math.nan, "-8 to the power of 0.3333"),
    (lambda x, y: atwood.sqrt(x), [-0.25], math.nan, "the square root of -0.25"),
    (lambda x, y: atwood.log(x), [0.0], -math.inf, "the logarithm of 0"),
    (lambda x, y: x, [], math.nan, "x is nan"),
    (lambda x, y: x + y, [1e308, 1e308], math.inf, "add of 1e+308 and 1e+308 is inf"),
    (lambda x, y: atwood.exp(x), [1000.0], math.inf, "exp of 1000 is inf"),
]


@pytest.mark.parametrize(("make", "given", "value", "said"), OPERATIONS, ids=[one[-1] for one in OPERATIONS])
def test_why_an_operation_has_no_value(make, given, value, said) -> None:
    assert undefined_values._in_words(node(make), given, value) == said


# -- which law ---------------------------------------------------------------------------------------------------------


class Part(Component):
    """A part with one law on a point; what it is made of is given."""

    point: Point = connector(Point, "Where it acts.")


class RootForce(Part):
    @force
    def push(self) -> Iterable[Load]:
        """A push that ends at x = 0."""
        yield Load(self.point, Vector(1.0, 0.0, atwood.sqrt(self.point.position.x)))


class RootEnergy(Part):
    @potential
    def depth(self) -> Scalar:
        """An energy with a value at x = 0, where its force has none."""
        return atwood.sqrt(self.point.position.x)


class Drag(Part):
    @dissipation
    def drag(self) -> Scalar:
        """A Rayleigh function with a value at rest, where its force has none."""
        return atwood.sqrt(self.point.velocity.x)


class Rail(Part):
    @constraint(reaction="normal", unit="N", doc="Of the rail.")
    def rail(self) -> Scalar:
        """A rail that ends at x = 0."""
        return self.point.position.z - atwood.log(self.point.position.x)


class Switched(Part):
    modes = ("on", "off")

    @force(modes=("off",))
    def root(self) -> Iterable[Load]:
        """A push that acts in the other mode alone."""
        yield Load(self.point, Vector(atwood.sqrt(self.point.position.x), 0.0, 0.0))


class Harmless(Part):
    @force
    def push(self) -> Iterable[Load]:
        """A push that is a number, and one that always has a value."""
        yield Load(self.point, Vector(1.0, 0.0, self.point.position.x))


def state(scene: Scene, x: list[float], vx: float = 1.0, form: str = "dae"):
    """Return an assembly with states at which the bob is at some places along x, z at 0."""
    assembly = atwood.assemble(scene, form=form)
    names = [one.name for one in assembly.own_equations.names]
    q = np.zeros((len(names), len(x)))
    q[names.index("bob.position.x")] = x
    u = np.zeros((len(assembly.own_equations.speeds), len(x)))
    u[names.index("bob.position.x")] = vx
    return assembly, np.arange(float(len(x))), q, u


def with_parts(**parts: Component) -> Scene:
    scene = Scene(gravity=0.0)
    bob = scene.add("bob", PointMass(mass=1.0))
    for name, part in parts.items():
        added = scene.add(name, part)
        scene.connect(added.point, bob.point)
    scene.start.update({"bob.position.x": 1.0, "bob.velocity.x": 1.0})
    return scene


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_the_first_state_without_a_value_is_told(form: str) -> None:
    made = state(with_parts(root=RootForce()), [1.0, 0.5, -0.25, -1.0], form=form)
    found = find_undefined_value(*made)
    assert found == UndefinedValue(2.0, "root", "the law 'push'", "the square root of -0.25")
    assert find_undefined_value(*state(with_parts(root=RootForce()), [1.0, 0.5], form=form)) is None


def test_one_state_is_looked_at_like_many() -> None:
    assembly, _, q, u = state(with_parts(root=RootForce()), [-4.0])
    found = undefined_value_at(assembly, 7.0, q[:, 0], u[:, 0])
    assert found == UndefinedValue(7.0, "root", "the law 'push'", "the square root of -4")
    assert undefined_value_at(assembly, 7.0, -q[:, 0], u[:, 0]) is None


def test_of_two_parts_the_first_is_named() -> None:
    found = find_undefined_value(*state(with_parts(harmless=Harmless(), one=RootForce(), two=RootForce()), [-1.0]))
    assert found is not None
    assert found.part == "one"


def test_a_force_of_an_energy_may_have_no_value_where_the_energy_has_one() -> None:
    found = find_undefined_value(*state(with_parts(well=RootEnergy()), [1.0, 0.0]))
    assert found is not None
    assert (found.time, found.part, found.quantity) == (1.0, "well", "the force of the law 'depth'")
    assert "divided by 0" in found.reason
    found = find_undefined_value(*state(with_parts(well=RootEnergy()), [-1.0]))
    assert found is not None
    assert found.quantity == "the law 'depth'"


def test_a_force_of_a_rayleigh_function_is_its_derivative_by_velocities() -> None:
    found = find_undefined_value(*state(with_parts(drag=Drag()), [1.0], vx=0.0))
    assert found is not None
    assert (found.part, found.quantity) == ("drag", "the force of the law 'drag'")
    assert find_undefined_value(*state(with_parts(drag=Drag()), [1.0], vx=2.0)) is None


def test_a_constraint_without_a_value_is_named() -> None:
    found = find_undefined_value(*state(with_parts(rail=Rail()), [-1.0]))
    assert found == UndefinedValue(0.0, "rail", "the law 'rail'", "the logarithm of -1")


def test_a_law_that_does_not_act_in_the_mode_is_not_asked() -> None:
    assert find_undefined_value(*state(with_parts(one=Switched()), [-1.0])) is None
    assembly, t, q, u = state(with_parts(one=Switched()), [-1.0])
    other = assembly.other_mode({"one": "off"}, {})
    found = find_undefined_value(other, t, q, u)
    assert found is not None
    assert found.part == "one"


def test_an_input_without_a_value_is_named_by_itself() -> None:
    scene = with_parts(pull=Force(value=lambda t: atwood.sqrt(1.0 - t), direction=(1.0, 0.0, 0.0)))
    assembly, _, q, u = state(scene, [1.0, 1.0])
    found = find_undefined_value(assembly, np.array([0.5, 2.0]), q, u)
    assert found is not None
    assert (found.time, found.part, found.quantity) == (2.0, "pull", "the input 'value'")
    assert found.reason == "the square root of -1"


def test_a_function_in_python_that_raises_is_quoted() -> None:
    def broken(x: float) -> float:
        if x > 1.0:
            raise OverflowError("too far")
        return x

    class Python(Part):
        @force
        def push(self) -> Iterable[Load]:
            """A push that a function gives."""
            made = atwood.external(atwood.ExternalFunction("broken", broken), self.point.position.x)
            yield Load(self.point, Vector(made, 0.0, 0.0))

    assembly, _, q, u = state(with_parts(python=Python()), [2.0])
    quantities, program = undefined_values._law_values(assembly)
    assert [one.part for one in quantities] == ["python"] * len(quantities)
    said = undefined_values._reason(assembly, program, 0, (0.0, q[:, 0], u[:, 0]))
    assert said == "the function 'broken' raises OverflowError: too far"


def test_where_everything_has_a_value_there_is_no_reason() -> None:
    assembly, _, q, u = state(with_parts(root=RootForce()), [1.0])
    quantities, program = undefined_values._law_values(assembly)
    for row in range(len(quantities)):
        assert undefined_values._reason(assembly, program, row, (0.0, q[:, 0], u[:, 0])) == ""


def test_a_scene_without_laws_has_nothing_to_miss() -> None:
    assert find_undefined_value(*state(with_parts(), [1.0])) is None
    assert find_undefined_value(*state(with_parts(harmless=Harmless()), [-1.0])) is None
