"""Programs as machine code that Python calls; the values are those of `atwood.codegen.python.backend`, to rounding.

A call lets other threads run.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from ctypes import c_void_p
from operator import is_
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import Built, build_code, default_options
from atwood.codegen.llvm.module import CodeOptions, Part
from atwood.codegen.python.backend import compile_program
from atwood.errors import KernelEvaluationError, UsageError
from atwood.expr.core.program import Program

_KERNEL = ctypes.CFUNCTYPE(ctypes.c_int, *[c_void_p] * 4)


def compile_native(program: Program, *, cache: bool = True, options: CodeOptions | None = None) -> NativeProgram:
    """Compile a program to machine code.

    Parameters
    ----------
    program
        What to compute.
    cache
        Whether to look for it in the cache on disk, and to keep it there.
    options
        How to compile it; by default what suits the program's size.

    Returns
    -------
    NativeProgram
        Call its ``bind`` with the parameter values to get a function.
    """
    part = Part("kernel", program)
    return NativeProgram(program, build_code([part], options or default_options([part]), cached=cache))


class NativeProgram:
    """A program as machine code, for any parameter values.

    Parameters
    ----------
    program
        What it computes.
    built
        The code.

    Attributes
    ----------
    call
        The function; see `atwood.codegen.llvm.module` for its signature.
    scratch
        The length of the scratch array that it needs.
    from_cache
        Whether nothing had to be compiled.
    """

    def __init__(self, program: Program, built: Built) -> None:
        self.program = program
        self.built = built
        self.scratch = built.scratch
        self.from_cache = built.from_cache
        self.call: Callable[..., int] = _KERNEL(built.code.addresses["kernel"])

    def bind(self, parameter_values: ArrayLike) -> NativeKernel:
        """Compute once what depends on parameters alone.

        Parameters
        ----------
        parameter_values
            The values in the order of ``program.parameters``.

        Raises
        ------
        KernelEvaluationError
            If the number of values is wrong.
        """
        derived, _ = self.built.derive("kernel", self.program, parameter_values)
        return NativeKernel(self, np.array(parameter_values, dtype=float), derived)


class NativeKernel:
    """A program with its parameter values: a function of the input groups.

    Many threads can call one kernel at once.

    Parameters
    ----------
    compiled
        The code.
    parameter_values
        The values of the parameters.
    derived
        What depends on parameters alone.
    """

    def __init__(self, compiled: NativeProgram, parameter_values: FloatArray, derived: FloatArray) -> None:
        self.compiled = compiled
        self.parameter_values = parameter_values
        self.derived = derived
        self._spaces: list[_Space] = []

    def __call__(self, *groups: Any) -> tuple[list[float], ...]:
        """Evaluate the program."""
        space = self._take_space()
        if len(groups) != len(space.inputs):
            self._refuse([len(group) for group in groups])
        for target, group in zip(space.inputs, groups, strict=True):
            if len(group) != len(target):
                self._refuse([len(group) for group in groups])
            target[:] = group
        code = self.compiled.call(*space.arguments)
        if code:
            self._look_into(groups, space)
        results = tuple(output.tolist() for output in space.outputs)
        self._spaces.append(space)
        return results

    def into(self, outputs: Sequence[FloatArray], *inputs: FloatArray) -> bool:
        """Evaluate the program on arrays as they are, without copies.

        Parameters
        ----------
        outputs
            The arrays to fill, one for each output group.  They must not overlap each other or an input.
        *inputs
            The arrays to read, one for each input group.

        Returns
        -------
        bool
            Whether every result is finite, and not so large that their sum is not.

        Raises
        ------
        UsageError
            If an array has the wrong size, does not hold floats of 64 bits one after the other, or cannot be written.
        """
        space = self._take_space()
        arrays = (*inputs, *outputs)
        if len(arrays) != len(space.known) or not all(map(is_, arrays, space.known)):
            self._point_to(space, outputs, inputs)
        code = self.compiled.call(*space.elsewhere)
        self._spaces.append(space)
        return bool(code == 0)

    def again(self, outputs: Sequence[FloatArray], *inputs: FloatArray) -> Callable[[], bool]:
        """Return a function that evaluates the program on these very arrays, as they are then, and fills these.

        Parameters
        ----------
        outputs, inputs
            See `into`.

        Returns
        -------
        callable
            As `into`: whether every result is finite. It is for one thread at a time.
        """
        space = _Space(self)
        self._point_to(space, outputs, inputs)
        call, arguments = self.compiled.call, space.elsewhere

        def evaluate(held: _Space = space) -> bool:  # the space holds the arrays
            return bool(call(*arguments) == 0)

        return evaluate

    def each(self, outputs: Sequence[FloatArray], *inputs: FloatArray) -> int:
        """Evaluate the program on each row of arrays as they are.

        Parameters
        ----------
        outputs
            The arrays to fill, one for each output group, of shape (states, size).
        *inputs
            The arrays to read, one for each input group, of shape (states, size).

        Returns
        -------
        int
            The first row of which a result is not finite; the number of rows if there is none.

        Raises
        ------
        UsageError
            If an array has the wrong size, does not hold floats of 64 bits one after the other, or cannot be written.
        """
        count = len(outputs[0])
        if not count:
            return 0
        space = self._take_space()
        self._point_to(space, [one[0] for one in outputs], [one[0] for one in inputs])
        given, derived, scratch, filled = space.elsewhere
        steps = [
            (pointers, i, one.strides[0])
            for pointers, several in ((given, inputs), (filled, outputs))
            for i, one in enumerate(several)
        ]
        call, first = self.compiled.call, count
        for row in range(count):
            if call(given, derived, scratch, filled):
                first = min(first, row)
            if row + 1 < count:
                for pointers, i, step in steps:
                    pointers[i] = (pointers[i] or 0) + step
        space.known = ()
        self._spaces.append(space)
        return first

    def _point_to(self, space: _Space, outputs: Sequence[FloatArray], inputs: Sequence[FloatArray]) -> None:
        """Take arrays of the caller's, if they are as they must be; the next call can then do with a glance."""
        program = self.compiled.program
        where = program.name
        _check_arrays(where, "input", inputs, [len(group.symbols) for group in program.inputs])
        _check_arrays(where, "output", outputs, [len(group.expressions) for group in program.outputs])
        if not all(output.flags.writeable for output in outputs):
            raise UsageError("an output array is read-only", where=where)
        _, derived, scratch, _ = space.arguments
        space.elsewhere = (_pointers(inputs), derived, scratch, _pointers(outputs))
        space.known = (*inputs, *outputs)

    def _take_space(self) -> _Space:
        """Return arrays that no other call uses at the moment."""
        try:
            return self._spaces.pop()
        except IndexError:
            return _Space(self)

    def _look_into(self, groups: Sequence[Any], space: _Space) -> None:
        """Raise the error that explains a result that is not finite."""
        program = self.compiled.program
        compile_program(program).bind(self.parameter_values)(*groups)
        for group, values in zip(program.outputs, space.outputs, strict=True):
            for position in np.flatnonzero(~np.isfinite(values)):
                raise KernelEvaluationError(
                    f"the output {group.name}[{position}] has no finite value: it is {values[position]:g}",
                    where=program.name,
                )

    def _refuse(self, found: list[int]) -> None:
        program = self.compiled.program
        names = ", ".join(f"{group.name} of {len(group.symbols)}" for group in program.inputs)
        raise KernelEvaluationError(f"takes the groups {names}; got groups of {found}", where=program.name)


_Arguments = tuple[ctypes.Array[c_void_p], c_void_p, c_void_p, ctypes.Array[c_void_p]]


class _Space:
    """Arrays for one call at a time, with the pointers to them; also those to the arrays that a caller last used.

    Parameters
    ----------
    kernel
        What is called.
    """

    def __init__(self, kernel: NativeKernel) -> None:
        program = kernel.compiled.program
        self.inputs = [np.empty(len(group.symbols)) for group in program.inputs]
        self.outputs = [np.empty(len(group.expressions)) for group in program.outputs]
        self._scratch = np.empty(kernel.compiled.scratch)
        given, filled = _pointers(self.inputs), _pointers(self.outputs)
        derived, scratch = c_void_p(kernel.derived.ctypes.data), c_void_p(self._scratch.ctypes.data)
        self.arguments: _Arguments = (given, derived, scratch, filled)
        self.elsewhere: _Arguments = self.arguments
        self.known: tuple[FloatArray, ...] = ()


def _pointers(arrays: Sequence[FloatArray]) -> ctypes.Array[c_void_p]:
    return (c_void_p * len(arrays))(*[array.__array_interface__["data"][0] for array in arrays])


def _check_arrays(where: str, kind: str, arrays: Sequence[FloatArray], sizes: Sequence[int]) -> None:
    if len(arrays) != len(sizes):
        raise UsageError(f"needs {len(sizes)} {kind} arrays, got {len(arrays)}", where=where)
    for position, (array, size) in enumerate(zip(arrays, sizes, strict=True)):
        if array.shape != (size,) or array.dtype != np.float64 or not array.flags.c_contiguous:
            raise UsageError(
                f"the {kind} array {position} must be {size} contiguous floats of 64 bits, not {array.dtype} of "
                f"shape {array.shape}",
                where=where,
            )
