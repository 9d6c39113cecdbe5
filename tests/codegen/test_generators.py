"""The key of the cache of machine code covers every file that writes it."""

import ast
import shutil
from pathlib import Path

import pytest

import atwood.codegen
from atwood.codegen.llvm.build import GENERATORS, hash_of_generators
from atwood.errors import UnsupportedError

ROOM = Path(atwood.codegen.__file__).parent


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    return shutil.copytree(ROOM, tmp_path / "codegen", ignore=shutil.ignore_patterns("__pycache__"))


@pytest.mark.parametrize("name", GENERATORS)
def test_a_changed_byte_changes_the_key(copy: Path, name: str) -> None:
    before = hash_of_generators(copy)
    assert before == hash_of_generators(ROOM)
    (copy / name).write_bytes((copy / name).read_bytes() + b"\n")
    assert hash_of_generators.__wrapped__(copy) != before


def test_a_missing_generator_is_an_error(copy: Path) -> None:
    (copy / GENERATORS[0]).unlink()
    with pytest.raises(UnsupportedError, match="cannot be read"):
        hash_of_generators(copy)


def test_all_that_a_module_is_written_with_is_listed() -> None:
    waiting, found = ["llvm/build.py"], set()
    while waiting:
        name = waiting.pop()
        found.add(name)
        for node in ast.walk(ast.parse((ROOM / name).read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("atwood.codegen.llvm."):
                other = f"llvm/{(node.module or '').rpartition('.')[2]}.py"
                if other not in found:
                    waiting.append(other)
    assert found <= set(GENERATORS)
