"""The commands that the pages of the course show are commands of the tool, with its scenes and options."""

from __future__ import annotations

import ast
import inspect
import re
import shlex
from pathlib import Path

import click
import pytest

import atwood
from atwood.cli import main
from atwood.cli.scenes import find_scene
from atwood.errors import UsageError

COURSE = Path(__file__).parents[2] / "docs" / "course"
PAGES = ("systems.md", "questions.md")
INLINE = re.compile(r"`(atwood [^`]+)`")


def commands(page: str) -> list[str]:
    return INLINE.findall((COURSE / page).read_text(encoding="utf-8").replace("\\|", "|"))


def parsed(text: str) -> click.Context:
    """Return the context of a command line that is read and not run."""
    _, name, *arguments = shlex.split(text)
    command = main.get_command(click.Context(main), name)
    assert command is not None, f"{text}: there is no command {name!r}"
    made = command.make_context(name, arguments)
    if "scene" in made.params:
        find_scene(made.params["scene"])
    return made


@pytest.mark.parametrize("text", sorted({one for page in PAGES for one in commands(page)}))
def test_commands_of_the_course_are_understood(text: str) -> None:
    parsed(text)


@pytest.mark.parametrize(
    "text",
    [
        "atwood equation kepler",
        "atwood reduced kepler --now 3",
        "atwood reduced keppler",
        "atwood run kepler --t-end x",
    ],
)
def test_a_wrong_command_would_be_seen(text: str) -> None:
    with pytest.raises((AssertionError, click.UsageError, UsageError)):
        parsed(text)


def test_calls_of_the_cheat_sheet_are_of_public_functions_with_their_arguments() -> None:
    text = (COURSE / "questions.md").read_text(encoding="utf-8")
    shown = [one for one in re.findall(r"`([^`]+\))`", text) if not one.startswith("atwood ")]
    assert len(shown) > 35
    for call in shown:
        named = [
            one for one in ast.walk(ast.parse(call)) if isinstance(one, ast.Call) and isinstance(one.func, ast.Name)
        ]
        assert named, call
        for one in named:
            assert isinstance(one.func, ast.Name)
            found = inspect.signature(getattr(atwood, one.func.id))
            found.bind(*one.args, **{str(key.arg): key.value for key in one.keywords})


def test_each_system_has_a_formula_a_number_and_a_picture() -> None:
    rows = [line for line in (COURSE / "systems.md").read_text(encoding="utf-8").splitlines() if line.startswith("| ")]
    cells = [[cell.strip() for cell in re.split(r"(?<!\\)\|", row.strip("|"))] for row in rows]
    assert cells[0] == ["system", "formula", "number", "picture"]
    assert len(cells) >= 28
    for system, *shown in cells[1:]:
        assert len(shown) == 3, system
        assert all(INLINE.match(one) for one in shown), system
        assert re.search(r"--(plot|draw) \S+\.(png|svg|gif)", shown[2]), system
