"""The house rules that no single module can keep by itself."""

import ast
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from atwood.integrators.methods import METHODS

from .size import SOLVERS, by_room, measured, names_solver, nodes_of, stated

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src" / "atwood"


def environment() -> dict[str, str]:
    """The environment of a child process that sees this checkout, installed or not."""
    path = os.pathsep.join([str(ROOT / "src"), str(ROOT / "library")])
    return {**os.environ, "PYTHONPATH": path}


def run_python(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments], cwd=ROOT, env=environment(), capture_output=True, text=True, check=False
    )


@pytest.fixture(scope="module")
def import_contracts() -> subprocess.CompletedProcess[str]:
    return run_python("-c", "from importlinter.cli import lint_imports_command as main; main(['--no-cache'])")


def test_imports_keep_the_contracts(import_contracts: subprocess.CompletedProcess[str]) -> None:
    assert import_contracts.returncode == 0, import_contracts.stdout + import_contracts.stderr


def test_every_module_of_the_framework_has_a_place_in_the_layers() -> None:
    """A new module that no layer names would escape the contract."""
    settings = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    modules = {
        path.stem if path.suffix else path.name
        for path in (ROOT / "src" / "atwood").iterdir()
        if path.suffix == ".py" or (path / "__init__.py").is_file()
    }
    unplaced = sorted(name for name in modules - {"__init__", "__main__"} if f"atwood.{name}" not in settings)
    assert not unplaced, f"name these in the layers of pyproject.toml: {unplaced}"


def test_the_library_may_use_the_facades_and_no_other_room() -> None:
    """A new room that the contract does not name would be open to the library."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = settings["tool"]["importlinter"]["contracts"]
    (contract,) = (one for one in contracts if one.get("source_modules") == ["atwood_library"])
    inside = {path.stem for path in (ROOT / "src" / "atwood").iterdir() if not path.name.startswith(("_", "py."))}
    named = {name.removeprefix("atwood.") for name in contract["forbidden_modules"]}
    assert inside - named == {"functions", "solids", "xml_files"}


def test_the_solver_library_is_loaded_only_when_a_run_starts() -> None:
    done = run_python("-c", "import sys, atwood.integrators.ida.native; print('sksundae' in sys.modules)")
    assert done.stdout.strip() == "False", done.stderr


LONGEST_FUNCTION = 60
"""In lines; a function is counted without its docstring."""


SOURCES = {str(path.relative_to(SOURCE)): path.read_text(encoding="utf-8") for path in sorted(SOURCE.rglob("*.py"))}


def length(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Return how many lines a function has without its docstring."""
    lines = (function.end_lineno or function.lineno) - function.lineno + 1
    if ast.get_docstring(function) is None:
        return lines
    told = function.body[0]
    return lines - ((told.end_lineno or told.lineno) - told.lineno + 1)


def test_functions_are_short() -> None:
    long = {
        f"{name}:{node.name}"
        for name, text in SOURCES.items()
        for node in nodes_of(text)
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)) and length(node) > LONGEST_FUNCTION
    }
    assert not long, f"split what does more than one thing: {sorted(long)}"


def test_ranks_and_least_norm_solutions_are_decided_in_one_room() -> None:
    """Who cuts singular values by a number of his own decides a rank that nobody compares with the others."""
    own = {
        name
        for name, text in SOURCES.items()
        for node in nodes_of(text)
        if isinstance(node, ast.Call)
        and getattr(node.func, "attr", getattr(node.func, "id", "")) in {"svd", "matrix_rank", "lstsq", "pinv"}
    }
    decided = {name for name in own if Path(name).parts[0] != "numerics"}
    assert not decided, f"use atwood.numerics: {sorted(decided)}"


def test_solvers_are_named_in_their_records_alone() -> None:
    """Whoever else needs to know one of a method asks its record."""
    named = {name for name, text in SOURCES.items() if names_solver(nodes_of(text))}
    assert {name for name in named if not name.startswith("integrators/methods/")} == set()
    assert set(SOLVERS) == set(METHODS)


def test_rooms_are_as_large_as_the_documentation_states() -> None:
    """Whoever makes a room larger says so with `python -m tests.size write`."""
    rooms, bounds = by_room(), stated()
    assert set(rooms) == set(bounds)
    grown = {
        room: (measured(one), bounds[room])
        for room, one in rooms.items()
        if any(np.greater(measured(one), bounds[room]))
    }
    assert not grown, f"lines of code, files, names; measured and stated: {grown}"


def test_files_that_documents_name_exist() -> None:
    named = re.compile(r"`([a-z_0-9]+(?:/[a-z_0-9]+)+\.py)`")
    missing = {
        f"{page.name}: {name}"
        for page in (*(ROOT / "docs").glob("*.md"), ROOT / "README.md", ROOT / "CONTRIBUTING.md")
        for name in named.findall(page.read_text(encoding="utf-8"))
        if not any((place / name).is_file() for place in (SOURCE, ROOT / "library" / "atwood_library", ROOT))
    }
    assert not missing
