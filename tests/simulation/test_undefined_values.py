"""Runs that come to where a law has no value: they say when, whose and why, and hand over what came before."""

import math
from collections.abc import Iterable

import numpy as np
import pytest

import atwood
from atwood import Component, Load, Point, Scalar, Scene, SolveError, StartError, Vector, connector, force, simulate
from atwood.expr import ExternalFunction
from atwood.model.declare.laws import potential
from atwood.result.result import Result
from atwood_library import Force, Ground, PointMass, Spring

SOLVERS = ["ida", "ida-sundae", "explicit", "taylor", "auto"]


class Root(Component):
    """A push along x by the square root of x."""

    point: Point = connector(Point, "Where it acts.")

    @force
    def push(self) -> Iterable[Load]:
        """Return the load."""
        yield Load(self.point, Vector(atwood.sqrt(self.point.position.x), 0.0, 0.0))


class Well(Component):
    """An energy log(1 - x)."""

    point: Point = connector(Point, "Where it acts.")

    @potential
    def depth(self) -> Scalar:
        """Return the energy."""
        return atwood.log(1.0 - self.point.position.x)


def thrown(x: float = 0.5, vx: float = -1.0, **parts: Component) -> Scene:
    """Return 1 kg without weight that moves along x, with parts that act on it."""
    scene = Scene(gravity=0.0, t_end=2.0)
    bob = scene.add("bob", PointMass(mass=1.0))
    for name, part in parts.items():
        added = scene.add(name, part)
        scene.connect(added.point, bob.point)
    scene.start.update({"bob.position.x": x, "bob.position.z": 0.0, "bob.velocity.x": vx, "bob.velocity.z": 0.0})
    return scene


def failure(scene: Scene, solver: str, **options: object) -> tuple[SolveError, Result]:
    with pytest.raises(SolveError) as caught:
        simulate(scene, solver=solver, **options)  # type: ignore[arg-type]
    result = Result(caught.value.run)  # type: ignore[attr-defined]
    assert result.status == "failed"
    return caught.value, result


def fall_time() -> float:
    """Return when x'' = sqrt(x), x(0) = 1/2, x'(0) = -1 comes to zero: x'^2 = 1 + 4/3 (x^1.5 - 0.5^1.5)."""
    from scipy.integrate import quad

    return float(quad(lambda x: 1.0 / math.sqrt(1.0 + 4.0 / 3.0 * (x**1.5 - 0.5**1.5)), 0.0, 0.5)[0])


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_square_root_of_what_turns_negative(solver: str) -> None:
    error, result = failure(thrown(root=Root()), solver)
    assert error.where == "root"
    assert "the law 'push' has no value (the square root of -" in error.message
    assert "so that the run cannot go on" in error.message
    assert result.message == error.message
    assert result.time[-1] == pytest.approx(fall_time(), rel=1e-3)
    assert f"at t = {fall_time():.4f}" in error.message
    # What came before is right.
    x, v = result.array("bob.position.x"), result.array("bob.velocity.x")
    assert len(x) > 20
    assert np.max(np.abs(0.5 * v**2 - 2.0 / 3.0 * x**1.5 - 0.5 + 2.0 / 3.0 * 0.5**1.5)) < 1e-5


@pytest.mark.parametrize("solver", SOLVERS)
def test_an_input_whose_logarithm_ends(solver: str) -> None:
    push = Force(value=lambda t: atwood.log(1.0 - t))
    error, result = failure(thrown(x=0.0, vx=0.0, quiet=Force(), push=push), solver)
    assert error.where == "push"
    assert "the input 'value' has no value (the logarithm of -" in error.message or "of 0)" in error.message
    assert result.time[-1] == pytest.approx(1.0, abs=1e-3)
    # x'' = log(1 - t): x' = -(1 - t) log(1 - t) - t
    t, v = result.time[:-1], result.array("bob.velocity.x")[:-1]
    assert v == pytest.approx(-(1.0 - t) * np.log(1.0 - t) - t, abs=1e-5)


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_potential_that_ends(solver: str) -> None:
    # The force 1/(1 - x) grows without bound, and behind x = 1 there is no energy.
    error, result = failure(thrown(x=0.0, vx=1.0, well=Well()), solver)
    assert error.where == "well"
    assert "'depth' has no value" in error.message
    assert 0.5 < result.time[-1] < 1.0


@pytest.mark.parametrize("solver", ["ida", "explicit"])
def test_a_function_in_python_that_returns_no_number(solver: str) -> None:
    ends = ExternalFunction("ends", lambda x: x if x > 0.0 else math.nan, (ExternalFunction("slope", lambda x: 1.0),))

    class Called(Component):
        """A push by a function in Python."""

        point: Point = connector(Point, "Where it acts.")

        @force
        def push(self) -> Iterable[Load]:
            """Return the load."""
            yield Load(self.point, Vector(atwood.external(ends, self.point.position.x), 0.0, 0.0))

    with pytest.warns(UserWarning, match="ends"):
        error, _ = failure(thrown(called=Called()), solver)
    assert error.where == "called"
    assert "the function 'ends' of -" in error.message


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_spring_of_no_length_at_the_start(form: str) -> None:
    scene = Scene(t_end=1.0)
    ground, bob = scene.add("ground", Ground()), scene.add("bob", PointMass())
    spring = scene.add("spring", Spring(stiffness=1.0, natural_length=0.5))
    scene.connect(ground.frame, spring.a)
    scene.connect(spring.b, bob.point)
    scene.start.update({"bob.position.x": 0.0, "bob.position.z": 0.0, "bob.velocity.x": 0.0, "bob.velocity.z": 0.0})
    with pytest.raises(StartError, match=r"-0\.25 divided by 0") as caught:
        simulate(scene, form=form)
    assert caught.value.where == "spring"


@pytest.mark.parametrize("solver", SOLVERS)
def test_what_grows_without_bound_still_ends(solver: str) -> None:
    class Runaway(Component):
        """A push by the cube of the velocity: it grows without bound in a finite time, 1/2 s."""

        point: Point = connector(Point, "Where it acts.")

        @force
        def push(self) -> Iterable[Load]:
            """Return the load."""
            yield Load(self.point, Vector(self.point.velocity.x**3, 0.0, 0.0))

    error, result = failure(thrown(x=0.0, vx=1.0, runaway=Runaway()), solver, rtol=1e-6)
    assert result.time[-1] == pytest.approx(0.5, abs=1e-3)
    assert error.message


def test_what_came_before_a_failed_change_of_mode_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    from ..helpers.mechanisms import pendulum_on_a_string
    from ..helpers.tethers import Tether

    scene = pendulum_on_a_string(t_end=3.0, rope=Tether())
    scene.start.update({"bob.position.x": 0.0, "bob.position.z": -1.0, "bob.velocity.x": math.sqrt(3.5 * 9.81)})

    def refuse(*_: object) -> None:
        raise SolveError("it would move something", where="rope")

    monkeypatch.setattr("atwood.simulation.events.mode_change.enter_mode", refuse)
    with pytest.raises(SolveError, match="it would move something") as caught:
        simulate(scene)
    result = Result(caught.value.run)  # type: ignore[attr-defined]
    assert result.status == "failed"
    assert result.time[-1] == pytest.approx(0.482, abs=1e-3)
    assert result.events[-1].law == "goes_slack"
