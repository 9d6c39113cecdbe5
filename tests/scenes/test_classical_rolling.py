"""Scenes with constraints on velocities against closed forms, and against Newton's and Euler's equations by hand."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import atwood_library as lib
from atwood import Scene, simulate
from atwood.pipeline import assemble
from atwood_library.scenes import SCENES

from ..helpers.runs import FORMS


def gap(a: object, b: object) -> float:
    return float(np.max(np.abs(np.asarray(a) - np.asarray(b))))


def test_states() -> None:
    expected = {
        "chaplygin-sleigh": (3, 3, 1),
        "rattleback": (6, 3, 0),
        "ball-in-shell": (7, 6, 3),
        "benchmark-bicycle": (9, 8, 5),
    }
    for name, numbers in expected.items():
        equations = assemble(SCENES[name]()).reduced
        found = len(equations.coordinates), len(equations.speeds), len(equations.constraints)
        assert found == numbers, name


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("settings", [{}, {"speed": 1.0, "spin": -3.0, "ahead": 0.1}])
def test_a_sleigh_comes_to_go_straight_on(form: str, settings: dict[str, float]) -> None:
    scene = SCENES["chaplygin-sleigh"](**settings)
    result = simulate(scene, form=form, rtol=1e-12)
    for path, values in scene.closed_form(result.time).items():  # type: ignore[attr-defined]
        assert gap(result.array(path), values) < 1e-8, path
    assert np.ptp(result.array("total_energy")) < 1e-8
    assert result.array("blade.speed")[-1] > 0.9


def rattle(scene: Scene, t: np.ndarray) -> np.ndarray:
    """Return angular velocity and the vertical, both in the axes of the stone, by Newton's and Euler's equations."""
    values = scene.parameters()
    m, depth, g = values["mass"], values["depth"], 9.81
    squares = np.diag(np.square(values["semi_axes"]))
    c, s = math.cos(values["skew"]), math.sin(values["skew"])
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    inertia = turn @ np.diag(values["moments"]) @ turn.T

    def contact(n: np.ndarray) -> np.ndarray:
        """Return where the contact is, from the centre of mass."""
        return -squares @ n / math.sqrt(n @ squares @ n) + np.array([0.0, 0.0, depth])

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        w, n = y[:3], y[3:]
        dn = np.cross(n, w)
        r = contact(n)
        h = math.sqrt(n @ squares @ n)
        dr = -squares @ dn / h + squares @ n * (n @ squares @ dn) / h**3
        # v = -w x r; m (v' + w x v) = F - m g n; J w' + w x J w = r x F
        v = -np.cross(w, r)
        known = -np.cross(w, dr) + np.cross(w, v) + g * n
        # r x (m (-w' x r)) = -m (r^2 w' - r (r . w'))
        matrix = inertia + m * (r @ r * np.eye(3) - np.outer(r, r))
        dw = np.linalg.solve(matrix, m * np.cross(r, known) - np.cross(w, inertia @ w))
        return np.concatenate([dw, dn])

    start = [values["rattle"], values["rattle"], values["spin"], 0.0, 0.0, 1.0]
    found = solve_ivp(rates, (0.0, t[-1]), start, "DOP853", t, rtol=1e-13, atol=1e-13)
    return np.asarray(found.y)


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_a_rattleback_and_its_twin(form: str) -> None:
    scene = SCENES["rattleback"](t_end=1.0 if form == "dae" else 3.0)
    result = simulate(scene, form=form, rtol=1e-12, outputs=31)
    twin = rattle(scene, result.time)
    bound = 1e-9 if form == "reduced" else 1e-6  # the dae form is for IDA alone
    for number, axis in enumerate("xyz"):
        assert gap(result.array(f"stone.spin.{axis}"), twin[number]) < bound * max(1.0, np.max(np.abs(twin[number])))
        assert gap(result.array(f"stone.{axis}_axis.z"), twin[3 + number]) < bound
    assert np.ptp(result.array("total_energy")) < 1e-8


def test_a_rattleback_turns_round_much_sooner_one_way() -> None:
    first = []
    for spin in (-5.0, 5.0):
        result = simulate(SCENES["rattleback"](spin=spin, t_end=10.0), rtol=1e-9)
        turned = result.array("stone.angular_velocity.z") * spin < 0.0
        first.append(float(result.time[np.argmax(turned)]) if np.any(turned) else 10.0)
    assert max(first) > 1.5 * min(first)


def shell(scene: Scene, t: np.ndarray) -> np.ndarray:
    """Return the centre's place and the angular velocity of a ball in a shell, in world axes."""
    values = scene.parameters()
    m, r, reach = values["mass"], values["radius"], values["shell"] - values["radius"]
    inertia, weight = 0.4 * m * r * r, np.array([0.0, 0.0, -9.81 * m])

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        c, w = y[:3], y[3:]
        n = -c / reach
        v = r * np.cross(w, n)
        dn = -v / reach
        # m v' = F + m g, J w' = -r n x F, v' = r (w' x n + w x n')
        known = m * r * np.cross(w, dn) - weight
        matrix = inertia * np.eye(3) + m * r * r * (np.eye(3) - np.outer(n, n))
        return np.concatenate([v, np.linalg.solve(matrix, -r * np.cross(n, known))])

    sine, cosine = math.sin(values["inclination"]), math.cos(values["inclination"])
    n = np.array([-sine, 0.0, cosine])
    spin = np.cross(n, [0.0, values["speed"], 0.0]) / r + values["spin"] * n
    start = [reach * sine, 0.0, -reach * cosine, *spin]
    return np.asarray(solve_ivp(rates, (0.0, t[-1]), start, "DOP853", t, rtol=1e-13, atol=1e-13).y)


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_a_ball_in_a_shell_and_its_twin(form: str) -> None:
    scene = SCENES["ball-in-shell"](t_end=3.0)
    result = simulate(scene, form=form, rtol=1e-13, outputs=31)
    twin = shell(scene, result.time)
    for number, axis in enumerate("xyz"):
        assert gap(result.array(f"ball.position.{axis}"), twin[number]) < 1e-9, axis
        spin = twin[3 + number]
        assert gap(result.array(f"ball.angular_velocity.{axis}"), spin) < 1e-9 * np.max(np.abs(twin[3:])), axis
    assert np.ptp(result.array("total_energy")) < 1e-8
    assert np.min(result.array("contact.normal_force")) > 0.0


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("shape", ["sphere", "cylinder"])
def test_a_ball_that_swings_in_a_bowl_is_a_pendulum(form: str, shape: str) -> None:
    """Its energy is that of a pendulum of length (1 + k)(R - r), in a plane and, along one circle, in space."""
    for space, k in (("plane", 0.5), ("space", 0.4)):
        scene = Scene(space=space)
        ground = scene.add("ground", lib.Ground())
        contact = scene.add("contact", lib.RollingOnRound(shape=shape, ground_radius=1.0, radius=0.2))
        body = lib.Sphere(radius=0.2, mass=1.0) if space == "space" else lib.Disc(radius=0.2, mass=1.0)
        ball = scene.add("ball", body)
        scene.connect(ground.frame, contact.a)
        scene.connect(contact.b, ball.frame)
        scene.start["ball.position.x"] = 0.8 * math.sin(0.7)
        scene.guess["ball.position.z"] = -0.8 * math.cos(0.7)
        if space == "space":
            scene.start.update({"ball.position.y": 0.0, "ball.velocity.x": 0.0, "ball.velocity.y": 0.0})
            scene.start.update({f"ball.{angle}": 0.0 for angle in ("phi", "theta", "psi")})
            scene.start["ball.angular_velocity.z"] = 0.0
        else:
            scene.start["ball.velocity.x"] = 0.0
        result = simulate(scene, form=form, t_end=1.0, rtol=1e-10)
        x, z = result.array("ball.position.x"), result.array("ball.position.z")
        pendulum = SCENES["simple-pendulum"](length=0.8 * (1.0 + k), t_end=1.0)
        pendulum.start.update({"rod.angle": 0.7, "rod.angular_velocity": 0.0})
        angle = simulate(pendulum, rtol=1e-11).array("rod.angle")
        assert gap(np.arctan2(x, -z), angle) < 1e-7, space


def test_a_ball_rolls_off_the_top_of_a_cylinder() -> None:
    """It would leave where the cosine is 10/17 of that at the start: there the normal force is zero."""
    scene = Scene(space="space")
    ground = scene.add("ground", lib.Ground())
    contact = scene.add("contact", lib.RollingOnRound(shape="cylinder", rolls="outside", radius=0.3))
    ball = scene.add("ball", lib.Sphere(radius=0.3, mass=2.0))
    scene.connect(ground.frame, contact.a)
    scene.connect(contact.b, ball.frame)
    scene.start.update({"ball.position.x": 1.3 * math.sin(0.05), "ball.position.y": 0.0, "ball.velocity.y": 0.0})
    scene.start.update({"ball.velocity.x": 0.0, "ball.angular_velocity.z": 0.0})
    scene.start.update({f"ball.{angle}": 0.0 for angle in ("phi", "theta", "psi")})
    scene.guess["ball.position.z"] = 1.3
    result = simulate(scene, t_end=1.8, rtol=1e-10, outputs=101)
    push, height = result.array("contact.normal_force"), result.array("ball.position.z") / 1.3
    assert push[0] == pytest.approx(2.0 * 9.81, rel=1e-2)
    predicted = 2.0 * 9.81 * (17.0 * height - 10.0 * math.cos(0.05)) / 7.0
    assert gap(push, predicted) < 1e-6
    assert np.min(push) < 0.0
