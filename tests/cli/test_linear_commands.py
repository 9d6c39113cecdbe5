"""Commands that look at a scene near a state."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from atwood.cli.app import main


def run(*arguments: str) -> str:
    done = CliRunner().invoke(main, arguments)
    assert done.exit_code == 0, done.output
    return done.output


def test_modes_are_those_of_stable_equilibria_unless_the_start_is_at_rest() -> None:
    found = json.loads(run("modes", "double-pendulum", "--json"))
    assert len(found["modes"]) == 1
    assert found["modes"][0]["angular_frequencies"] == pytest.approx([2.3971994, 5.7873513])
    assert "shape" in run("modes", "mass-spring-chain")


def test_a_linear_model_has_a_table_and_a_picture(tmp_path: Path) -> None:
    picture = tmp_path / "bode.png"
    options = ["--at", "rod.angle=180deg", "--input", "rail.actuator", "--output", "rod.angle", "--bode", str(picture)]
    text = run("linearize", "pendulum-on-cart", *options)
    assert "some deviations grow" in text
    assert picture.stat().st_size > 1000


def test_equilibria_in_a_region() -> None:
    found = json.loads(run("equilibria", "pendulum-on-cart", "--region", "rod.angle=-10:10deg", "--json"))
    assert [one["stable"] for one in found["equilibria"]] == [True]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["linearize", "pendulum-on-cart"], "neither at rest"),
        (["linearize", "pendulum-on-cart", "--at", "rod.angle=0", "--input", "rail.actuatr"], "rail.actuator"),
        (["equilibria", "pendulum-on-cart", "--region", "rod.angle=3"], "FROM:TO"),
        (["modes", "pendulum-on-cart", "--at", "rod.angel=0"], "rod.angle"),
    ],
)
def test_mistakes_are_answered(arguments: list[str], said: str) -> None:
    done = CliRunner().invoke(main, arguments)
    assert done.exit_code != 0
    assert said in done.output


@pytest.mark.sample(0)
def test_phase_draws_and_tells_states_of_rest(tmp_path: Path) -> None:
    picture = tmp_path / "phase.png"
    found = run("phase", "simple-pendulum", "--coordinates", "-180:180deg", "--plot", str(picture))
    assert "centre" in found
    assert "saddle" in found
    assert picture.stat().st_size > 10_000
    data = json.loads(run("phase", "oscillators", "--set", "kind=inverted", "--json"))
    assert [one["kind"] for one in data["rest_points"]] == ["saddle"]
    assert len(data["separatrices"]) == 4
    assert "at rest everywhere" in run("phase", "oscillators", "--set", "kind=free")
    refused = CliRunner().invoke(main, ["phase", "simple-pendulum", "--speeds", "3"])
    assert refused.exit_code != 0
    assert "Write FROM:TO" in refused.output
