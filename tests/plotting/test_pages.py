"""Pages as files: what is refused, what they hold, and how large they are."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from atwood import AtwoodError, SavedResult, UsageError, diagram, load_result, page, simulate
from atwood.cli import main
from atwood_library.scenes import SCENES


@pytest.fixture(scope="module")
def result() -> Any:
    return simulate(SCENES["double-pendulum"](), t_end=0.5)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"show": "rod1.angel"}, "rod1.angle"),
        ({"sliders": "rod1.lenght"}, "rod1.length"),
        ({"sliders": "rod1.length=2:1"}, "wrong way round"),
        ({"sliders": "rod1.length=a:1"}, "no slider"),
        ({"file": "page.txt"}, r"\.html"),
        ({"file": "no/such/folder/page.html"}, "folder"),
    ],
)
def test_what_cannot_be_shown_is_refused(result: Any, options: dict[str, Any], said: str) -> None:
    with pytest.raises(AtwoodError, match=said):
        page(result, **options)


def test_a_file_of_results_is_run_again_where_it_holds_the_scene(result: Any, tmp_path: Path) -> None:
    saved = load_result(result.save(tmp_path / "a.npz"))
    assert page(saved).mode == "live"
    bare = SavedResult(saved.time, saved.quantities, saved.units)
    with pytest.raises(UsageError, match="does not"):
        page(bare)
    with pytest.raises(UsageError, match="a scene, a Result"):
        page([])


def test_a_plane_and_space_have_no_common_picture(result: Any) -> None:
    with pytest.raises(UsageError, match="no common picture"):
        page([result, simulate(SCENES["lagrange-top"](), t_end=0.1)])


def test_a_page_is_one_file_that_may_ask_for_nothing(result: Any, tmp_path: Path) -> None:
    made = result.to_html(tmp_path / "a.html")
    text = made.read_text(encoding="utf-8")
    assert "default-src 'none'" in text
    assert not re.search(r"(src|href)=[\"']?https?:", text)
    assert len(text) < 350_000
    assert text.count("<svg") == 1, "without script there is a still picture"


def test_the_largest_scenes_are_below_a_megabyte() -> None:
    made = page(simulate(SCENES["stewart-platform"](), t_end=0.2))
    assert made.mode == "live"
    assert len(made.html) < 1_000_000


def test_a_page_shows_itself_in_notebooks(result: Any) -> None:
    assert page(result)._repr_html_().startswith("<iframe")


def test_a_diagram_marks_the_joint_that_closes_a_loop(tmp_path: Path) -> None:
    made = diagram(SCENES["four-bar"](), tmp_path / "a.svg")
    assert made.file is not None
    assert made.file.read_text(encoding="utf-8") == made.svg
    coloured = dict(re.findall(r'fill="(#\w+)">(\w+)</text>', made.svg)[i][::-1] for i in range(9))
    closing = [part for part, colour in coloured.items() if colour == "#b23a48"]
    assert len(closing) == 1
    assert closing[0].startswith("pivot")
    with pytest.raises(UsageError, match="svg"):
        diagram(SCENES["four-bar"](), tmp_path / "a.png")


def test_the_command_writes_a_page_and_says_what_it_is(tmp_path: Path) -> None:
    target = str(tmp_path / "a.html")
    told = json.loads(_run("page", "double-pendulum", "-o", target, "--t-end", "0.5", "--json").output)
    assert told == {"file": target, "mode": "live", "reason": "", "bytes": Path(target).stat().st_size}
    assert (
        json.loads(_run("page", "double-pendulum", "-o", target, "--mode", "1", "--json").output)["mode"] == "recorded"
    )
    for wrong, said in (
        (("--show", "rod1.angel"), "rod1.angle"),
        (("--slider", "rod1.length=3:1"), "wrong way"),
        (("--mode", "7"), "0 to 1"),
    ):
        refused = _run("page", "double-pendulum", "-o", target, *wrong)
        assert refused.exit_code == 1
        assert said in refused.stderr


def _run(*arguments: str) -> Any:
    return CliRunner().invoke(main, arguments)
