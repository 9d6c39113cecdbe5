"""`atwood run --energy parts`: the energy of each component as a table, as JSON, in files and as a picture."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner

from atwood import load_result, simulate
from atwood.cli.app import main
from atwood_library.scenes.double_pendulum import DoublePendulum


def run(*arguments: str) -> str:
    done = CliRunner().invoke(main, ["run", "double-pendulum", "--t-end", "0.5", *arguments], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done.output


def test_table_says_what_each_component_gained_and_through_which_connector(tmp_path):
    parts = simulate(DoublePendulum(), t_end=0.5).energy.parts
    shown = run("--energy", "parts", "--plot", str(tmp_path / "stack.png"), "--save", str(tmp_path / "run.npz"))
    row = next(line for line in shown.splitlines() if line.startswith("rod2   "))
    given = parts["rod2"].work["b"][-1]
    assert f"a {-given:.4g}, b {given:.4g}" in row
    assert "every component balances to" in shown
    assert (tmp_path / "stack.png").stat().st_size > 10_000
    saved = load_result(tmp_path / "run.npz")
    np.testing.assert_array_equal(saved["bob2.energy.work.point"], parts["bob2"].work["point"])
    assert "bob2.position.x" in saved
    assert saved.status == "finished"


def test_json_has_the_same_and_nothing_of_it_unasked():
    data = json.loads(run("--energy", "parts", "--json"))["energy"]["parts"]
    assert data["rod2"]["work.b"] == pytest.approx(-data["bob2"]["work.point"], rel=1e-14) != 0.0
    assert abs(data["bob2"]["gained"] - data["bob2"]["work.point"]) < 1e-5
    assert data["rod2"]["is_unique"] is True
    assert "parts" not in json.loads(run("--json"))["energy"]
    assert "came in through" not in run()
