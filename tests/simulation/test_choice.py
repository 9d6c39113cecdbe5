"""Which solver a scene is given to: by what it is, before a run and in the middle of it, and that this is said."""

import math
from collections.abc import Iterable

import numpy as np
import pytest

from atwood import (
    Component,
    Load,
    Point,
    Result,
    Scene,
    Vector,
    connector,
    cos,
    force,
    select,
    signal,
    simulate,
    sin,
    tanh,
)
from atwood.integrators.ida import library as sundials_library
from atwood.pipeline import assemble
from atwood.simulation.initialization.start import find_start
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.problem.preparation import make_problem
from atwood.simulation.run.choice import ASKED, stiffness_of
from atwood_library import Damper, Force, Ground, PointMass, Spring

from ..helpers.mechanisms import pendulum_on_a_string
from ..helpers.smooth import SMOOTH as SCENES

SMOOTH = ("simple-pendulum", "double-pendulum", "pendulum-on-cart", "mass-spring-chain", "chain", "double-atwood")
"""Scenes without loops, without dampers, and without laws that switch."""

SOLVED = (
    "four-bar",
    "slider-crank",
    "four-bar-row",
    "spatial-slider-crank",
    "universal-shaft",
    "trebuchet",
    "andrews-squeezer",
    "scott-russell-lift",
    "strandbeest",
    "foucault-pendulum",
    "spherical-pendulum",
)
"""Scenes whose closed loops are solved by formulas."""

CLEAR = ("four-bar", "slider-crank", "universal-shaft", "andrews-squeezer")
"""Those whose one angle meets no dead centre in a turn."""


class Follower(Component):
    """A force along x that makes 1 kg keep a velocity, c (w - v) + w', with a coefficient that changes with time."""

    coefficient: float = signal(1.0, unit="N*s/m", doc="Force for each metre a second.")
    wave: float = signal(0.0, unit="m/s", doc="The velocity that it wants.")
    push: float = signal(0.0, unit="N", doc="What the wanted velocity needs.")
    point: Point = connector(Point, "Where it acts.")

    @force
    def pull(self) -> Iterable[Load]:
        """Return the load."""
        velocity = self.point.velocity
        yield Load(self.point, Vector(self.coefficient * (self.wave - velocity.x) + self.push, 0.0, -velocity.z))


def follower(coefficient: object) -> Scene:
    """Return a mass of 1 kg that is made to move with the velocity cos t: x = sin t once that holds."""
    scene = Scene(gravity=0.0, t_end=10.0)
    bob = scene.add("bob", PointMass(mass=1.0))
    pull = scene.add("pull", Follower(coefficient=coefficient, wave=cos, push=lambda t: -sin(t)))
    scene.connect(pull.point, bob.point)
    scene.start.update({"bob.position.x": 0.0, "bob.position.z": 0.0, "bob.velocity.x": 1.0, "bob.velocity.z": 0.0})
    return scene


def elastic_pendulum(stiffness: float, damping: float) -> Scene:
    scene = Scene(t_end=2.0)
    ground, bob = scene.add("ground", Ground()), scene.add("bob", PointMass(mass=1.0))
    spring = scene.add("spring", Spring(stiffness=stiffness, natural_length=1.0))
    damper = scene.add("damper", Damper(damping=damping))
    for one in (spring, damper):
        scene.connect(ground.frame, one.a)
        scene.connect(one.b, bob.point)
    scene.start.update({"bob.position.x": 1.0, "bob.position.z": 0.0, "bob.velocity.x": 0.0, "bob.velocity.z": 0.0})
    return scene


def solvers(result: Result) -> list[str]:
    return [one.solver for one in result.run.choices]


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", SCENES)
def test_each_scene_is_given_to_what_suits_it(name: str) -> None:
    scene = SCENES[name]()
    has_loops = bool(assemble(scene).reduced.constraints)
    assert has_loops or name not in ("four-bar", "slider-crank")
    assert not (has_loops and name in SMOOTH)
    reduced, dae = (simulate(scene, form=form, t_end=0.1, rtol=1e-6, outputs=3) for form in ("reduced", "dae"))
    is_stiff = name == "flyball-governor"  # its collar has a damper
    assert (name in SOLVED) <= has_loops
    if name in SOLVED:
        assert solvers(reduced) == (["taylor"] if name in CLEAR else ["explicit"])
    else:
        assert solvers(reduced) == (["ida"] if is_stiff else ["explicit"])
    assert ("closed loops" in reduced.solver) == has_loops
    assert ("formulas solve" in reduced.solver) == (name in SOLVED)
    assert ("it is stiff" in reduced.solver) == is_stiff
    assert solvers(dae) == (["ida"] if is_stiff else ["explicit"])
    assert ("it is stiff" in dae.solver) == is_stiff
    assert ("the dae form keeps constraints, on which steps end" in dae.solver) == (not is_stiff)


def test_what_is_to_be_seen_of_index_1_is_left_to_ida() -> None:
    for level in ("index1", "index1-projected"):
        result = simulate(SCENES["simple-pendulum"](), form="dae", level=level, t_end=0.1, outputs=3)
        assert solvers(result) == ["ida"]


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", SMOOTH)
def test_very_accurate_answers_come_from_taylor_series(name: str) -> None:
    scene = SCENES[name]()
    results = [simulate(scene, t_end=0.2, rtol=rtol, outputs=3) for rtol in (1.01e-10, 1e-10)]
    assert [solvers(one) for one in results] == [["explicit"], ["taylor"]]
    assert "1e-10 or better is asked for" in results[1].solver


def test_what_can_die_away_or_has_no_series_stays_with_runge_and_kutta() -> None:
    assert solvers(simulate(elastic_pendulum(10.0, 1.0), t_end=0.2, rtol=1e-12, outputs=3)) == ["explicit"]
    scene = Scene(gravity=0.0, t_end=0.2)
    bob = scene.add("bob", PointMass())
    push = scene.add("push", Force(value=lambda t: select(t < 0.1, 1.0, 0.0)))
    scene.connect(push.point, bob.point)
    scene.start.update({"bob.position.x": 0.0, "bob.position.z": 0.0, "bob.velocity.x": 1.0, "bob.velocity.z": 0.0})
    result = simulate(scene, rtol=1e-12, outputs=3)
    assert result.array("bob.velocity.x")[-1] == pytest.approx(1.1, rel=1e-12)


@pytest.mark.parametrize("solver", ["ida", "ida-sundae", "explicit"])
def test_what_is_asked_for_is_used(solver: str) -> None:
    result = simulate(elastic_pendulum(1e4, 3e3), t_end=0.05, solver=solver, outputs=3)
    assert solvers(result) == [solver]
    assert result.run.choices[0].reason == ASKED


def test_a_stiff_scene_is_left_to_ida() -> None:
    result = simulate(elastic_pendulum(1e4, 3e3))
    assert solvers(result) == ["ida"]
    assert "it is stiff: something dies away" in result.solver
    explicit = simulate(elastic_pendulum(1e4, 3e3), solver="explicit")
    assert explicit.statistics.residual_evaluations > 5 * result.statistics.residual_evaluations


@pytest.mark.parametrize(("stiffness", "damping"), [(1e7, 0.0), (1e4, 20.0), (1e3, 50.0), (1.0, 1.0)])
def test_what_vibrates_or_dies_away_slowly_is_not_stiff(stiffness: float, damping: float) -> None:
    result = simulate(elastic_pendulum(stiffness, damping), t_end=0.2, outputs=3)
    assert solvers(result) == ["explicit"]
    assert "not stiff" in result.solver


def test_the_ratio_of_stiffness_is_that_of_the_eigenvalues() -> None:
    assembly = assemble(elastic_pendulum(1e4, 3e3))
    start = find_start(assembly)
    q, u = start.coordinates, start.speeds
    plan = make_problem(assembly, 0.0, q, u, start.length, 2.0)
    found = stiffness_of(plan, RunOptions(t_end=10.0), 0.0, q, u)
    assert found is not None
    # l^2 + 3000 l + 10000 = 0 along the spring; the rest takes sqrt(length / g).
    assert found.decay == pytest.approx(1500.0 + math.sqrt(1500.0**2 - 1e4), rel=1e-5)
    assert found.ratio == pytest.approx(found.decay * plan.scales.time, rel=1e-9)
    assert plan.scales.time == pytest.approx(math.sqrt(1.0 / 9.81))


def test_without_dampers_nothing_is_stiff() -> None:
    assembly = assemble(SCENES["chain"]())
    start = find_start(assembly)
    q, u = start.coordinates, start.speeds
    plan = make_problem(assembly, 0.0, q, u, start.length, 1.0)
    assert stiffness_of(plan, RunOptions(t_end=1.0), 0.0, q, u) is None


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8, 1e-10, 1e-12])
def test_what_is_chosen_errs_no_more_than_ida(rtol: float) -> None:
    scene = SCENES["simple-pendulum"]()
    errors = []
    for solver in ("auto", "ida"):
        result = simulate(scene, rtol=rtol, t_end=5.0, solver=solver)
        exact = scene.closed_form(result.time)["rod.angle"]
        errors.append(float(np.max(np.abs(result.array("rod.angle") - exact))))
    assert errors[0] < 4.0 * errors[1]  # four times at 1e-4, where a step is long; a hundredth at 1e-10
    assert rtol > 1e-8 or errors[0] < errors[1]


def turns_stiff() -> Scene:
    """Return a scene whose damping rises from 1 to 100,000 N s/m at 4 s."""
    return follower(lambda t: 1.0 + 0.5e5 * (1.0 + tanh(20.0 * (t - 4.0))))


def test_a_scene_that_turns_stiff_is_handed_over() -> None:
    result = simulate(turns_stiff(), rtol=1e-9)
    assert (result.status, solvers(result)) == ("finished", ["explicit", "ida"])
    first, second = result.run.choices
    assert (first.time, second.time) == (0.0, pytest.approx(4.0, abs=0.5))
    assert result.solver == (
        f"Dormand-Prince 8(5,3): {first.reason}; from t = {second.time:.6g} s SUNDIALS IDA: {second.reason}"
    )
    assert "it has turned out stiff" in second.reason
    # x' = cos t holds all along: it starts with it.
    assert np.max(np.abs(result.array("bob.position.x") - np.sin(result.time))) < 1e-6
    assert len(result.time) == 201
    assert np.all(np.diff(result.time) > 0.0)
    explicit = simulate(turns_stiff(), rtol=1e-9, solver="explicit")
    assert explicit.statistics.steps > 10 * result.statistics.steps


def test_a_handed_over_run_keeps_its_limits_and_its_progress() -> None:
    seen: list[float] = []
    whole = simulate(turns_stiff(), rtol=1e-8, progress=seen.append)
    assert seen[-1] == 10.0
    assert seen == sorted(seen)
    limited = simulate(turns_stiff(), rtol=1e-8, max_steps=whole.statistics.steps - 10)
    assert limited.status == "step_limit"
    assert limited.statistics.steps == whole.statistics.steps - 10
    assert solvers(limited) == ["explicit", "ida"]


def test_a_mode_with_loops_is_followed_by_one_without() -> None:
    scene = pendulum_on_a_string(t_end=3.0, rope={"when_slack": "slack"})
    scene.start.update({"bob.position.x": 0.0, "bob.position.z": -1.0, "bob.velocity.x": math.sqrt(3.5 * 9.81)})
    result = simulate(scene, rtol=1e-8)
    assert result.events
    assert solvers(result)[0] == solvers(result)[-1] == "explicit"
    assert result.energy.max_drift < 1e-6


def test_missing_libraries_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    missing = sundials_library.SundialsMissing("they are elsewhere")
    monkeypatch.setattr(sundials_library, "_found", missing)
    for options in ({"form": "dae", "level": "index1"}, {"solver": "ida"}, {"solver": "ida-sundae"}):
        with pytest.raises(sundials_library.SundialsMissing, match="they are elsewhere") as found:
            simulate(SCENES["double-pendulum"](), t_end=0.1, **options)
        assert "scikit-sundae" in (found.value.advice or "")
    assert solvers(simulate(SCENES["double-pendulum"](), t_end=0.1, outputs=3)) == ["explicit"]


@pytest.mark.sample(1)
@pytest.mark.parametrize("solver", ["explicit", "auto"])
def test_a_long_chain_does_not_fly_apart_at_a_loose_tolerance(solver: str) -> None:
    """At 0.1 its steps became too small to move the time, at 0.53 s."""
    loose = simulate(SCENES["chain"](links=40), rtol=0.1, solver=solver, t_end=2.0, outputs=11)
    tight = simulate(SCENES["chain"](links=40), rtol=1e-3, solver=solver, t_end=2.0, outputs=11)
    assert loose.status == "finished"
    assert loose.statistics.steps == tight.statistics.steps
    assert loose.energy.max_drift < 0.1
