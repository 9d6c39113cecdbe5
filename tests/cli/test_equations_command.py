"""`atwood equations` on the command line."""

import json

import pytest
from click.testing import CliRunner

from atwood.cli import main


def run(*arguments: str) -> str:
    outcome = CliRunner().invoke(main, ["equations", *arguments])
    assert outcome.exit_code == 0, outcome.output
    return outcome.output


def test_a_page_for_the_terminal() -> None:
    shown = run("double-pendulum")
    assert "T = ½ (m₁ + m₂) l₁² θ̇₁² + m₂ l₁ l₂ θ̇₁ θ̇₂ cos(θ₁ - θ₂) + ½ m₂ l₂² θ̇₂²" in shown
    assert shown.splitlines()[0] == "Symbols"
    assert "θ₁" in shown.splitlines()[1]
    assert "rod1.angle" in shown.splitlines()[1]


@pytest.mark.parametrize(
    ("option", "beginning"),
    [("--latex", "\\begin{aligned}"), ("--markdown", "# simple-pendulum (dae form)"), ("--python", '"""Equations of')],
)
def test_other_ways_to_write_them(option: str, beginning: str) -> None:
    assert run("simple-pendulum", "--form", "dae", option).startswith(beginning)


def test_as_data() -> None:
    found = json.loads(run("lagrange-top", "--orientation", "euler-zxz", "--json"))
    assert found["readable"]
    assert [one["symbol"] for one in found["symbols"]] == ["phi", "theta", "psi", "m", "c_z", "I_1", "I_3", "g"]
    assert found["potential_energy"] == {"latex": "m g c_{z} \\cos \\theta", "python": "m * g * c_z * cos(theta)"}
    large = json.loads(run("chain", "--set", "links=30", "--json"))
    assert not large["readable"]
    assert large["structure"]["coordinates"] == 30


def test_values() -> None:
    assert "6.867 sin θ" in run("simple-pendulum", "--set", "length=0.7", "--values")


def test_what_does_not_go_together_is_refused() -> None:
    outcome = CliRunner().invoke(main, ["equations", "simple-pendulum", "--latex", "--json"])
    assert outcome.exit_code != 0
    assert "do not go together" in outcome.output


def test_the_hamiltonian() -> None:
    assert "H = ½ p_θ² / (m l²) - m g l cos θ" in run("simple-pendulum", "--hamiltonian")
    assert json.loads(run("simple-pendulum", "--hamiltonian", "--json"))["is_conserved"] is True
    outcome = CliRunner().invoke(main, ["equations", "simple-pendulum", "--hamiltonian", "--python"])
    assert "is not written in Python" in outcome.output
