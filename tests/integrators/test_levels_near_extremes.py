"""Events at levels near an extreme, where an event function passes zero twice in a short time, against closed forms."""

from math import acos, pi

import pytest

from atwood import Scene, simulate
from atwood_library import Ground, PointMass, Spring

from ..helpers.counters import Counter

WAYS = [
    *(("reduced", one) for one in ("explicit", "taylor", "ida", "gauss", "composition")),
    *(("dae", one) for one in ("explicit", "ida")),
]
STEPS = {"gauss": {"step": 2e-3}, "composition": {"step": 1e-3}}
AMPLITUDE, FREQUENCY = 0.1, 100.0


def swinging(size: float = 1.0, pace: float = 1.0) -> Scene:
    """Return 1 kg on a spring of 1e4 N/m that swings by 0.1 m about 1 m; lengths and times scaled."""
    scene = Scene(gravity=0.0)
    ground, mass = scene.add("ground", Ground()), scene.add("m", PointMass(mass=1.0))
    spring = scene.add("spring", Spring(stiffness=(FREQUENCY * pace) ** 2, natural_length=size))
    scene.connect(ground.frame, spring.a)
    scene.connect(spring.b, mass.point)
    still = {"m.position.x": 0.0, "m.velocity.x": 0.0, "m.velocity.z": 0.0}
    scene.start.update({**still, "m.position.z": -size * (1.0 + AMPLITUDE)})
    return scene


def passings(share: float, end: float, rate: float = FREQUENCY) -> list[float]:
    """Return when cos(rate t) passes a share of its amplitude."""
    first, turns = acos(share), range(int(rate * end / (2.0 * pi)) + 2)
    times = sorted(one / rate for k in turns for one in (2.0 * pi * k + first, 2.0 * pi * (k + 1) - first))
    return [one for one in times if one <= end]


@pytest.mark.parametrize(("form", "solver"), WAYS)
@pytest.mark.parametrize("below", [1e-4, 1e-6])
def test_each_passing_is_noted_once(form: str, solver: str, below: float) -> None:
    rtol = 1e-12 if solver == "ida" else 1e-10
    level, end = AMPLITUDE * (1.0 - below), 1.0
    condition = f"m.position.z crosses {-(1.0 + level)!r}"
    more = STEPS.get(solver, {})
    run = simulate(swinging(), t_end=end, form=form, solver=solver, rtol=rtol, record=condition, **more)
    # The time moves by an error of the place over the speed there.
    allowed = {"gauss": 1e-3, "composition": 1e-3}.get(solver, 1e-6)
    assert [one.time for one in run.events] == pytest.approx(passings(1.0 - below, end), abs=allowed)


@pytest.mark.parametrize("solver", ["explicit", "taylor"])
@pytest.mark.parametrize(("size", "pace"), [(1.0, 1.0), (1e6, 1.0), (1e-6, 1.0), (1.0, 1e6), (1.0, 1e-6)])
def test_a_share_of_1e_9_of_the_amplitude_is_seen_in_any_units(solver: str, size: float, pace: float) -> None:
    level, end = AMPLITUDE * (1.0 - 1e-9), 0.5 / pace
    condition = f"m.position.z crosses {-size * (1.0 + level)!r}"
    run = simulate(swinging(size, pace), t_end=end, solver=solver, rtol=1e-13, record=condition, outputs=11)
    expected = passings(1.0 - 1e-9, end, FREQUENCY * pace)
    assert [pace * one.time for one in run.events] == pytest.approx([pace * one for one in expected], abs=1e-7)
    above = f"m.position.z crosses {-size * (1.0 + AMPLITUDE * (1.0 + 1e-9))!r}"
    assert not simulate(swinging(size, pace), t_end=end, solver=solver, rtol=1e-13, record=above, outputs=11).events


@pytest.mark.parametrize(("form", "solver"), WAYS)
def test_a_component_counts_each_passing_once(form: str, solver: str) -> None:
    scene = swinging()
    counter = scene.add("counter", Counter(level=-(1.0 + 0.09999), axis=2))
    scene.connect(counter.point, scene.m.point)
    run = simulate(scene, t_end=1.0, form=form, solver=solver, rtol=1e-10, **STEPS.get(solver, {}))
    assert run["counter.passed"][-1] == len(passings(0.9999, 1.0))


@pytest.mark.parametrize(("form", "solver"), WAYS)
@pytest.mark.parametrize("below", [1e-6, 1e-8])
def test_a_thrown_ball_passes_a_level_below_its_top_twice(form: str, solver: str, below: float) -> None:
    scene = Scene()
    scene.add("ball", PointMass(mass=1.0))
    speed, g = 5.0, 9.81
    start = {"ball.position.x": 0.0, "ball.position.z": 0.0, "ball.velocity.x": 0.0, "ball.velocity.z": speed}
    scene.start.update(start)
    top, half = speed**2 / (2.0 * g), (2.0 * below / g) ** 0.5
    condition = f"ball.position.z crosses {top - below!r}"
    run = simulate(scene, t_end=1.0, form=form, solver=solver, rtol=1e-10, record=condition, **STEPS.get(solver, {}))
    assert [one.time for one in run.events] == pytest.approx([speed / g - half, speed / g + half], abs=1e-5)
    over = simulate(
        scene, t_end=1.0, form=form, solver=solver, rtol=1e-10, record=f"ball.position.z crosses {top + below!r}",
        **STEPS.get(solver, {}),
    )  # fmt: skip
    assert not over.events
