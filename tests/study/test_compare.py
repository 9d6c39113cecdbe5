"""Comparing forms against a reference."""

import importlib
import json
import math
from typing import Any

import numpy as np
import pytest

from atwood import Scene, SolveError, UsageError, connect
from atwood.pipeline import simulate
from atwood.result.result import Result
from atwood.simulation.problem.options import how_solved
from atwood.study import Comparison, compare
from atwood.study.comparison.found import judge
from atwood_library import Ground, Mass1D, PointMass, Rod, Rope, Spring
from atwood_library.scenes import SCENES

compare_module = importlib.import_module("atwood.study.comparison.compare")


class Pendulum(Scene):
    ground: Ground = Ground()
    rod: Rod = Rod()
    bob: PointMass = PointMass()
    connections = [connect(ground.frame, rod.a), connect(rod.b, bob.point)]
    start = {"rod.angle": 1.0, "rod.angular_velocity": 0.0}
    t_end = 1.0


class Oscillator(Scene):
    space = "line"
    ground: Ground = Ground()
    spring: Spring = Spring(stiffness=4.0, natural_length=1.0)
    mass: Mass1D = Mass1D()
    connections = [connect(ground.frame, spring.a), connect(spring.b, mass.flange)]
    start = {"mass.displacement": 1.5, "mass.speed": 0.0}
    t_end = 2.0

    def closed_form(self, t: np.ndarray) -> dict[str, np.ndarray]:
        return {"mass.displacement": 1.0 + 0.5 * np.cos(2.0 * t), "spring.tension": 2.0 * np.cos(2.0 * t)}


@pytest.fixture(scope="module")
def pendulum() -> Comparison:
    return compare(Pendulum(), rtols=(1e-4, 1e-6, 1e-8), name="pendulum")


@pytest.mark.sample(0)
def test_every_form_and_level_has_its_rows(pendulum: Comparison) -> None:
    ida, explicit, gauss = "SUNDIALS IDA", "Dormand-Prince 8(5,3)", "Gauss, symplectic"
    kinds = {(row.form, row.level, row.solver) for row in pendulum.rows}
    levels = {("dae", level, ida) for level in ("ggl", "index1-projected", "index1")}
    methods = {("reduced", "", ida), ("reduced", "", explicit), ("reduced", "", gauss), ("dae", "", explicit)}
    assert kinds == methods | levels
    assert len(pendulum.rows) == 21
    assert not [row.reason for row in pendulum.rows if row.reason]


def test_errors_fall_with_the_tolerance(pendulum: Comparison) -> None:
    assert pendulum.reference.kind == "quadrature"
    assert pendulum.reference.error < 1e-8
    for label in {row.label for row in pendulum.rows}:
        rows = [row for row in pendulum.rows if row.label == label]
        errors = [row.error or 0.0 for row in rows]
        assert errors[0] > 10.0 * errors[1] > 10.0 * errors[2] > 0.0, label
        assert [row.steps for row in rows] == sorted(row.steps or 0 for row in rows)
        assert errors[2] < 1e-4


def test_the_error_is_the_difference_from_a_tight_solution(pendulum: Comparison) -> None:
    rough = simulate(Pendulum(), rtol=1e-4, outputs=pendulum.reference.time, solver="ida")
    tight = simulate(Pendulum(), rtol=1e-11, outputs=pendulum.reference.time)
    paths = ("rod.angle", "bob.position.x", "bob.position.z")
    expected = max(float(np.max(np.abs(rough.array(path) - tight.array(path)))) for path in paths)
    row = next(row for row in pendulum.rows if row.form == "reduced" and row.rtol == 1e-4)
    assert row.error == pytest.approx(expected, rel=1e-3)


def test_plain_index_1_shows_its_drift(pendulum: Comparison) -> None:
    drift = {row.level: row.constraint_drift for row in pendulum.rows if row.form == "dae" and row.rtol == 1e-4}
    assert (drift["index1"] or 0.0) > 1e-6
    assert (drift["ggl"] or 1.0) < 1e-12
    assert (drift["index1-projected"] or 1.0) < 1e-12


def test_it_is_text_and_data(pendulum: Comparison) -> None:
    data = json.loads(json.dumps(pendulum.to_dict(), allow_nan=False))
    assert len(data["rows"]) == 21
    assert data["scene"] == "pendulum"
    assert "dae (index1-projected)" in str(pendulum)
    assert pendulum.verdict in str(pendulum)
    assert "For an error of" in pendulum.verdict


def test_a_closed_form_is_the_reference() -> None:
    found = compare(Oscillator(), rtols=(1e-6,))
    assert found.reference.kind == "closed form"
    assert list(found.reference.quantities) == ["mass.displacement"]
    assert {row.form for row in found.rows} == {"reduced", "dae"}
    assert len(found.rows) == 4  # two methods come on top; without constraints, all levels are one
    assert all(0.0 < (row.error or 0.0) < 1e-4 for row in found.rows)


def test_a_closed_form_for_another_start_is_not_used() -> None:
    scene = Oscillator()
    scene.start["mass.displacement"] = 1.2
    found = compare(scene, rtols=(1e-6,), forms=("reduced",))
    assert found.reference.kind == "quadrature"
    assert "another start" in found.reference.note


def test_a_failed_run_stays_in_the_table(monkeypatch: pytest.MonkeyPatch) -> None:
    inner = compare_module.run_form

    def fail(assembled: Any, form: str, level: str, rtol: float, *rest: Any) -> Result:
        if rtol < 1e-5:
            raise SolveError("the step became too small")
        return inner(assembled, form, level, rtol, *rest)

    monkeypatch.setattr(compare_module, "run_form", fail)
    found = compare(Pendulum(), rtols=(1e-4, 1e-6), forms=("reduced",))
    assert [row.reason for row in found.rows] == ["", "the step became too small"] * 3
    assert found.rows[1].error is None
    assert "the step became too small" in str(found)
    assert json.loads(json.dumps(found.to_dict(), allow_nan=False))["rows"][1]["steps"] is None


def test_a_rope_that_goes_slack_ends_the_comparison() -> None:
    scene = Scene(t_end=2.0)
    ground = scene.add("ground", Ground())
    rope = scene.add("rope", Rope(length=1.0))
    bob = scene.add("bob", PointMass())
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, bob.point)
    scene.start.update({"bob.position.x": 0.0, "bob.position.z": -1.0, "bob.velocity.x": math.sqrt(3.5 * 9.81)})
    found = compare(scene, rtols=(1e-6,))
    assert 0.2 < found.t_end < 1.0
    assert "slack" in found.reference.note
    assert all(row.error is not None and row.error < 1e-3 for row in found.rows)


@pytest.mark.parametrize("wrong", [{"rtols": ()}, {"rtols": (0.0,)}, {"forms": ("dea",)}, {"levels": ("ggl2",)}])
def test_what_makes_no_sense_is_refused(wrong: dict) -> None:
    with pytest.raises(UsageError):
        compare(Pendulum(), **wrong)


def test_verdicts() -> None:
    fast = [("reduced", 1e-4, 0.001), ("reduced", 1e-6, 0.002)]
    slow = [("dae (ggl)", 1e-4, 0.01), ("dae (ggl)", 1e-6, 0.02)]
    assert judge([*fast, *slow]).startswith("For an error of 1e-04, reduced takes 1 ms")
    assert "10.0 times" in judge([*fast, *slow])
    assert "all cost the same" in judge([*fast, ("dae", 1e-4, 0.001), ("dae", 1e-6, 0.002)])
    assert judge([]) == "There is nothing to compare."
    assert "Only reduced" in judge(fast)
    assert "no error in common" in judge([("a", 1e-2, 1.0), ("b", 1e-9, 1.0)])


@pytest.mark.parametrize("name", ["pendulum-on-cart", "rotating-hoop-free"])
def test_motions_of_one_coordinate_are_compared_with_quadratures(name: str) -> None:
    found = compare(SCENES[name](), rtols=[1e-5, 1e-9], forms=["reduced"], t_end=2.0)
    assert found.reference.kind == "quadrature"
    assert found.reference.error < 1e-12
    assert "quadrature of its effective potential" in str(found)
    tightest = min(row.error for row in found.rows if row.error is not None)
    assert 1e-13 < tightest < 1e-6


def test_every_row_names_form_and_solver(pendulum: Comparison) -> None:
    ida = {f"dae ({level}), IDA" for level in ("ggl", "index1-projected", "index1")}
    assert {row.label for row in pendulum.rows} == ida | {
        "reduced, IDA", "reduced, explicit", "reduced, gauss", "dae, explicit",
    }  # fmt: skip
    assert all(label in str(pendulum) for label in ida)


def test_a_level_is_named_only_where_the_solver_has_one() -> None:
    said = {solver: simulate(Pendulum(), form="dae", solver=solver, t_end=0.1).method for solver in ("ida", "explicit")}
    assert said == {"ida": "dae (ggl), IDA", "explicit": "dae, explicit"}
    assert how_solved("dae", "ggl", ["explicit", "ida", "explicit"]) == "dae, explicit, then dae (ggl), IDA"
    assert how_solved("reduced", "", []) == "reduced"
