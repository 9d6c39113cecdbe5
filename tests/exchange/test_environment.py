"""Scenes as environments: gymnasium's own check, the same seed the same episode, and many as one by one."""

import importlib.util
import warnings
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import atwood
from atwood import AtwoodError, Environment, Scene, UnsupportedError, UsageError
from atwood_library import Force, Ground, Link, Pivot, PointMass, Sine, Slider

UPRIGHT = 0.5 * np.pi
STATES = ["rail.displacement", "hinge.angle", "rail.speed", "hinge.angular_velocity"]

has_gymnasium = pytest.mark.skipif(importlib.util.find_spec("gymnasium") is None, reason="gymnasium is not installed")


def cart_pole(force: Any = 0.0, stop: float | None = None) -> Scene:
    scene = Scene()
    ground, rail = (
        scene.add("ground", Ground()),
        scene.add("rail", Slider() if stop is None else Slider(upper_stop=stop, stop_stiffness=1e4)),
    )
    cart, hinge = scene.add("cart", PointMass(mass=1.0)), scene.add("hinge", Pivot())
    pole = scene.add("pole", Link(length=0.5, mass=0.2, center=0.5, moment=0.0))
    push = scene.add("push", Force(value=force))
    scene.connect(ground.frame, rail.a)
    scene.connect(rail.b, cart.point)
    scene.connect(rail.b, hinge.a)
    scene.connect(hinge.b, pole.a)
    scene.connect(cart.point, push.point)
    return scene


def made(scene: Scene | None = None, **changed: Any) -> Environment:
    given: dict[str, Any] = {
        "actions": {"push.value": (-10.0, 10.0)},
        "observations": STATES,
        "reward": lambda seen: 1.0 - abs(seen["hinge.angle"] - UPRIGHT) - 1e-3 * seen["push.value"] ** 2,
        "terminated": lambda seen: abs(seen["hinge.angle"] - UPRIGHT) > 0.4,
        "period": 0.02,
        "t_end": 0.6,
        "start": {
            "rail.displacement": (-0.05, 0.05),
            "hinge.angle": (UPRIGHT - 0.05, UPRIGHT + 0.05),
            "rail.speed": (0.0, 0.01),
            "hinge.angular_velocity": (0.0, 0.01),
        },
    }
    return Environment(cart_pole() if scene is None else scene, **(given | changed))


def test_without_gymnasium_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    from atwood.exchange.environments import environment

    monkeypatch.setattr(environment, "gymnasium", None)
    with pytest.raises(UsageError, match="atwood\\[gym\\]"):
        made()


@has_gymnasium
def test_gymnasium_finds_nothing_wrong() -> None:
    from gymnasium.utils.env_checker import check_env

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # bounds of spaces are a matter of taste
        check_env(made())


@has_gymnasium
def test_an_episode_is_that_of_simulate_and_comes_again() -> None:
    environment = made()
    begin, _ = environment.reset(seed=5)
    assert_array_equal(begin, environment.reset(seed=5)[0])
    assert not np.array_equal(begin, environment.reset(seed=6)[0])
    environment.reset(seed=5)
    for _ in range(10):
        seen, reward, over, late, _ = environment.step([3.0])
    scene = cart_pole(3.0)
    for path, value in zip(STATES, begin.tolist(), strict=True):
        scene.start[path] = value
    held = atwood.simulate(scene, t_end=0.2, rtol=1e-11)
    assert_allclose(seen, [held[path][-1] for path in STATES], atol=1e-8)
    assert reward == pytest.approx(1.0 - abs(seen[1] - UPRIGHT) - 9e-3)
    assert not over
    assert not late


@has_gymnasium
def test_episodes_end_by_what_is_seen_and_by_time() -> None:
    environment = made()
    environment.reset(seed=0, options={"start": {"hinge.angle": UPRIGHT + 0.39}})
    assert environment.step([-10.0])[2] == (environment._motions.read(("hinge.angle",))[0, 0] > UPRIGHT + 0.4)
    environment = made(terminated=None, t_end=0.1)
    environment.reset(seed=0)
    assert [environment.step([0.0])[3] for _ in range(5)] == [False] * 4 + [True]


@has_gymnasium
def test_many_go_on_as_each_by_itself() -> None:
    environment, rng = made(t_end=0.1), np.random.default_rng(0)
    many = environment.vector(5)
    seen, _ = many.reset(seed=20)
    actions = rng.uniform(-10.0, 10.0, (5, 5, 1))
    steps = [seen, *(many.step(one)[0] for one in actions)]
    for k in range(5):
        alone = [environment.reset(seed=20 + k)[0], *(environment.step(one[k])[0] for one in actions)]
        assert_array_equal([one[k] for one in steps], alone)
    seen, rewards, over, late, _ = many.step(actions[0])  # all were truncated, and begin anew
    assert_array_equal(rewards, 0.0)
    assert not over.any()
    assert not late.any()
    assert_array_equal(seen[3], (environment.reset(seed=23), environment.reset())[1][0])


@has_gymnasium
def test_motions_at_other_times_see_their_own_time() -> None:
    """Of laws that depend on time each motion goes on at its own, whenever it began."""
    scene = cart_pole()
    wind = scene.add("wind", Force())
    scene.connect(scene["cart"].point, wind.point)
    scene.connect(scene.add("gust", Sine(amplitude=5.0, angular_frequency=20.0)).output("value"), wind.input("value"))
    environment = made(scene, terminated=lambda seen: seen["hinge.angle"] > UPRIGHT + 0.1, t_end=5.0)
    many = environment.vector(4)
    many.reset(seed=0)
    over = np.zeros(4, dtype=bool)
    for _ in range(60):
        over |= many.step(np.zeros((4, 1)))[2]
    assert over.any()
    assert len(set(many._motions.steps.tolist())) > 1
    before, steps = many._motions.state.copy(), many._motions.steps.copy()
    many._over[:] = False
    many.step(np.zeros((4, 1)))
    alone = environment._motions
    for k in range(4):
        alone.state[0], alone.values[0], alone.steps[0] = before[k], many._motions.values[k], steps[k]
        alone.tolerances[0] = many._motions.tolerances[k]
        alone.go_on(np.array([0]), np.zeros((1, 1)))
        assert_array_equal(alone.state[0], many._motions.state[k])


@has_gymnasium
def test_a_picture_is_that_of_now() -> None:
    environment = made(render_mode="rgb_array")
    environment.reset(seed=0)
    first = environment.render()
    assert first.dtype == np.uint8
    assert first.shape[2] == 3
    assert np.ptp(first) > 100
    for _ in range(20):
        environment.step([10.0])
    assert not np.array_equal(first, environment.render())
    assert made().render() is None


@has_gymnasium
@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"actions": {}}, "no actions"),
        ({"actions": {"push.value": (1.0, -1.0)}}, "no range of an action"),
        ({"actions": {"push.value": 3.0}}, "no range of an action"),
        ({"actions": {"push.valeu": (-1.0, 1.0)}}, "valeu"),
        ({"actions": {"cart.mass": (-1.0, 1.0)}}, "cart.mass"),
        ({"actions": {"ground.position": (-1.0, 1.0)}}, "ground.position"),
        ({"observations": ["hinge.angel"]}, "hinge.angel"),
        ({"period": 0.0}, "period"),
        ({"period": 5.0}, "before the first period"),
        ({"start": {"hinge.angle": (0.0, np.nan)}}, "hinge.angle"),
        ({"start": {"hinge.angel": (0.0, 1.0)}}, "hinge.angel"),
        ({"render_mode": "human"}, "rgb_array"),
        ({"rewards": None}, "reward"),
    ],
)
def test_what_makes_no_environment_is_refused(changed: dict[str, Any], said: str) -> None:
    with pytest.raises(AtwoodError, match=said):
        made(**changed)


@has_gymnasium
def test_scenes_and_steps_that_cannot_be_are_refused() -> None:
    with pytest.raises(UnsupportedError, match="from period to period"):
        made(cart_pole(stop=0.5))
    environment = made()
    with pytest.raises(UsageError, match="Call reset first"):
        environment.step([0.0])
    environment.reset(seed=0)
    for bad in ([11.0], [np.nan], [0.0, 0.0], "left"):
        with pytest.raises(UsageError, match="action"):
            environment.step(bad)
    with pytest.raises(UsageError, match="start value"):
        environment.reset(options={"start": {"hinge.angel": 0.0}})
    with pytest.raises(UsageError, match="no options"):
        environment.reset(options={"begin": 0.0})
    wrong = made(reward=lambda seen: np.zeros(3))
    wrong.reset(seed=0)
    with pytest.raises(UsageError, match="shape"):
        wrong.step([0.0])
