"""Functions of numbers of scenes against the equations that runs are made of, and by themselves."""

from typing import Any

import numpy as np
import pytest
from tests.helpers.runs import difference_quotient, moved, prepare

from atwood import (
    Component,
    ExternalFunction,
    Point,
    Scene,
    UsageError,
    assemble,
    connector,
    dynamics,
    external,
    force,
    select,
)
from atwood.errors import KernelEvaluationError
from atwood.forms.quantities import observer
from atwood.model.declare.law_results import Load
from atwood.theory.dynamics.dynamics import Dynamics
from atwood_library import Drag, Force, Ground, PointMass, Rod

from ...helpers.smooth import SMOOTH as SCENES


def around(name: str, form: str, count: int = 3) -> tuple[Dynamics, Any, list[tuple[Any, Any]]]:
    prepared = prepare(SCENES[name](), form)
    random = np.random.default_rng(4)
    states = [(prepared.q, prepared.u)]
    for _ in range(count - 1):
        states.append(tuple(one + 0.05 * random.standard_normal(len(one)) for one in (prepared.q, prepared.u)))
    return dynamics(prepared.assembly), prepared, states


@pytest.mark.sample(2)
@pytest.mark.parametrize(("name", "form"), [(name, form) for name in SCENES for form in ("reduced", "dae")])
def test_they_are_the_balance_of_forces(name: str, form: str) -> None:
    found, prepared, states = around(name, form)
    t = prepared.time
    many = [np.array([state[i] for state in states]) for i in range(2)]
    masses, biases = found.mass_matrix(many[0]), found.bias(*many)
    slopes, gammas = found.constraint_jacobian(many[0]), found.constraint_bias(*many)
    for k, (q, u) in enumerate(states):
        now = prepared.plan.balance.at(t, q, u)
        size = np.max(np.abs(now.mass))
        dense = np.asarray(now.mass.todense()) if hasattr(now.mass, "todense") else now.mass
        jacobian = np.asarray(now.jacobian.todense()) if hasattr(now.jacobian, "todense") else now.jacobian
        assert np.max(np.abs(found.mass_matrix(q) - dense)) <= 1e-13 * size
        assert found.bias(q, u) == pytest.approx(now.bias, rel=1e-12, abs=1e-12 * max(1.0, np.max(np.abs(now.bias))))
        assert found.constraint_jacobian(q) == pytest.approx(jacobian, rel=1e-12, abs=1e-12)
        assert found.constraint_bias(q, u) == pytest.approx(now.gamma, rel=1e-9, abs=1e-9)
        a = np.linspace(-1.0, 1.0, len(u))
        assert found.inverse_dynamics(q, u, a) == pytest.approx(dense @ a + now.bias, rel=1e-11, abs=1e-9 * size)
        # one state at a time or all of them: the same numbers
        assert np.array_equal(masses[k], found.mass_matrix(q))
        assert np.array_equal(biases[k], found.bias(q, u))
        assert np.array_equal(slopes[k], found.constraint_jacobian(q))
        assert np.array_equal(gammas[k], found.constraint_bias(q, u))


@pytest.mark.sample(2)
@pytest.mark.parametrize(("name", "form"), [(name, form) for name in SCENES for form in ("reduced", "dae")])
def test_forward_dynamics_undoes_inverse_dynamics(name: str, form: str) -> None:
    found, prepared, _ = around(name, form, 1)
    q, u = found.start()
    assert q == pytest.approx(prepared.q)
    expected, _ = prepared.plan.balance.accelerate(prepared.time, q, u, prepared.plan.kept)
    size = max(1.0, float(np.max(np.abs(expected))))
    a, multipliers = found.forward_dynamics(q, u), found.multipliers(q, u)
    assert a == pytest.approx(expected, rel=1e-8, abs=1e-8 * size)
    # M a + h = G^T lambda, and with a force tau on top of it that of the constraints changes with it
    held = found.constraint_jacobian(q).T @ multipliers
    forces = found.inverse_dynamics(q, u, a)
    assert forces == pytest.approx(held, abs=1e-9 * max(1.0, np.max(np.abs(held)), np.max(np.abs(found.bias(q, u)))))
    tau = np.linspace(0.5, 1.0, len(u))
    pushed = found.forward_dynamics(np.array([q, q]), np.array([u, u]), np.array([0.0 * tau, tau]))
    assert pushed[0] == pytest.approx(a, rel=1e-9, abs=1e-9 * size)
    assert found.constraint_jacobian(q) @ (pushed[1] - a) == pytest.approx(0.0, abs=1e-8 * size)
    work = (found.mass_matrix(q) @ (pushed[1] - a) - tau) @ (pushed[1] - a)  # constraints do none of it
    assert work == pytest.approx(0.0, abs=1e-7 * max(1.0, float(tau @ (pushed[1] - a))))


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    ("name", "path"),
    [
        ("double-pendulum", "bob2.position"),
        ("four-bar", "coupler.position"),
        ("pendulum-on-cart", "rod.angle"),
        ("double-pendulum-3d", "rod2.position"),
        ("lagrange-top", "top.position"),
        ("stewart-platform", "platform.position"),
    ],
)
def test_jacobians_of_quantities_are_their_derivatives(name: str, path: str) -> None:
    found, prepared, states = around(name, "reduced", 2)
    assembly = prepared.assembly
    paths = tuple(one for one in (f"{path}.x", f"{path}.y", f"{path}.z") if one in assembly.observables) or (path,)
    kernel = assembly.kernel(observer(assembly, paths))

    def values(q: Any) -> Any:
        n = len(found.speeds)
        return np.array(kernel([prepared.time], q, np.zeros(n), np.zeros(n), [0.0] * len(assembly.reactions))[0])

    for q, _ in states:
        by_differences = difference_quotient(
            lambda d, q=q: values(moved(prepared, q, d, np.zeros(len(d)), 1.0, prepared.time)),
            np.zeros(len(found.speeds)),
            step=1e-4,
        )
        mine = np.atleast_2d(found.jacobian(path, q))
        assert mine == pytest.approx(by_differences, abs=1e-6)
    several = found.jacobian(path, np.array([q for q, _ in states]))
    assert np.array_equal(several[1], found.jacobian(path, states[1][0]))


def test_an_angular_velocity_has_a_jacobian() -> None:
    found = dynamics(SCENES["lagrange-top"]())
    q, _ = found.start()
    turn = found.jacobian("top.angular_velocity", q)
    assert turn.shape == (3, 3)
    assert turn @ turn.T == pytest.approx(np.eye(3), abs=1e-14)  # from body axes to the world's


def test_arrays_that_are_given_are_filled() -> None:
    found = dynamics(SCENES["double-pendulum"]())
    q, u = np.array([0.3, -0.4]), np.array([1.0, 2.0])
    out, matrix = np.empty(2), np.empty((2, 2))
    for angle in (0.3, 0.9, -2.0):
        q[0] = angle  # the same arrays with other numbers
        assert found.bias(q, u, out=out) is out
        assert np.array_equal(out, found.bias(q.copy(), u.copy()))
        assert found.mass_matrix(q, out=matrix) is matrix
        assert np.array_equal(matrix, found.mass_matrix(q.copy()))
    with pytest.raises(UsageError, match="contiguous and of shape"):
        found.bias(q, u, out=np.empty(3))
    with pytest.raises(UsageError, match="has the shape"):
        found.bias(np.zeros(3), u)
    assert found.bias(np.zeros((0, 2)), np.zeros((0, 2))).shape == (0, 2)
    assert found.bias(np.zeros((2, 3, 2)), u).shape == (2, 3, 2)


def test_what_depends_on_time() -> None:
    scene = Scene(gravity=0.0)
    bob = scene.add("bob", PointMass(mass=2.0))
    push = scene.add("push", Force(value=lambda t: select(t < 1.0, 3.0 * t, 10.0), direction=(1.0, 0.0, 0.0)))
    scene.connect(bob.point, push.point)
    found = dynamics(scene)
    q, u = np.zeros(2), np.zeros(2)
    for t, expected in ((0.0, 0.0), (0.5, 0.75), (1.0, 5.0), (2.0, 5.0)):
        assert found.forward_dynamics(q, u, t=t)[0] == pytest.approx(expected)


class Wind(Component):
    point: Point = connector(Point, "The point.")

    @force
    def push(self) -> Any:
        """Return a force that a function of Python gives."""
        gust = ExternalFunction("gust", lambda x: 2.0 * x, (None,))
        return [Load(self.point, (external(gust, self.point.position.x), 0.0, 0.0))]


def test_functions_in_python_are_called_too() -> None:
    scene = Scene(gravity=0.0)
    bob, wind = scene.add("bob", PointMass(mass=2.0)), scene.add("wind", Wind())
    scene.connect(bob.point, wind.point)
    found = dynamics(scene)
    assert found.forward_dynamics([[3.0, 0.0], [5.0, 0.0]], [0.0, 0.0])[:, 0] == pytest.approx([3.0, 5.0])


def test_the_start_is_known_in_any_coordinates_of_an_orientation() -> None:
    made = [assemble(SCENES["heavy-top"](), orientation=one) for one in ("quaternion", "euler-zxz", "euler-zyx")]
    first, *others = ((found := dynamics(one)).forward_dynamics(*found.start()) for one in made)
    for a in others:
        assert a == pytest.approx(first, rel=1e-12, abs=1e-12)


def test_many_bodies_go_column_by_column() -> None:
    found = dynamics(SCENES["chain"](links=85))
    q, u = found.start()
    matrix = found.mass_matrix(q)
    a = np.random.default_rng(2).standard_normal(85)
    assert matrix @ a == pytest.approx(found.inverse_dynamics(q, u, a) - found.bias(q, u), rel=1e-9, abs=1e-9)
    assert found.inverse_dynamics(q, u, found.forward_dynamics(q, u)) == pytest.approx(0.0, abs=1e-8)


def test_questions_without_an_answer() -> None:
    found = dynamics(SCENES["double-pendulum"]())
    q, _ = found.start()
    with pytest.raises(UsageError, match="no such quantity") as caught:
        found.jacobian("bob2.positions", q)
    assert "bob2.position" in caught.value.advice
    with pytest.raises(UsageError, match="accelerations or reactions"):
        found.jacobian("rod1.tension", q)
    with pytest.raises(UsageError, match="not linear in the speeds"):
        found.jacobian("bob1.kinetic_energy", q)
    scene = Scene(gravity=0.0)
    bob, ground, rod = scene.add("bob", PointMass()), scene.add("ground", Ground()), scene.add("rod", Rod())
    drag = scene.add("drag", Drag())
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    scene.connect(bob.point, drag.point)
    pulled = dynamics(scene)
    assert np.all(np.isfinite(pulled.bias([0.3], [0.0])))
    with pytest.raises(KernelEvaluationError):
        pulled.bias([np.nan], [1.0])
