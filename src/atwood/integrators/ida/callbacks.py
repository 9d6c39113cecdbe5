"""Python functions as C functions with the signatures that IDA calls.

No exception may leave such a function: the C code between it and the caller knows nothing of exceptions.  So they
are kept in the `Record`, and raised again once IDA has returned.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterable
from ctypes import CFUNCTYPE, c_double, c_int, c_int32, c_int64, c_void_p
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.errors import KernelEvaluationError
from atwood.integrators.protocol import ImplicitProblem, LinearSolver, State
from atwood.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from atwood.integrators.ida.library import SundialsLibrary

NO_VALUE = (KernelEvaluationError, ArithmeticError)
"""What a function raises where it has no value."""

GOOD, RECOVERABLE, BROKEN = 0, 1, -1
"""What a function answers: it has a value; a smaller step may help; nothing helps."""

Places = NDArray[np.intp] | slice


@dataclass
class Record:
    """What happened inside the functions that IDA called.

    Attributes
    ----------
    residuals, jacobians, undefined
        How often Python functions were called, as far as somebody counts it, and how often there was no finite value.
    complaint, equation, time
        The last of these: in words, in which equation, and when.
    error
        An exception that waits to be raised again.
    interrupted
        Whether Ctrl-C came while Python functions were being called.
    calls_python
        Whether any of the functions is one of Python.
    """

    residuals: int = 0
    jacobians: int = 0
    undefined: int = 0
    complaint: str = ""
    equation: int | None = None
    time: float = -inf
    error: BaseException | None = None
    interrupted: bool = False
    calls_python: bool = False

    def note(self, t: float, what: str, equation: int | None = None) -> None:
        """Take up that there was no value."""
        self.undefined += 1
        self.complaint = f"at t = {t:.9g} {what}"
        self.equation = equation
        self.time = t

    def take_residual(self, problem: ImplicitProblem, t: float, y: FloatArray, yp: FloatArray, out: FloatArray) -> bool:
        """Write the residual; return whether it has a value, which is noted where it has none."""
        try:
            out[:] = problem.residual(t, y, yp)
        except NO_VALUE as error:
            self.note(t, f"the residual has no value: {error}")
            return False
        bad = _first_undefined(out)
        if bad is not None:
            self.note(t, f"the residual of equation {bad} is {out[bad]}", bad)
        return bad is None

    def take_jacobian(
        self, problem: ImplicitProblem, t: float, y: FloatArray, yp: FloatArray, cj: float
    ) -> FloatArray | None:
        """Return the entries of the Jacobian; None where they have no value, which is noted."""
        try:
            entries = np.asarray(problem.jacobian(t, y, yp, cj), dtype=np.float64)
        except NO_VALUE as error:
            self.note(t, f"the Jacobian has no value: {error}")
            return None
        bad = _first_undefined(entries)
        if bad is None:
            return entries
        equation = int(problem.pattern[0][bad])
        self.note(t, f"the Jacobian of equation {equation} is not finite", equation)
        return None

    def fail(self, error: BaseException) -> int:
        """Keep an exception, and return the answer to IDA."""
        self.error = error
        return BROKEN

    def raise_again(self) -> None:
        """Raise what was kept."""
        error, self.error = self.error, None
        if error is not None:
            raise error
        if self.interrupted:
            self.interrupted = False
            raise KeyboardInterrupt


def _first_undefined(values: FloatArray) -> int | None:
    """Return the number of the first value that is not finite."""
    if np.dot(values, values) < inf:
        return None
    finite = np.isfinite(values)
    return None if finite.all() else int(finite.argmin())


class _Views:
    """NumPy views of IDA's vectors, each made once: the vectors of a session stay where they are."""

    def __init__(self, size: int, pointer_of: Callable[[int], int], writeable: bool) -> None:
        self._size = size
        self._pointer_of = pointer_of
        self._writeable = writeable
        self._made: dict[int, FloatArray] = {}

    def __call__(self, vector: int) -> FloatArray:
        view = self._made.get(vector)
        if view is None:
            view = _array_at(self._pointer_of(vector), self._size, c_double)
            view.flags.writeable = self._writeable
            self._made[vector] = view
        return view


def _array_at(where: int, size: int, kind: type[c_double] | type[c_int32] | type[c_int64]) -> NDArray[Any]:
    """Return numbers in C memory as an array."""
    memory: Any = (kind * size).from_address(where)
    return np.frombuffer(memory, dtype=kind)


def address(function: Any) -> int:
    """Return the address of a C function made by ctypes."""
    return ctypes.cast(function, c_void_p).value or 0


def _answering(record: Record, function: Callable[..., int]) -> Callable[..., int]:
    """Return a function that IDA may call: no exception leaves it."""

    def answer(*given: Any) -> int:
        if record.interrupted:
            return BROKEN
        try:
            return function(*given)
        except BaseException as error:
            return record.fail(error)

    record.calls_python = True
    return answer


def residual_function(problem: ImplicitProblem, record: Record, library: SundialsLibrary) -> Any:
    """Return the residual as an ``IDAResFn``."""
    given = _Views(problem.size, library.N_VGetArrayPointer, writeable=False)
    wanted = _Views(problem.size, library.N_VGetArrayPointer, writeable=True)

    def residual(t: float, y: int, yp: int, out: int, _: int | None) -> int:
        return GOOD if record.take_residual(problem, t, given(y), given(yp), wanted(out)) else RECOVERABLE

    return RESIDUAL(_answering(record, residual))


def jacobian_function(
    problem: ImplicitProblem, record: Record, library: SundialsLibrary, linear_solver: LinearSolver
) -> Any:
    """Return the Jacobian as an ``IDALsJacFn``."""
    rows, columns = problem.pattern
    given = _Views(problem.size, library.N_VGetArrayPointer, writeable=False)
    if linear_solver == "sparse":
        entries_of, places = _sparse_writer(problem, library)
    elif linear_solver == "fixed":
        entries_of, places = _Views(len(rows), library.SUNDenseMatrix_Data, writeable=True), slice(None)
    else:
        entries_of = _Views(problem.size**2, library.SUNDenseMatrix_Data, writeable=True)
        places = columns * problem.size + rows

    def jacobian(t: float, cj: float, y: int, yp: int, _: int, matrix: int, *more: int | None) -> int:
        entries = record.take_jacobian(problem, t, given(y), given(yp), cj)
        if entries is None:
            return RECOVERABLE
        entries_of(matrix)[places] = entries
        return GOOD

    return JACOBIAN(_answering(record, jacobian))


def _sparse_writer(problem: ImplicitProblem, library: SundialsLibrary) -> tuple[Callable[[int], FloatArray], Places]:
    """Return what writes the pattern into a sparse matrix and hands back the place for its entries."""
    rows, columns = problem.pattern
    starts = np.searchsorted(columns, np.arange(problem.size + 1))
    made: dict[int, tuple[NDArray[Any], NDArray[Any], FloatArray]] = {}

    def entries_of(matrix: int) -> FloatArray:
        if matrix not in made:
            made[matrix] = (
                _array_at(library.SUNSparseMatrix_IndexValues(matrix), len(rows), library.index_type),
                _array_at(library.SUNSparseMatrix_IndexPointers(matrix), len(starts), library.index_type),
                _array_at(library.SUNSparseMatrix_Data(matrix), len(rows), c_double),
            )
        row_values, column_starts, entries = made[matrix]
        # IDA sets the pattern to zero, too, before it asks for the matrix.
        row_values[:] = rows
        column_starts[:] = starts
        return entries

    return entries_of, slice(None)


def weight_function(relative: FloatArray, absolute: FloatArray, record: Record, library: SundialsLibrary) -> Any:
    """Return ``1 / (relative |y| + absolute)`` as an ``IDAEwtFn``."""
    given = _Views(len(relative), library.N_VGetArrayPointer, writeable=False)
    wanted = _Views(len(relative), library.N_VGetArrayPointer, writeable=True)

    def weights(y: int, out: int, _: int | None) -> int:
        allowed = relative * np.abs(given(y)) + absolute
        if not (allowed > 0.0).all():
            return BROKEN
        np.divide(1.0, allowed, out=wanted(out))
        return GOOD

    return WEIGHTS(_answering(record, weights))


def explain(problem: ImplicitProblem, record: Record, states: Iterable[State]) -> None:
    """Ask the Python residual what compiled functions cannot say: which equation has no value."""
    undefined = record.undefined
    for t, y, yp in states:
        if not record.take_residual(problem, t, y, yp, np.empty(problem.size)):
            break
    record.undefined = undefined


RESIDUAL = CFUNCTYPE(c_int, c_double, *[c_void_p] * 4)
"""Time, y, y', the result, the user's data."""

JACOBIAN = CFUNCTYPE(c_int, c_double, c_double, *[c_void_p] * 8)
"""Time, cj, y, y', the residual, the matrix, the user's data, three vectors."""

WEIGHTS = CFUNCTYPE(c_int, *[c_void_p] * 3)
"""The vector y, the weights, the user's data."""
