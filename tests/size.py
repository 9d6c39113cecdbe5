"""The size of the framework: `python -m tests.size` prints it, `python -m tests.size write` makes it the new bound.

Code lines are lines with a token that is neither comment nor docstring. The bounds of the rooms stand in
`docs/architecture.md`.
"""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src" / "atwood"
LEDGER = ROOT / "docs" / "architecture.md"
_ROW = re.compile(r"^\| `?(.+?)`? \| (\d+) \| (\d+) \| (\d+) \|$", re.MULTILINE)

_NO_CODE = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
}
_LLVM = ("getelementptr", "define ", " phi ", "fadd ", "load double", "load ptr", "br i1", "br label")
SOLVERS = ("ida", "ida-sundae", "explicit", "tsitouras", "taylor", "gauss", "composition", "moreau")
_FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
_ALGEBRA = {"svd", "matrix_rank", "lstsq", "pinv"}


@dataclass(frozen=True)
class Size:
    """What is counted of a file, or of many."""

    code: int = 0
    lines: int = 0
    files: int = 0
    inner_imports: int = 0
    exported: int = 0
    llvm: int = 0
    algebra: int = 0
    solvers: int = 0

    def __add__(self, other: Size) -> Size:
        return Size(*(a + b for a, b in zip(vars(self).values(), vars(other).values(), strict=True)))


def code_lines(text: str, nodes: Sequence[ast.AST] | None = None) -> int:
    """Return how many lines of a source have code."""
    said = {
        line
        for node in nodes or nodes_of(text)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)
    }
    code: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in _NO_CODE:
            code.update(range(token.start[0], token.end[0] + 1))
    return len(code - said)


def strings(nodes: Sequence[ast.AST]) -> Iterator[str]:
    """Yield the strings among the nodes of a source that are no docstrings."""
    said = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    for node in nodes:
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in said:
            yield node.value


def names_solver(nodes: Sequence[ast.AST]) -> bool:
    """Tell whether a string of a source is the name of a solver, or has one in quotes."""
    return any(one == name or f"'{name}'" in one for one in strings(nodes) for name in SOLVERS)


def writes_llvm(text: str, nodes: Sequence[ast.AST] | None = None) -> bool:
    """Tell whether a source has the language of LLVM in its strings."""
    words = [word for word in _LLVM if word in text]
    found = [one.replace("#define ", "") for one in strings(nodes or nodes_of(text))] if words else []  # nor that of C
    return any(word in one for one in found for word in words)


@cache
def nodes_of(text: str) -> list[ast.AST]:
    """Return the nodes of a source, outer ones first."""
    return list(ast.walk(ast.parse(text)))


@cache
def size(path: Path) -> Size:
    """Return what is counted of a file."""
    text = path.read_text(encoding="utf-8")
    nodes = nodes_of(text)
    tree = nodes[0]
    assert isinstance(tree, ast.Module)
    within = [(node.lineno, node.end_lineno or 0) for node in nodes if isinstance(node, _FUNCTIONS)]
    imports = [node.lineno for node in nodes if isinstance(node, (ast.Import, ast.ImportFrom)) and node.col_offset]
    listed = [
        node.value
        for node in tree.body
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "__all__"
    ]
    exported = sum(len(one.elts) for one in listed if isinstance(one, (ast.List, ast.Tuple)))
    called = {getattr(node.func, "attr", getattr(node.func, "id", "")) for node in nodes if isinstance(node, ast.Call)}
    return Size(
        code=code_lines(text, nodes),
        lines=len(text.splitlines()),
        files=1,
        inner_imports=sum(any(first < line <= last for first, last in within) for line in imports),
        exported=exported,
        llvm=int(writes_llvm(text, nodes)),
        algebra=int(bool(called & _ALGEBRA)),
        solvers=int(names_solver(nodes)),
    )


def by_room() -> dict[str, Size]:
    """Return the sizes of the rooms of the framework."""
    rooms: dict[str, Size] = {}
    for path in sorted(SOURCE.rglob("*.py")):
        inside = path.relative_to(SOURCE).parts
        room = inside[0] if len(inside) > 1 else "(files)"
        rooms[room] = rooms.get(room, Size()) + size(path)
    return rooms


def stated() -> dict[str, tuple[int, int, int]]:
    """Return the bounds that the documentation states, by room: lines of code, files, names exported."""
    found = _ROW.findall(LEDGER.read_text(encoding="utf-8"))
    return {room: (int(code), int(files), int(names)) for room, code, files, names in found}


def measured(one: Size) -> tuple[int, int, int]:
    """Return what bounds are stated of."""
    return one.code, one.files, one.exported


def write() -> None:
    """State today's sizes as bounds, code lines rounded up to the next ten."""
    rooms = by_room()
    rows = [
        f"| `{room}` | {-(-one.code // 10) * 10} | {one.files} | {one.exported} |"
        for room, one in sorted(rooms.items())
    ]
    text = LEDGER.read_text(encoding="utf-8")
    head = "| room | code lines | files | names |\n|---|---|---|---|\n"
    before, after = text.split(head)
    rest = _ROW.sub("", after).lstrip("\n")
    LEDGER.write_text(before + head + "\n".join(rows) + "\n\n" + rest, encoding="utf-8")


def main() -> None:
    """Print the table."""
    if sys.argv[1:] == ["write"]:
        write()
    rooms = by_room()
    total = sum(rooms.values(), Size())
    heads = {"inner imports": "inner_imports", "LLVM": "llvm", "svd": "algebra", "solvers": "solvers"}
    names = {"code": "code", "lines": "lines", "files": "files", "names": "exported", **heads}
    print(f"{'room':14}" + "".join(f"{head:>{max(8, len(head) + 2)}}" for head in names))
    for room, one in [*sorted(rooms.items(), key=lambda pair: -pair[1].code), ("all", total)]:
        print(f"{room:14}" + "".join(f"{getattr(one, name):{max(8, len(head) + 2)}}" for head, name in names.items()))


if __name__ == "__main__":
    main()
