"""The stages from a scene to its motion, and what each takes."""

import json
import time

import pytest
from click.testing import CliRunner

from atwood import assemble, simulate
from atwood.cli import main
from atwood.stages import STAGES, stage, watching
from atwood_library.scenes import DoublePendulum


def test_a_stage_is_charged_with_its_own_time_alone():
    with watching() as stopwatch, stage("start"):
        time.sleep(0.02)
        with stage("equations"):
            time.sleep(0.05)
            with stage("code"):
                time.sleep(0.01)
        time.sleep(0.02)
    found = stopwatch.seconds
    assert found["start"] >= 0.04
    assert found["equations"] >= 0.05
    assert found["code"] >= 0.01
    assert list(stopwatch.in_order()) == ["equations", "code", "start"]


def test_stages_cost_nothing_where_nobody_watches():
    with stage("start"):
        pass
    with watching() as outer, watching() as inner:
        assert inner is outer


def test_an_error_ends_its_stages():
    with watching() as stopwatch:
        with pytest.raises(ValueError, match="x"), stage("start"), stage("equations"):
            raise ValueError("x")
        with stage("integration"):
            pass
    assert set(stopwatch.seconds) == {"start", "equations", "integration"}


def test_results_know_what_their_stages_took():
    began = time.perf_counter()
    result = simulate(DoublePendulum(), t_end=0.5)
    spent = time.perf_counter() - began
    assert list(result.timings) == list(STAGES)
    assert all(one >= 0.0 for one in result.timings.values())
    assert 0.0 < sum(result.timings.values()) <= spent
    assembly = assemble(DoublePendulum())
    simulate(assembly, t_end=0.5)
    again = simulate(assembly, t_end=0.5).timings
    assert "flatten" not in again
    assert "mechanism" not in again
    assert "equations" not in again


def test_the_command_line_shows_them():
    runner = CliRunner()
    text = runner.invoke(main, ["run", "double-pendulum", "--timings"]).output
    for name, made in STAGES.items():
        assert any(line.startswith(name) and line.endswith(made) for line in text.splitlines())
    data = json.loads(runner.invoke(main, ["run", "double-pendulum", "--timings", "--json"]).output)
    assert list(data["timings"]) == list(STAGES)
    assert "timings" not in json.loads(runner.invoke(main, ["run", "double-pendulum", "--json"]).output)
