"""The names of the library, which are loaded when they are first used."""

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

import atwood_library
from atwood_library import scenes


@pytest.mark.parametrize("package", [atwood_library, scenes], ids=lambda package: package.__name__)
def test_what_type_checkers_see_is_what_there_is(package):
    tree = ast.parse(Path(package.__file__).read_text(encoding="utf-8"))
    guarded = next(node for node in tree.body if isinstance(node, ast.If))
    seen = {alias.asname: node.module for node in guarded.body for alias in node.names}
    assert set(seen) == set(package.__all__) - {"SCENES"}
    for name, module in seen.items():
        assert getattr(package, name) is getattr(importlib.import_module(module), name)


@pytest.mark.parametrize("folder", ["forces", "joints", "parts", "ropes", "sensors", "sources"])
def test_every_file_of_a_part_is_offered(folder):
    here = Path(atwood_library.__file__).parent / folder
    files = {f"atwood_library.{folder}.{file.stem}" for file in here.glob("*.py")} - {
        f"atwood_library.{folder}.__init__"
    }
    assert files <= {getattr(atwood_library, name).__module__ for name in atwood_library.__all__}


def test_every_file_of_a_scene_is_offered_under_its_name():
    here = Path(scenes.__file__).parent
    files = {file.stem.replace("_", "-") for file in here.glob("*.py")} - {"--init--"}
    assert files == set(scenes.SCENES)
    assert len(scenes.SCENES) == len(set(scenes.SCENES.values()))
    for name, kind in scenes.SCENES.items():
        assert kind.__module__ == f"atwood_library.scenes.{name.replace('-', '_')}"


def test_a_name_that_is_not_there_is_refused():
    with pytest.raises(AttributeError, match="no attribute 'Rodd'"):
        atwood_library.Rodd  # noqa: B018
    with pytest.raises(ImportError, match="Pendulums"):
        from atwood_library.scenes import Pendulums  # noqa: F401
    assert "no-such-scene" not in scenes.SCENES
    with pytest.raises(KeyError):
        scenes.SCENES["no-such-scene"]


def test_one_scene_loads_no_other():
    code = "import sys; from atwood_library.scenes import DoublePendulum; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    own = {name for name in loaded if name.startswith("atwood_library.scenes.")}
    assert own == {"atwood_library.scenes.double_pendulum"}
    assert not [name for name in loaded if name.startswith("atwood_library.joints.")]
