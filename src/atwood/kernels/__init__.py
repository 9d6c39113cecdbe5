"""Programs as functions that run: plain Python and NumPy."""

from atwood.kernels.python_backend import BoundKernel, CompiledProgram, compile_program

__all__ = ["BoundKernel", "CompiledProgram", "compile_program"]
