"""What is public changes only when somebody means it: names, signatures, commands, entry points."""

import difflib
from importlib.metadata import entry_points

import pytest

import atwood
import atwood.functions
from atwood.cli import main

from . import signatures
from .test_architecture import run_python


def test_what_is_public_is_as_written_down() -> None:
    written, found = signatures.FILE.read_text(encoding="utf-8").splitlines(), signatures.text().splitlines()
    changed = "\n".join(difflib.unified_diff(written, found, "written down", "found", lineterm="", n=1))
    assert not changed, f"if this is meant, `python -m tests.signatures write`:\n{changed}"


def test_functions_are_public_and_leave_all() -> None:
    """Who imports all names of Atwood keeps the sine of numpy or math."""
    from atwood import cos

    assert cos is atwood.functions.cos
    elementary = {"sin", "cos", "tan", "exp", "log", "sqrt", "floor", "minimum", "maximum", "sign"}
    assert not elementary & set(atwood.__all__)
    assert set(atwood.functions.__all__) <= set(dir(atwood))


@pytest.mark.skipif(not entry_points(group="atwood.libraries"), reason="entry points are there when it is installed")
def test_the_command_and_the_library_are_entry_points() -> None:
    (script,) = (one for one in entry_points(group="console_scripts") if one.name == "atwood")
    assert script.load() is main
    (library,) = (one for one in entry_points(group="atwood.libraries") if one.name == "standard")
    assert library.load().__name__ == "atwood_library"


def test_the_module_is_the_command() -> None:
    done = run_python("-m", "atwood", "--help")
    assert done.returncode == 0
    assert done.stdout.startswith("Usage: atwood ")
    for name in main.commands:
        assert f"  {name} " in done.stdout
