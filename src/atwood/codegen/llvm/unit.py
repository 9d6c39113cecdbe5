"""What straight-line code and loops have in common in LLVM's language."""

from __future__ import annotations

from atwood.codegen.llvm.layout import Unit
from atwood.codegen.llvm.linear_systems import Solver
from atwood.codegen.llvm.text import Writer

__all__ = ["prologue", "write_unit"]


def write_unit(writer: Writer, solver: Solver, unit: Unit) -> None:
    """Write operations that stay together."""
    node = unit[0]
    if node.operation == "solve":
        solver.write(writer, node, unit[1:])
    elif len(unit) == 2:
        sine, cosine = unit if node.operation == "sin" else (unit[1], node)
        writer.write_wave(sine, cosine)
    else:
        writer.write(node)


def prologue(writer: Writer) -> list[str]:
    """Return the instructions that fetch the pointers that a chunk uses."""
    lines = ["  %sine = alloca double", "  %cosine = alloca double"] if writer.waves else []
    for pointer in sorted(writer.pointers):
        for prefix, table in (("in", "inputs"), ("out", "outputs")):
            if pointer.startswith(prefix):
                place = f"%{pointer}.place"
                lines.append(f"  {place} = getelementptr ptr, ptr %{table}, i64 {pointer.removeprefix(prefix)}")
                lines.append(f"  %{pointer} = load ptr, ptr {place}, !invariant.load !0")
    return lines
