"""Programs as functions that run: machine code, and plain Python and NumPy as the reference.

Machine code needs LLVM, which is imported when it is first asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from atwood.codegen.python.backend import BoundKernel, CompiledProgram, compile_program
from atwood.lazy_modules import imports_later

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

__getattr__ = imports_later(__name__)
