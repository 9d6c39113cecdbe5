"""The house rules that no single module can keep by itself."""

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


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
    assert inside - {name.removeprefix("atwood.") for name in contract["forbidden_modules"]} == {"functions", "solids"}


def test_the_solver_library_is_loaded_only_when_a_run_starts() -> None:
    done = run_python("-c", "import sys, atwood.integrators.ida.sundae; print('sksundae' in sys.modules)")
    assert done.stdout.strip() == "False", done.stderr
