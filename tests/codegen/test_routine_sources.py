"""Machine code of routines is kept under a key that covers every file that decides what they are."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

import atwood
from atwood.codegen.llvm.build import GENERATORS

from ..size import writes_llvm

SOURCE = Path(atwood.__file__).parent
TOOLS = {"lazy_dataclasses.py", "errors.py"}
"""These decide how classes and errors are made, not what is in a routine."""


@cache
def definitions(file: str) -> tuple[dict[str, list[ast.AST]], dict[str, tuple[str, str]]]:
    """Return what defines each name of a module, and which names of other modules it has."""
    own: dict[str, list[ast.AST]] = {}
    imported: dict[str, tuple[str, str]] = {}
    for node in ast.parse((SOURCE / file).read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("atwood."):
            other = (node.module or "").removeprefix("atwood.").replace(".", "/") + ".py"
            imported |= {one.asname or one.name: (other, one.name) for one in node.names}
        elif isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            own.setdefault(node.name, []).append(node)
        elif isinstance(node, (ast.Assign, ast.AnnAssign, ast.AugAssign)):
            for one in ast.walk(node):
                if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store):
                    own.setdefault(one.id, []).append(node)
    return own, imported


def names_in(node: ast.AST) -> Iterator[str]:
    """Yield the names that a definition uses, without its annotations."""
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns"):
            continue
        for one in value if isinstance(value, list) else [value]:
            if isinstance(one, ast.Name):
                yield one.id
            if isinstance(one, ast.AST):
                yield from names_in(one)


def files_behind(file: str, name: str, seen: set[tuple[str, str]]) -> set[str]:
    """Return the files that decide what a name of a module stands for."""
    if (file, name) in seen or file in TOOLS:
        return set()
    seen.add((file, name))
    own, imported = definitions(file)
    if name in imported:
        return files_behind(*imported[name], seen)
    if name not in own:
        return set()
    return {file}.union(*(files_behind(file, one, seen) for node in own[name] for one in names_in(node)))


def sources() -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield the module of each source of routines, and the files that it lists."""
    for path in sorted(SOURCE.rglob("*.py")):
        file = path.relative_to(SOURCE).as_posix()
        text = path.read_text(encoding="utf-8")
        if "RoutineSource(" not in text or file == "codegen/llvm/build.py":
            continue
        known: dict[str, Any] = dict(vars(import_module("atwood." + file.removesuffix(".py").replace("/", "."))))
        for part in ast.parse(text).body:
            for node in ast.walk(part):
                if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "files":
                    known["files"] = evaluated(node.value, known)
                if isinstance(node, ast.Call) and ast.unparse(node.func) == "RoutineSource":
                    module, *listed = node.args[:2]
                    yield evaluated(module, known), evaluated(listed[0], known) if listed else ()


def evaluated(node: ast.expr, known: dict[str, Any]) -> Any:
    return eval(compile(ast.Expression(node), "source", "eval"), known)


SOURCES = dict(sources())


@pytest.mark.parametrize("module", SOURCES)
def test_all_that_decides_what_a_routine_is_belongs_to_its_key(module: str) -> None:
    own = module.replace(".", "/") + ".py"
    behind = files_behind(own, "write_routines", set())
    assert own in behind
    assert behind <= {own, *SOURCES[module], *(f"codegen/{name}" for name in GENERATORS)}


def test_every_module_that_writes_routines_has_a_source() -> None:
    writing = {
        path.relative_to(SOURCE).as_posix().removesuffix(".py").replace("/", ".")
        for path in SOURCE.rglob("*.py")
        if "\ndef write_routines(" in path.read_text(encoding="utf-8")
    }
    assert writing == set(SOURCES)


def test_the_language_and_its_printer_belong_to_every_key() -> None:
    listed = {f"codegen/{name}" for name in GENERATORS}
    for file, name in (("codegen/llvm/printer.py", "print_routines"), ("codegen/llvm/build.py", "RoutineSource")):
        assert files_behind(file, name, set()) - {"codegen/llvm/build.py"} <= listed


def test_a_source_is_named_by_its_files_and_arguments() -> None:
    from atwood.codegen.llvm.build import RoutineSource
    from atwood.codegen.llvm.elimination import write_routines

    module = "codegen.llvm.elimination"
    source = RoutineSource(module)
    assert [one.name for one in source.write()] == [one.name for one in write_routines()]
    others = [
        RoutineSource(module, ("lazy_dataclasses.py",)),
        RoutineSource(module, (), (1,)),
        RoutineSource("codegen.cache"),
    ]
    assert len({source.key, *(one.key for one in others)}) == 4


def test_the_language_of_llvm_is_written_in_one_room() -> None:
    written = {
        path.relative_to(SOURCE).as_posix()
        for path in SOURCE.rglob("*.py")
        if writes_llvm(path.read_text(encoding="utf-8"))
    }
    assert written == {f"codegen/llvm/{name}.py" for name in ("module", "printer", "text")}
