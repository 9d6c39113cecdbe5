"""The option that says in which coordinates orientations are."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner, Result

from atwood.cli import main


def run(*arguments: str) -> Result:
    return CliRunner().invoke(main, list(arguments))


def test_a_run_says_when_coordinates_were_switched() -> None:
    done = run("run", "lagrange-top", "--orientation", "euler-xzy", "--t-end", "1")
    assert done.exit_code == 0, done.stderr
    assert "6 states" in done.stdout
    assert "euler-xzy, switched" in done.stdout
    data = json.loads(run("run", "lagrange-top", "--orientation", "euler-xzy", "--t-end", "1", "--json").stdout)
    assert data["orientation"] == "euler-xzy"
    assert len(data["restated"]) > 3
    assert {one["body"] for one in data["restated"]} == {"top"}
    assert "top.euler.theta" in data["coordinates"]
    usual = json.loads(run("run", "lagrange-top", "--t-end", "1", "--json").stdout)
    assert (usual["orientation"], usual["restated"], usual["states"]) == ("quaternion", [], 7)
    assert usual["end"].keys() == data["end"].keys()
    for path, value in usual["end"].items():
        assert data["end"][path] == pytest.approx(value, rel=1e-5, abs=1e-5), path


def test_the_report_has_the_coordinates_that_were_asked_for() -> None:
    data = json.loads(run("info", "free-body", "--orientation", "euler-zyz", "--json").stdout)
    assert data["states"] == {"reduced": 12, "dae": 13}
    assert "body.euler.theta" in data["coordinates"]
    assert "body.euler.theta" in data["start"]["free_coordinates"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [(("--orientation", "euler-zyy"), "euler-zyz"), (("--orientation", "euler-zyz", "--form", "dae"), "reduced form")],
)
def test_what_there_is_not_is_refused(arguments: tuple[str, ...], said: str) -> None:
    done = run("run", "lagrange-top", *arguments)
    assert done.exit_code != 0
    assert said in done.stderr
