"""Programs as functions that run: machine code, and plain Python and NumPy as the reference.

Machine code needs LLVM, which is imported when it is first asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from atwood.codegen.python.backend import BoundKernel, CompiledProgram, compile_program

if TYPE_CHECKING:
    from atwood.codegen.llvm.backend import NativeKernel, NativeProgram, compile_native
    from atwood.codegen.sundials.residuals import IdaCallbacks, compile_ida_callbacks

__all__ = [
    "BoundKernel",
    "CompiledProgram",
    "IdaCallbacks",
    "NativeKernel",
    "NativeProgram",
    "compile_ida_callbacks",
    "compile_native",
    "compile_program",
]


def __getattr__(name: str) -> Any:
    if name in ("NativeKernel", "NativeProgram", "compile_native"):
        from atwood.codegen.llvm import backend as llvm_backend

        return getattr(llvm_backend, name)
    if name in ("IdaCallbacks", "compile_ida_callbacks"):
        from atwood.codegen.sundials import residuals as llvm_ida

        return getattr(llvm_ida, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
