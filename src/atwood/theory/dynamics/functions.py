"""Programs as functions of numbers: compiled when they are first called, for one state and for many."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import Any

import numpy as np

from atwood.arguments import check, number, show
from atwood.arrays import FloatArray
from atwood.codegen import NativeProgram, compile_native, compile_program
from atwood.errors import KernelEvaluationError, UsageError
from atwood.expr import Expression, InputGroup, OutputGroup, Program
from atwood.expr.core.relations import values_just_after
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.simulation.problem.preparation import find_not_compilable

_NATIVE: Key[NativeProgram] = Key("machine code for one state")

Numbers = Any
"""An array of floats, or what NumPy makes one of."""


_TIME = number("a time in seconds, as a finite number, or None")


def as_time(t: Any, where: str) -> float:
    """Return a time that was given, or refuse it."""
    return float(check(_TIME, t, "t", where))


def as_numbers(given: Numbers, size: int, name: str, where: str) -> FloatArray:
    """Return what was given for a state as an array of floats, or refuse it."""
    if type(given) is np.ndarray and given.dtype == np.float64:
        array = given
    else:
        try:
            array = np.asarray(given)
        except Exception:  # to look at a value of any class can raise anything
            array = np.asarray(None)
        array = array.astype(np.float64) if array.dtype.kind in "fiu" else np.asarray(None)
    advice = f"Give an array of {size} numbers, or one with a row of so many for each state."
    if array.dtype != np.float64:
        raise UsageError(f"{name} cannot be {show(given)}", where=where, advice=advice)
    if array.ndim == 0 or array.shape[-1] != size:
        message = f"{name} has the shape {array.shape}, and the scene has {size} of them"
        raise UsageError(message, where=where, advice=advice)
    return array


def shape_of_states(arrays: Sequence[FloatArray], names: Sequence[str], where: str) -> tuple[int, ...]:
    """Return how many states there are, as the shape in front of that of one; refuse arrays that do not fit."""
    try:
        return np.broadcast_shapes(*(one.shape[:-1] for one in arrays))
    except ValueError:
        shapes = ", ".join(f"{name} has the shape {one.shape}" for name, one in zip(names, arrays, strict=True))
        advice = "Give one state, or as many rows of each."
        raise UsageError(f"these are different numbers of states: {shapes}", where=where, advice=advice) from None


def at_time(assembly: Assembly, t: float) -> Assembly:
    """Return an assembly with what switches by the clock as it is just after a time."""
    if not assembly.relations or t == assembly.flat.t_start:
        return assembly
    with assembly.shared.lock:
        return assembly.with_relations(values_just_after(assembly.relations, assembly.mechanism.table.values, t))


class Function:
    """A program of (t, q, ...) with one group of outputs, ready for one state and for many.

    Parameters
    ----------
    assembly
        The scene.
    program
        The program.
    shape
        Of its result at one state.
    """

    def __init__(self, assembly: Assembly, program: Program, shape: tuple[int, ...]) -> None:
        self.assembly, self.program, self.shape = assembly, program, shape
        self.sizes = [len(group.symbols) for group in program.inputs[1:]]
        self._now = np.array([assembly.flat.t_start])
        self._compiled: Any = None
        self._kernel: Any = None
        self._known: tuple[Any, ...] = (None,)
        self._again: Any = None

    def __call__(self, t: float | None, given: tuple[Numbers, ...], out: FloatArray | None) -> FloatArray:
        """Return the values, in `out` if it is given."""
        known, count = self._known, len(given)
        if (
            t is None
            and out is not None
            and out is known[0]
            and given[0] is known[1]
            and (count < 2 or given[1] is known[2])
            and (count < 3 or given[2] is known[3])
        ):  # the arrays of the last call: nothing is looked at again
            if self._again():
                return out
            self._explain(self._kernel, [self._now, *given])
        return self._general(t, given, out)

    def _general(self, t: float | None, given: tuple[Numbers, ...], out: FloatArray | None) -> FloatArray:
        arrays = [self._checked(one, size, i) for i, (one, size) in enumerate(zip(given, self.sizes, strict=True))]
        t = None if t is None else as_time(t, self.program.name)
        batch = shape_of_states(arrays, [group.name for group in self.program.inputs[1:]], self.program.name)
        whole = (*batch, *self.shape)
        if out is not None:
            self._check_out(out, whole)
        result = np.empty(whole) if out is None else out
        count, size = int(np.prod(batch, dtype=int)), int(np.prod(self.shape, dtype=int))
        if not count or not size:
            return result
        if self._kernel is None and self._compiled is None:
            self._compile()
        kernel = self._kernel if t is None and self._kernel is not None else self._bound(t)
        if t is None and not batch and out is not None and _are_plain(arrays, given) and hasattr(kernel, "again"):
            self._known, self._again = (out, *given), kernel.again((out.reshape(-1),), self._now, *given)
        rows = [
            np.ascontiguousarray(np.broadcast_to(one, (*batch, one.shape[-1]))).reshape(count, -1) for one in arrays
        ]
        times = np.full((count, 1), self._now[0] if t is None else float(t))
        flat = result.reshape(count, size)
        bad = _each(kernel, flat, [times, *rows])
        if bad < count:
            self._explain(kernel, [times[bad], *(one[bad] for one in rows)])
        return result

    def _checked(self, given: Numbers, size: int, position: int) -> FloatArray:
        return as_numbers(given, size, self.program.inputs[position + 1].name, self.program.name)

    def _check_out(self, out: FloatArray, whole: tuple[int, ...]) -> None:
        is_array = isinstance(out, np.ndarray)
        if is_array and out.shape == whole and out.dtype == np.float64 and out.flags.c_contiguous:
            return
        said = f"{out.dtype} of shape {out.shape}" if is_array else show(out)
        advice = f"Give np.empty({whole}), or no out."
        message = f"out must be float64, contiguous and of shape {whole}, not {said}"
        raise UsageError(message, where=self.program.name, advice=advice)

    def _compile(self) -> None:
        if find_not_compilable(self.assembly, self.program):
            self._compiled = compile_program(self.program)
        else:
            program = self.program
            self._compiled = self.assembly.shared.get(_NATIVE, lambda: compile_native(program), program)
        self._kernel = self._compiled.bind(self.assembly.parameter_values)

    def _bound(self, t: float | None) -> Any:
        here = self.assembly if t is None else at_time(self.assembly, float(t))
        return self._kernel if here is self.assembly else self._compiled.bind(here.parameter_values)

    def _explain(self, kernel: Any, state: Sequence[FloatArray]) -> None:
        """Raise the error that says what has no value at a state."""
        kernel(*state)
        raise KernelEvaluationError("it has no finite value at this state", where=self.program.name)


def _are_plain(arrays: Sequence[FloatArray], given: Sequence[Numbers]) -> bool:
    """Return whether arrays can be read where they are: they are what was given, and contiguous."""
    return all(a is b and a.flags.c_contiguous for a, b in zip(arrays, given, strict=True))


def _each(kernel: Any, out: FloatArray, rows: Sequence[FloatArray]) -> int:
    """Fill rows of results; return the first that is not finite, or their number."""
    if hasattr(kernel, "each"):
        found: int = kernel.each((out,), *rows)
        return found
    for i in range(len(out)):  # functions in Python raise what went wrong
        out[i] = kernel(*(one[i] for one in rows))[0]
    return len(out)


def known_function(
    assembly: Assembly,
    key: Key[Program],
    inputs: Iterable[InputGroup],
    name: str,
    expressions: Callable[[], Sequence[Expression]],
    shape: tuple[int, ...],
    *about: Hashable,
) -> Function:
    """Return a function whose program is made once for all assemblies of a structure."""

    def make() -> Program:
        outputs = (OutputGroup(name, tuple(expressions())),)
        return Program(f"{assembly.flat.name} {name}", tuple(inputs), assembly.parameters, outputs)

    return Function(assembly, assembly.shared.get(key, make, *about, name), shape)
