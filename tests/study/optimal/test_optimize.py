"""Motions that cost least: against formulas, and against the runs that come of them."""

import math

import numpy as np
import pytest

from atwood import AtwoodError, Scene, SolveError, optimize
from atwood.study.optimal import optimize as module
from atwood.study.optimal.collocation import gauss
from atwood.study.optimal.interior_point import least
from atwood_library import Force, Ground, Link, Pivot, PointMass, Pulse, Rod, Slider
from atwood_library.scenes import BouncingBall, CartPole

SQUARE = {"objective": lambda seen: seen["push.value"] ** 2, "inputs": ["push.value"]}
AT_REST = {"rail.displacement": 1.0, "rail.speed": 0.0}


def block(mass=1.0):
    scene = Scene(t_end=1.0)
    ground, rail = scene.add("ground", Ground()), scene.add("rail", Slider())
    body, push = scene.add("block", PointMass(mass=mass)), scene.add("push", Force())
    scene.connect(ground.frame, rail.a)
    scene.connect(rail.b, body.point)
    scene.connect(body.point, push.point)
    return scene


def cart_pole():
    scene = block()
    scene.set("t_end", 2.0)
    hinge = scene.add("hinge", Pivot())
    pole = scene.add("pole", Link(length=0.5, mass=0.3, center=0.5, moment=0.0))
    scene.connect(scene["rail"].b, hinge.a)
    scene.connect(hinge.b, pole.a)
    scene.start.update(
        {"rail.displacement": 0.0, "rail.speed": 0.0, "hinge.angle": -0.5 * math.pi, "hinge.angular_velocity": 0.0}
    )
    return scene


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_least_squared_force(form):
    found = optimize(block(), **SQUARE, end=AT_REST, form=form)
    time, force = found.inputs["push.value"]
    assert found.cost == pytest.approx(12.0, abs=1e-9)
    assert force == pytest.approx(6.0 - 12.0 * time, abs=1e-8)
    assert found.result["rail.displacement"][-1] == pytest.approx(1.0, abs=1e-9)
    assert found.error < 1e-9


@pytest.mark.parametrize(("mass", "distance", "duration"), [(1e3, 1.0, 1.0), (1e-3, 1e-4, 10.0), (2.0, 1e3, 0.5)])
def test_does_not_depend_on_sizes(mass, distance, duration):
    found = optimize(block(mass), **SQUARE, end={"rail.displacement": distance, "rail.speed": 0.0}, t_end=duration)
    assert found.cost == pytest.approx(12.0 * (mass * distance) ** 2 / duration**3, rel=1e-7)


def test_least_time_of_a_bounded_force():
    about = {"inputs": {"push.value": (-1.0, 1.0)}, "end": AT_REST, "t_end": (0.5, 5.0)}
    found = optimize(block(), "time", **about, between="held")
    assert found.duration == pytest.approx(2.0, abs=1e-7)
    assert np.abs(found.inputs["push.value"][1]) == pytest.approx(1.0, abs=1e-6)
    assert found.duration <= optimize(block(), "time", **about).duration


def test_bound_along_the_motion():
    found = optimize(block(), **SQUARE, end=AT_REST, bounds={"rail.speed": (-2.0, 1.2)})
    assert np.max(found.result["rail.speed"]) <= 1.2 + 1e-6
    assert 12.0 < found.cost < 36.0


@pytest.mark.parametrize(("most", "size"), [(1 / 9, 1.0), (0.15, 1.0), (0.12, 1e3), (0.3, 1.0)])
def test_bound_that_is_touched_between_nodes(most, size):
    """There and back within a length: A. E. Bryson, Y.-C. Ho, Applied Optimal Control, 1975, section 3.11."""
    scene, least = block(), 4.0 / (9.0 * most) if most <= 1 / 6 else 2.0
    scene.start.update({"rail.displacement": 0.0, "rail.speed": size})
    end = {"rail.displacement": 0.0, "rail.speed": -size}
    found = optimize(scene, **SQUARE, end=end, bounds={"rail.displacement": (-size, most * size)})
    assert np.max(found.result["rail.displacement"]) <= (most + 1e-6) * size
    assert found.cost == pytest.approx(2.0 * least * size**2, rel=1e-4)


def test_cost_of_the_end():
    """With a (x - 1)^2 at the end and a free speed, F = c (1 - t), x = c / 3, and a (c / 3 - 1) / 3 + c / 3 = 0."""
    a = 6.0
    found = optimize(block(), **SQUARE, at_end=lambda seen: a * (seen["rail.displacement"] - 1.0) ** 2)
    c = a / (1.0 + a / 3.0)
    assert found.inputs["push.value"][1] == pytest.approx(c * (1.0 - found.inputs["push.value"][0]), abs=1e-8)


def test_swing_up_ends_where_the_run_does():
    end = {"rail.displacement": 1.0, "rail.speed": 0.0, "hinge.angle": 0.5 * math.pi, "hinge.angular_velocity": 0.0}
    found = optimize(cart_pole(), SQUARE["objective"], inputs={"push.value": (-20.0, 20.0)}, end=end)
    for path, value in end.items():
        assert found.result[path][-1] == pytest.approx(value, abs=1e-6)
    assert found.cost == pytest.approx(58.81, abs=0.02)
    assert "58.8" in found.as_text()


def test_begins_from_motions_that_are_guessed():
    end = {"rail.displacement": 1.0, "rail.speed": 0.0, "hinge.angle": 0.5 * math.pi, "hinge.angular_velocity": 0.0}
    about = {"inputs": {"push.value": (-20.0, 20.0)}, "end": end, "tolerance": 1e-6}
    found = optimize(cart_pole(), SQUARE["objective"], **about)
    nodes = found.result.time[::10]
    guess = {path: np.column_stack([nodes, found.result[path][::10]]) for path in end}
    guess["push.value"] = np.column_stack(found.inputs["push.value"])
    again = optimize(cart_pole(), SQUARE["objective"], **about, guess=guess)
    assert again.cost == pytest.approx(found.cost, rel=1e-5)
    assert again.steps < found.steps


def test_duration_is_chosen_too():
    end = {"rail.displacement": 1.0, "rail.speed": 0.0, "hinge.angle": 0.5 * math.pi, "hinge.angular_velocity": 0.0}
    about = {"inputs": {"push.value": (-20.0, 20.0)}, "end": end, "t_end": (0.5, 3.0)}
    found = optimize(cart_pole(), lambda seen: 20.0 + seen["push.value"] ** 2, **about)
    assert 1.0 < found.duration < 2.9
    longer = optimize(
        cart_pole(), lambda seen: 20.0 + seen["push.value"] ** 2, **{**about, "t_end": 1.03 * found.duration}
    )
    assert found.cost < longer.cost


def test_on_constraints_in_space():
    scene = Scene(space="space", t_end=1.0)
    ground, rod = scene.add("ground", Ground()), scene.add("rod", Rod(length=1.0))
    bob, push = scene.add("bob", PointMass(mass=1.0)), scene.add("push", Force())
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    scene.connect(bob.point, push.point)
    scene.guess.update({"bob.position.z": -1.0})
    scene.start.update({"bob.position.x": 0.1, "bob.position.y": 0.0, "bob.velocity.x": 0.0, "bob.velocity.y": 0.2})
    found = optimize(scene, **SQUARE, end={"bob.position.x": 0.3, "bob.velocity.x": 0.0})
    assert found.result["bob.position.x"][-1] == pytest.approx(0.3, abs=1e-6)


def problem(monkeypatch, **about):
    """Return the first problem that is solved, and unknowns beside those that it begins with."""
    taken = []

    def take(problem, every, *_):
        taken.append((problem, every))
        raise SolveError("taken")

    monkeypatch.setattr(module, "_solved", take)
    with pytest.raises(SolveError, match="taken"):
        optimize(cart_pole(), **about, intervals=3)
    made, every = taken[0]
    noise = np.random.default_rng(1).normal(size=int((~made.fixed).sum()))
    return made, made.free(every) + 0.1 * noise


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_derivatives_of_the_problem(form, monkeypatch):
    made, x = problem(
        monkeypatch,
        objective=lambda seen: seen["push.value"] ** 2 * (1.0 + seen["rail.displacement"]) + seen["time"] ** 2,
        inputs=["push.value"],
        end={"rail.displacement": 1.0, "hinge.angle": (0.0, 1.0)},
        bounds={"rail.speed": (-3.0, 3.0)},
        at_end=lambda seen: seen["rail.speed"] ** 2 * seen["time"],
        t_end=(0.5, 2.0),
        form=form,
    )
    gradient, jacobian = made.slopes(x)
    draw = np.random.default_rng(2)
    way, multipliers, h = draw.normal(size=len(x)), draw.normal(size=jacobian.shape[0]), 1e-6
    (f1, c1), (f0, c0) = made.values(x + h * way), made.values(x - h * way)
    assert (f1 - f0) / (2 * h) == pytest.approx(gradient @ way, rel=1e-6)
    assert (c1 - c0) / (2 * h) == pytest.approx(jacobian @ way, rel=1e-6, abs=1e-6)
    slopes = [g + j.T @ multipliers for g, j in (made.slopes(x + h * way), made.slopes(x - h * way))]
    bent = made.bends(x, multipliers) @ way
    assert (slopes[0] - slopes[1]) / (2 * h) == pytest.approx(bent, rel=1e-5, abs=1e-5 * np.max(np.abs(bent)))


def test_gauss():
    nodes, weights, integrals = gauss(4)
    for power in range(8):
        assert weights @ nodes**power == pytest.approx(1.0 / (power + 1), rel=1e-13)
    assert integrals @ nodes**3 == pytest.approx(nodes**4 / 4, rel=1e-12)


class Rosenbrock:
    """A valley, with a bound and a circle."""

    def __init__(self):
        self.lower, self.upper = np.array([-np.inf, -np.inf]), np.array([0.8, np.inf])

    def values(self, x):
        return 100.0 * (x[1] - x[0] ** 2) ** 2 + (1.0 - x[0]) ** 2, np.zeros(0)

    def slopes(self, x):
        from scipy.sparse import csr_array

        rise = x[1] - x[0] ** 2
        return np.array([-400.0 * x[0] * rise - 2.0 * (1.0 - x[0]), 200.0 * rise]), csr_array((0, 2))

    def bends(self, x, multipliers):
        from scipy.sparse import csr_array

        cross = -400.0 * x[0]
        return csr_array([[1200.0 * x[0] ** 2 - 400.0 * x[1] + 2.0, cross], [cross, 200.0]])


def test_interior_point():
    found = least(Rosenbrock(), np.array([-1.2, 1.0]))
    assert not found.message
    assert found.x == pytest.approx([0.8, 0.64], abs=1e-7)


@pytest.mark.parametrize(
    ("about", "said"),
    [
        ({"inputs": []}, "no inputs"),
        ({"inputs": ["push.force"]}, "no input"),
        ({"inputs": {"push.value": (1.0, -1.0)}}, "empty"),
        ({"inputs": {"push.value": (math.nan, 1.0)}}, "no number"),
        ({"objective": "tim"}, "objective"),
        ({"objective": lambda seen: [seen["push.value"]]}, "one number"),
        ({"objective": lambda seen: seen["push.valu"]}, "push.valu"),
        ({"objective": lambda seen: 1.0 / seen["rail.speed"]}, "no finite number"),
        ({"end": {"rail.place": 1.0}}, "rail.place"),
        ({"end": {"rail.displacement": "1 s"}}, "rail.displacement"),
        ({"bounds": {"rail.speed": (0.0, -1.0)}}, "empty"),
        ({"t_end": (2.0, 1.0)}, "no time"),
        ({"t_end": -1.0}, "no time"),
        ({"guess": {"pull.value": 1.0}}, "pull.value"),
        ({"guess": {"rail.speed": [(1.0, 0.0), (0.0, 1.0)]}}, "rail.speed: its guess"),
        ({"guess": {"rail.speed": np.nan}}, "rail.speed: its guess"),
        ({"end": {"rail.displacement": np.inf}}, "rail.displacement: its range"),
        ({"inputs": {"push.value": (-1.0, 1.0)}, "end": AT_REST}, "no motion was found"),
    ],
)
def test_refuses(about, said):
    with pytest.raises(AtwoodError, match=said):
        optimize(block(), **{**SQUARE, **about})


@pytest.mark.parametrize(
    ("kind", "body", "said"), [(BouncingBall, "ball", "its gap or its dry friction"), (CartPole, "cart", "at moments")]
)
def test_refuses_what_is_not_smooth(kind, body, said):
    scene = kind()
    more = scene.add("more", Force())
    scene.connect(scene[body].point, more.point)
    with pytest.raises(AtwoodError, match=said):
        optimize(scene, lambda seen: seen["more.value"] ** 2, inputs=["more.value"])


def test_refuses_functions_with_pieces():
    scene = block()
    pulse, other = scene.add("pulse", Pulse(amplitude=3.0, width=0.4, period=0.7)), scene.add("other", Force())
    scene.connect(other.point, scene["block"].point)
    scene.connect(pulse.output("value"), other.input("value"))
    with pytest.raises(AtwoodError, match="has pieces"):
        optimize(scene, **SQUARE, end=AT_REST)
