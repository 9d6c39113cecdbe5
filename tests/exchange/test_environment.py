"""Scenes as environments: gymnasium's own check, the same seed the same episode, and many as one by one."""

import importlib.util
import warnings
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import atwood
from atwood import AtwoodError, Environment, Scene, UnsupportedError, UsageError
from atwood_library import Force, Ground, Link, Pivot, PointMass, Rope, SampledFeedback, Sine, Slider

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
        check_env(walked(ball()))


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


def ball(force: float = 0.0, rope: str = "") -> Scene:
    """A ball that bounces on stops or, on a rope, is caught by it; a controller damps it."""
    scene = Scene()
    ground, mass = scene.add("ground", Ground()), scene.add("mass", PointMass())
    push, control = scene.add("push", Force(value=force, direction=(0.0, 0.0, 1.0))), SampledFeedback(gains=(0.5,))
    if rope:
        holds = scene.add("holds", Rope(starts="slack", when_slack=rope))
        scene.start["mass.position.x"], scene.start["mass.position.z"] = 0.3, -0.9
    else:
        stops = {"axis": (0.0, 0.0, 1.0), "lower_stop": 0.01, "upper_stop": 2.0, "stop_restitution": 0.5}
        holds = scene.add("holds", Slider(**stops))
        scene.start["mass.position.z"] = 0.3
    scene.connect(ground.frame, holds.a)
    scene.connect(holds.b, mass.point)
    scene.connect(mass.point, push.point)
    brake = scene.add("brake", Force(direction=(0.0, 0.0, 1.0)))
    scene.connect(mass.point, brake.point)
    scene.connect(mass.output("velocity.z"), scene.add("control", control).input("u_1"))
    scene.connect(control.output("y"), brake.input("value"))
    return scene


SEEN = ["mass.position.z", "mass.velocity.z", "mass.acceleration.z", "control.y"]


def walked(scene: Scene, form: str = "reduced", **changed: Any) -> Environment:
    given = {"observations": SEEN, "reward": lambda seen: -seen["mass.position.z"], "start": {}, "terminated": None}
    return made(atwood.assemble(scene, form=form), **(given | changed))


@has_gymnasium
@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("rope", ["", "slack"])
def test_scenes_with_events_are_walked_as_simulate_runs_them(form: str, rope: str) -> None:
    """With a force that is held all through, what is seen is what a run shows, also beyond impacts and samples."""
    environment = walked(ball(rope=rope), form)
    environment.reset(seed=0)
    steps = np.array([environment.step([7.0])[0] for _ in range(30)])
    held = atwood.simulate(ball(7.0, rope), t_end=0.6, form=form, outputs=0.02 * np.arange(1, 31))
    assert held.events
    assert_allclose(steps, np.array([held[path] for path in SEEN]).T, atol=1e-6, rtol=1e-6)


@has_gymnasium
def test_walked_motions_come_again_and_are_a_vector() -> None:
    environment, rng = (
        walked(ball(rope="slack"), start={"mass.position.x": (0.1, 0.3)}, t_end=0.2),
        np.random.default_rng(0),
    )
    many = environment.vector(3)
    actions = rng.uniform(-10.0, 10.0, (10, 3, 1))
    steps = [many.reset(seed=7)[0], *(many.step(one)[0] for one in actions)]
    for k in range(3):
        alone = [environment.reset(seed=7 + k)[0], *(environment.step(one[k])[0] for one in actions)]
        assert_array_equal([one[k] for one in steps], alone)
    with pytest.raises(UsageError, match="Call reset"):
        environment.step([0.0])
    assert not many.step(actions[0])[2].any()  # all begin anew
    assert_array_equal(many._motions.time, 0.0)


@has_gymnasium
def test_an_event_that_ends_the_run_ends_the_episode() -> None:
    environment = walked(ball(rope="stop"), observations=["holds.tension"], render_mode="rgb_array")
    environment.reset(seed=0)
    first, over, force = environment.render(), False, -5.0
    while not over:  # the rope is pulled taut, and let go
        (tension,), _, over, late, _ = environment.step([force])
        force = 10.0 if tension > 1.0 else force
        assert not late
    assert tension < 1e-5
    assert environment._motions.time[0] < 0.02 * environment._motions.steps[0]
    assert not np.array_equal(first, environment.render())
    with pytest.raises(UsageError, match="Call reset"):
        environment.step([0.0])


@has_gymnasium
def test_before_the_first_step_the_scene_has_its_own_values() -> None:
    for scene in (cart_pole(2.0), cart_pole(2.0, stop=0.5)):
        environment = made(scene, observations=["push.force"])
        assert_array_equal(environment.reset(seed=0)[0], [2.0])
        assert_array_equal(environment.step([-3.0])[0], [-3.0])
        assert_array_equal(environment.reset()[0], [2.0])


@has_gymnasium
def test_where_motions_are_walked_actions_are_inputs() -> None:
    with pytest.raises(UnsupportedError, match="no input"):
        walked(ball(), actions={"mass.mass": (0.5, 2.0)})


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
def test_steps_that_cannot_be_are_refused() -> None:
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
