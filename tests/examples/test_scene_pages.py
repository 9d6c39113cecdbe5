"""Pages of scenes say what the scenes are, show them, and have code that runs."""

from __future__ import annotations

import pytest

from atwood_library.scenes import SCENES

from .. import pages
from .test_documents import BLOCK

NAMES = sorted(pages.known())


def test_every_page_belongs_to_a_scene_and_every_overview_names_its_pages() -> None:
    found = {file.stem for file in pages.HERE.glob("*.md")} - set(pages.OVERVIEWS)
    assert found == set(NAMES) <= set(SCENES)
    assert {file.stem for file in (pages.HERE / "images").iterdir()} == set(NAMES)
    assert len(NAMES) >= 34


@pytest.mark.parametrize("name", NAMES)
def test_a_page_says_what_the_scene_is(name: str) -> None:
    text = (pages.HERE / f"{name}.md").read_text(encoding="utf-8")
    assert text.startswith(pages.head(name)), "python -m tests.pages write"
    assert "| constraints left |" in text
    assert 1_000 < (pages.HERE / "images" / f"{name}.png").stat().st_size < 60_000


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", NAMES)
def test_a_page_has_the_commands_that_answer(name: str) -> None:
    text = (pages.HERE / f"{name}.md").read_text(encoding="utf-8")
    assert text.endswith(f"\n{pages.said(name)}"), f"python -m tests.pages say {name}"


def test_every_page_has_commands() -> None:
    for name in NAMES:
        text = (pages.HERE / f"{name}.md").read_text(encoding="utf-8")
        assert f"`atwood equations {name}" in text.partition("## What can be said of it")[2]


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", NAMES)
def test_code_of_a_page_runs(name: str) -> None:
    (code,) = BLOCK.findall((pages.HERE / f"{name}.md").read_text(encoding="utf-8"))
    exec(compile(code, name, "exec"), {})


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", ["kepler", "bead-on-wire", "pulley-with-inertia"])
def test_both_forms_are_compared_as_a_page_says(name: str) -> None:
    text, _ = pages.compared(name)
    page = (pages.HERE / f"{name}.md").read_text(encoding="utf-8")
    assert text.split("Run to")[0] in page  # the numbers of coordinates, speeds and constraints
