"""Explicit steps where constraints stay: loops and rolling of the reduced form, and all of the dae form."""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from atwood import Scene, assemble, simulate
from atwood.arrays import FloatArray
from atwood.integrators.embedded.stepper import CompiledStepper
from atwood.integrators.explicit_session import ExplicitSession
from atwood.integrators.methods.dormand_prince import TABLEAU
from atwood.integrators.protocol import ExplicitProblem, Nearest, SolverOptions
from atwood.simulation.initialization.start import find_start, own_state
from atwood.simulation.problem.explicit_scene import constrained_problem
from atwood.simulation.problem.preparation import make_problem
from atwood.simulation.problem.problem import SceneProblem
from atwood.simulation.problem.projection import misses_of, project_rows, project_states
from atwood_library import PointMass
from atwood_library.scenes import (
    BenchmarkBicycle,
    Bricard,
    Chain,
    DoublePendulum,
    FourBar,
    FourBarRow,
    FreeBody,
    Kepler,
    RollingDisc,
    SimplePendulum,
    StewartPlatform,
    Strandbeest,
)

from ..helpers.mechanisms import parallel_four_bar
from ..helpers.runs import FORMS
from ..integrators.embedded_reference import ReferenceStepper
from ..scenes.test_turned_mechanisms import BASES, stands_on
from .test_not_compilable import Odd, Plain, looped


def opened(scene: Scene, form: str) -> tuple[SceneProblem, ExplicitProblem, FloatArray]:
    """Return a scene at its start, with its equations for an explicit method."""
    assembly = assemble(scene, form=form)  # type: ignore[arg-type]
    start = find_start(assembly)
    q, u = own_state(assembly, start)
    plan = make_problem(assembly, start.time, q, u, start.length, 1.0)
    y = np.concatenate([q, u])
    return plan, constrained_problem(plan, start.time, y), y


def absolute(plan: SceneProblem, tolerance: float) -> FloatArray:
    """Return absolute tolerances of coordinates and speeds."""
    return tolerance * np.concatenate([plan.coordinate_sizes, plan.sizes / plan.scales.time])


def moving_bricard() -> Bricard:
    scene = Bricard()
    scene.start.update({"hinge1.angle": 0.3, "hinge1.angular_velocity": 2.0})
    return scene


LOOPS_AND_CHAINS: dict[str, tuple[Any, str]] = {
    "bricard": (moving_bricard, "reduced"),
    "four-bar": (FourBar, "reduced"),
    "chain": (lambda: Chain(links=3), "dae"),
    "bricard, dae": (moving_bricard, "dae"),
}


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("name", "t_end", "few", "many"),
    [("bricard", 1.0, 6, 16), ("four-bar", 0.5, 6, 16), ("chain", 0.5, 12, 32), ("bricard, dae", 1.0, 6, 12)],
    ids=lambda one: one if isinstance(one, str) else "",
)
def test_the_order_is_eight(name: str, t_end: float, few: int, many: int) -> None:
    """Equal steps, each of which ends on the constraints: their error goes with the eighth power of their length."""
    make, form = LOOPS_AND_CHAINS[name]
    _, problem, y = opened(make(), form)

    def after(steps: int) -> FloatArray:
        options = SolverOptions(0.5, 1e6, first_step=t_end / steps, max_step=t_end / steps, horizon=t_end)
        return ExplicitSession(problem, options, CompiledStepper(problem, options, TABLEAU), 0.0, y).advance(t_end).y

    exact = after(1000)
    errors = [float(np.max(np.abs(after(steps) - exact))) for steps in (few, many)]
    assert math.log(errors[0] / errors[1]) / math.log(many / few) > 7.3


@pytest.mark.parametrize("form", FORMS)
def test_compiled_steps_are_those_of_the_reference(form: str) -> None:
    plan, problem, y = opened(moving_bricard(), form)
    options = SolverOptions(1e-9, absolute(plan, 1e-9), horizon=1.0)
    ends = []
    for kind in (ReferenceStepper, CompiledStepper):
        session = ExplicitSession(problem, options, kind(problem, options, TABLEAU), 0.0, y)
        ends.append((session.advance(1.0), session.statistics.steps))
    (one, taken), (other, also) = ends
    assert taken == also
    assert_allclose(one.y, other.y, rtol=0.0, atol=1e-11)


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", LOOPS_AND_CHAINS)
def test_steps_end_on_the_constraints_and_the_dense_output_meets_them(name: str) -> None:
    make, form = LOOPS_AND_CHAINS[name]
    plan, problem, y = opened(make(), form)
    tolerance = 1e-7
    options = SolverOptions(tolerance, absolute(plan, tolerance), horizon=1.0)
    session = ExplicitSession(problem, options, CompiledStepper(problem, options, TABLEAU), 0.0, y)
    on_the_way = []
    for t in np.linspace(0.0, 1.0, 30)[1:]:
        state = session.advance(float(t)).y
        on_the_way.append(plan.balance.misses(float(t), *plan.program.split(state), plan.sizes))
    t, state, _ = session._stepper.state()
    ends = plan.balance.misses(t, *plan.program.split(state), plan.sizes)
    assert max(ends) < 1e-12
    assert np.max(np.array(on_the_way)) < 100.0 * tolerance


def last(scene: Any, form: str, path: str, **options: Any) -> float:
    settings = {"t_end": 1.0, "rtol": 1e-11, "solver": "explicit", "outputs": 2, "samples": 1, **options}
    return float(simulate(scene, form=form, **settings)[path][-1])


def test_both_forms_of_trees_agree() -> None:
    for scene, path in ((SimplePendulum(), "rod.angle"), (DoublePendulum(), "rod2.angle"), (Chain(), "rod[9].angle")):
        assert_allclose(last(scene, "dae", path), last(scene, "reduced", path), rtol=0.0, atol=2e-9)


@pytest.mark.sample(2)
@pytest.mark.parametrize("base", BASES[1:3], ids=["turned", "askew"])
@pytest.mark.parametrize("form", FORMS)
def test_a_loop_moves_alike_wherever_it_stands(form: str, base: Any) -> None:
    found = last(stands_on("bricard", *base), form, "hinge3.angle")
    assert_allclose(found, last(stands_on("bricard", *BASES[0]), "reduced", "hinge3.angle"), rtol=0.0, atol=1e-9)


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_the_redundant_loop_of_bricard_keeps_its_relation_and_its_energy(form: str) -> None:
    result = simulate(moving_bricard(), form=form, t_end=5.0, rtol=1e-10, solver="explicit", outputs=60)
    a, b = result["hinge1.angle"], result["hinge2.angle"]
    assert_allclose((1.0 + np.sin(a)) * (1.0 + np.sin(b)), 1.0, rtol=0.0, atol=1e-9)
    assert result.energy.max_drift < 3e-8
    assert [one.solver for one in result.run.choices] == ["explicit"]


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_rolling_keeps_what_it_conserves(form: str) -> None:
    for scene in (RollingDisc(), BenchmarkBicycle()):
        result = simulate(scene, form=form, t_end=1.0, rtol=1e-10, solver="explicit", outputs=20)
        total = result.energy.total
        assert_allclose(total, total[0], rtol=0.0, atol=3e-9 * float(np.max(result.energy.kinetic)))


@pytest.mark.sample(2)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    ("scene", "path"),
    [(Bricard(), "hinge4.angle"), (StewartPlatform(), "leg1.displacement"), (Strandbeest(), "crank.angle")],
    ids=["bricard", "stewart", "strandbeest"],
)
def test_ida_comes_to_the_same(scene: Scene, path: str, form: str) -> None:
    assert_allclose(
        last(scene, form, path, rtol=1e-10), last(scene, form, path, rtol=1e-11, solver="ida"), rtol=0.0, atol=3e-7
    )


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_reactions_are_those_of_the_motion(form: str) -> None:
    """The tension of a pendulum's rod: m (g cos a + l w^2)."""
    settings: dict[str, Any] = {"t_end": 2.0, "rtol": 1e-10, "outputs": 20}
    result = simulate(SimplePendulum(), form=form, solver="explicit", **settings)
    angle = result["rod.angle"]
    pull = 2.0 * 9.81 * (np.cos(angle) - math.cos(float(angle[0])))  # m l w^2, from its energy
    assert_allclose(np.abs(result["rod.tension"]), 9.81 * np.cos(angle) + pull, rtol=0.0, atol=1e-7)
    loop = simulate(moving_bricard(), form=form, solver="explicit", **settings)
    other = simulate(moving_bricard(), form=form, solver="ida", **{**settings, "rtol": 1e-11})
    for path in ("hinge2.angle", "hinge1.angular_velocity"):
        assert_allclose(loop[path], other[path], rtol=0.0, atol=1e-6)
    assert_allclose(loop.energy.total, other.energy.total, rtol=0.0, atol=1e-6)


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_an_event_in_a_loop_is_found_at_its_time(form: str) -> None:
    ends = []
    for solver, rtol in (("explicit", 1e-10), ("ida", 1e-11)):
        result = simulate(
            moving_bricard(), form=form, t_end=5.0, rtol=rtol, solver=solver, until="hinge1.angle rises above 1 rad"
        )
        assert result.status == "stopped"
        ends.append(float(result.time[-1]))
    assert_allclose(ends[0], ends[1], rtol=0.0, atol=1e-7)


def test_singular_positions_on_the_way_are_passed_as_accurately() -> None:
    """Two windows of parallelograms that pass through a line: the forms agree, and so do tolerances."""
    found = [
        simulate(FourBarRow(), form="dae", t_end=1.5, rtol=rtol, solver="explicit", outputs=4) for rtol in (1e-7, 1e-10)
    ]
    for result in found:
        assert len(result.singular_crossings) == 2
        assert result.energy.max_drift < 1e-6
    assert_allclose(found[0]["crank[1].angle"], found[1]["crank[1].angle"], rtol=0.0, atol=1e-5)


def with_massless_links() -> Scene:
    """A parallelogram whose links have no mass, and one mass at its corner: no body but that has inertia of its own."""
    scene = parallel_four_bar(2)
    for name in ("crank0", "crank1", "coupler"):
        scene.set(f"{name}.mass", 0.0)
    bob = scene.add("bob", PointMass(mass=2.0))
    scene.connect(scene.coupler.b, bob.point)
    return scene


@pytest.mark.parametrize("form", FORMS)
def test_what_has_no_inertia_of_its_own_is_carried_by_what_has(form: str) -> None:
    """The corner goes round as a pendulum: its energy gives its speed, and IDA the angle."""
    result = simulate(with_massless_links(), form=form, t_end=1.0, rtol=1e-10, solver="explicit", outputs=10)
    other = simulate(with_massless_links(), form=form, t_end=1.0, rtol=1e-11, solver="ida", outputs=10)
    assert_allclose(result["crank0.angle"], other["crank0.angle"], rtol=0.0, atol=1e-7)
    assert result.energy.max_drift < 1e-7


@pytest.mark.parametrize("scene", [Kepler(), FreeBody()], ids=["kepler", "free body"])
def test_what_has_no_constraints_runs_in_the_dae_form_too(scene: Scene) -> None:
    one, other = (simulate(scene, form=form, t_end=1.0, rtol=1e-11, solver="explicit", outputs=3) for form in FORMS)
    assert_allclose(one.energy.kinetic, other.energy.kinetic, rtol=1e-9)


@pytest.mark.parametrize("form", FORMS)
def test_functions_in_python_take_the_same_steps(form: str) -> None:
    ends = []
    for kind in (Plain, Odd):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it says that Python is called
            result = simulate(looped(kind), form=form, t_end=0.3, rtol=1e-8, solver="explicit", outputs=3)
        ends.append((result["crank.angle"][-1], result.statistics.steps))
    assert_allclose(ends[0], ends[1], rtol=1e-9)


@pytest.mark.parametrize(("scene", "form"), [(RollingDisc, "reduced"), (RollingDisc, "dae"), (FourBar, "dae")])
def test_series_end_on_constraints_too(scene: type[Scene], form: str) -> None:
    runs = [simulate(scene(), solver=one, form=form, t_end=1.0, rtol=1e-11) for one in ("taylor", "explicit")]
    for path in (one for one in runs[0] if one.endswith(".position.x")):
        assert_allclose(runs[0][path], runs[1][path], atol=1e-9)
    assert runs[0].energy.max_drift < 1e-10
    assert runs[0].statistics.steps < 0.7 * runs[1].statistics.steps


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("scene", [Bricard, RollingDisc, DoublePendulum, StewartPlatform])
def test_outputs_taken_onto_constraints_by_machine_code_are_the_nearest_states(scene: type[Scene], form: str) -> None:
    """They are those of the normal equations, which have the rest: here every third is left to these."""
    plan, problem, y = opened(scene(), form)
    rng = np.random.default_rng(1)
    t = np.full(40, plan.assembly.flat.t_start)
    rough = y[:, None] + absolute(plan, 1e-4)[:, None] * rng.uniform(-1.0, 1.0, (len(y), len(t)))
    q, u = plan.program.split(rough)
    session = ExplicitSession(
        problem, SolverOptions(), CompiledStepper(problem, SolverOptions(), TABLEAU), float(t[0]), y
    )
    missed: list[int] = []

    def every_third_is_left(t: FloatArray, rows: FloatArray, sizes: FloatArray) -> Nearest | None:
        made = session.nearest(t, rows, sizes)
        if made is not None:
            assert made.met.all()
            missed.append(len(made.met[::3]))
            made.met[::3] = False
        return made

    plain, rows = project_states(plan, t, q, u), np.ascontiguousarray(rough.T)
    by_code = project_rows(plan, t, rows, session.nearest)
    mixed = project_rows(plan, t, rows, every_third_is_left)
    assert bool(missed) == bool(plan.balance.constraints)
    for one in (by_code, mixed):
        assert not one.doubtful.any()
        assert_allclose(one.misses(), plain.misses(), rtol=1e-12, atol=1e-15)
        miss = (one.coordinates - plain.coordinates) / plan.coordinate_sizes[:, None]
        assert np.max(np.abs(miss), initial=0.0) < 1e-7  # of second order in how far they were taken
        assert np.max(misses_of(plan, t, one.coordinates, one.speeds), initial=0.0) < 1e-11
    if missed:
        left = (mixed.coordinates - plain.coordinates)[:, ::3] / plan.coordinate_sizes[:, None]
        assert np.max(np.abs(left)) < 1e-15  # sums of other numbers of states are rounded otherwise
