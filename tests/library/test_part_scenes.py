"""The small scenes that the documents show for each part: there is one for each, and it runs and has equations."""

import sys
from pathlib import Path
from typing import Any

import pytest

from atwood import Result, UsageError, equations, page, plot_mechanism
from atwood.cli.parts import library_parts

sys.path.append(str(Path(__file__).parents[2] / "docs"))
from part_scenes import SCENES, code_of, mesh


def run(name: str) -> Result:
    known: dict[str, Any] = {}
    exec(code_of(name), known)
    result: Result = known["result"]
    return result


@pytest.mark.sample(6)
@pytest.mark.parametrize("name", SCENES)
def test_it_runs_and_moves(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "wedge.stl").write_text(mesh())
    monkeypatch.chdir(tmp_path)
    result = run(name)
    assert result.status == "finished"
    assert any(result.array(path).max() - result.array(path).min() > 1e-3 for path in result.paths)


def test_each_part_has_one() -> None:
    assert set(SCENES) == set(library_parts())
    assert all(f"{name}(" in code_of(name) for name in SCENES)


@pytest.mark.parametrize("name", ["LossyGear", "Table", "SampleDelay"])
def test_equations_of_choices_in_choices_and_of_sampled_rows_are_written(name: str) -> None:
    """Choices that share what they choose from were written out endlessly; a row of samples has the name of all."""
    assert equations(run(name).assembly).html()


def test_a_page_that_could_not_go_on_as_its_scene_says_plays_its_record() -> None:
    made = page(run("Table"))
    assert made.mode == "recorded"
    assert "source.table: it ends at t = 2 s" in made.reason


def test_what_has_no_bodies_has_neither_a_centre_nor_a_picture() -> None:
    result = run("Gain")
    assert "mass" in result
    assert "center_of_mass.x" not in result
    assert "nothing.at_all" not in result
    for draw in (plot_mechanism, page):
        with pytest.raises(UsageError, match="place to be drawn"):
            draw(result)
