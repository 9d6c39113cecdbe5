"""IDA's memory for one session: made, used and freed together."""

from __future__ import annotations

import ctypes
import weakref
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from ctypes import c_double, c_int, c_long, c_void_p
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import UsageError
from atwood.integrators.ida.callbacks import JACOBIAN, Record
from atwood.integrators.ida.library import SundialsLibrary
from atwood.integrators.ida.linear_solvers import FixedSolver, SparseSolver
from atwood.integrators.ida.reading import StepReader, address_in
from atwood.integrators.protocol import ChoosePivots, StepMonitor
from atwood.lazy_dataclasses import dataclass

TO_TIME, ONE_STEP = 1, 2
"""What `IdaMemory.solve` does: go on until a time is reached or passed, or take one step."""

ROOT_RETURN = 2
"""IDA's flag when an event function has changed its sign."""

TOO_MUCH_WORK = -1
"""IDA's flag when it has taken as many steps as it was allowed to."""

STOPPED_BY_WEIGHTS = -22
"""IDA's flag when the error weights are not what they must be, or made it stop between two steps."""

TOO_LONG = (-3, -4)
"""Flags of IDA that at the start may mean that the first step was far too long, or too short."""

REASONS = {
    -2: "the tolerances ask for more accuracy than the arithmetic has",
    -3: "the error test failed too often in a step, or the step became too small",
    -4: "Newton's iteration failed too often in a step, or the step became too small",
    -5: "the linear solver could not be set up",
    -6: "the linear solver failed while factorising the Jacobian",
    -7: "the linear solver failed",
    -8: "the residual failed",
    -9: "the residual has no value near here",
    -11: "the bounds on the unknowns could not be met",
    -12: "the residual failed at the start",
    -14: "the residual or the linear solver failed, and smaller steps did not help",
    -22: "the solver was given something that it cannot work with",
    -24: "an error weight became zero: an unknown passed zero and its absolute tolerance is zero",
}
"""What IDA's flags say."""


@dataclass(frozen=True)
class Counts:
    """What IDA has counted since its last start.

    Attributes
    ----------
    steps, residuals, jacobians
        Accepted steps and evaluations, those for the linear solver included.
    error_failures, solve_failures
        Steps that were repeated, because of the error or because they could not be solved.
    newton_iterations
        Of all steps.
    last_order, last_step
        Of the method.
    """

    steps: int
    residuals: int
    jacobians: int
    error_failures: int
    solve_failures: int
    newton_iterations: int
    last_order: int
    last_step: float


class _Parts:
    """Everything that has to be freed, in the order in which it was made."""

    def __init__(self, library: SundialsLibrary) -> None:
        self.library = library
        self.context = c_void_p()
        self.ida = c_void_p()
        self.solver: int | None = None
        self.sparse: SparseSolver | None = None
        self.fixed: FixedSolver | None = None
        self.matrix: int | None = None
        self.vectors: list[int] = []
        self.keep: list[object] = []

    def free(self) -> None:
        library = self.library
        if self.ida.value is not None:
            library.IDAFree(ctypes.byref(self.ida))
        self.free_solver()
        for vector in self.vectors:
            library.N_VDestroy(vector)
        if self.context.value is not None:
            library.SUNContext_Free(ctypes.byref(self.context))
        self.vectors.clear()
        self.keep.clear()

    def free_solver(self) -> None:
        if self.sparse is not None:
            self.sparse.free()
        if self.fixed is not None:
            self.fixed.free()
        if self.solver:
            self.library.SUNLinSolFree(self.solver)
        if self.matrix:
            self.library.SUNMatDestroy(self.matrix)
        self.solver = self.matrix = self.sparse = self.fixed = None


class _Grave(weakref.ref["IdaMemory"]):
    """What is freed when the memory that it refers to is no longer there; the callback is no function of Python.

    What a finalizer raises is lost, Ctrl-C too, and freeing takes long enough for that to happen.
    """

    __slots__ = ("parts",)
    parts: _Parts


_graves: dict[int, _Grave] = {}
_dead: deque[_Grave] = deque()


def _free_dead() -> None:
    """Free what is no longer used."""
    while _dead:
        with suppress(IndexError):  # another thread was faster
            grave = _dead.popleft()
            if _graves.pop(id(grave), None) is not None:
                grave.parts.free()


class IdaMemory:
    """IDA's memory, its vectors, matrix and linear solver, in a context of their own.

    Messages of SUNDIALS go nowhere: its flags say the same.

    Parameters
    ----------
    library
        SUNDIALS.
    size
        The number of unknowns.

    Attributes
    ----------
    y, yp
        Where IDA puts states, and where starts come from.
    """

    def __init__(self, library: SundialsLibrary, size: int) -> None:
        self.library = library
        self.size = size
        _free_dead()
        self._parts = parts = _Parts(library)
        self._grave = grave = _Grave(self, _dead.append)
        grave.parts = parts
        _graves[id(grave)] = grave
        self._check(library.SUNContext_Create(0, ctypes.byref(parts.context)), "SUNContext_Create")
        library.SUNContext_ClearErrHandlers(parts.context)
        self.y, self._y = self.vector(np.zeros(size))
        self.yp, self._yp = self.vector(np.zeros(size))
        parts.ida.value = self._created(library.IDACreate(parts.context), "IDACreate")
        self._ida = parts.ida
        self._jacobian = 0
        self._time = c_double()
        self._count = c_long()
        self._time_place, self._count_place = ctypes.byref(self._time), ctypes.byref(self._count)

    @property
    def is_closed(self) -> bool:
        """Whether the memory has been freed."""
        return id(self._grave) not in _graves

    def close(self) -> None:
        """Free everything; again does nothing."""
        if _graves.pop(id(self._grave), None) is not None:
            self._parts.free()

    def keep(self, *things: object) -> None:
        """Let things live as long as the memory."""
        self._parts.keep.extend(things)

    def vector(self, values: FloatArray) -> tuple[FloatArray, int]:
        """Return an array together with the vector that shares its memory."""
        vector = self.library.N_VMake_Serial(self.size, values.ctypes.data, self._parts.context)
        self._parts.vectors.append(self._created(vector, "N_VMake_Serial"))
        self._parts.keep.append(values)
        return values, vector

    def begin(self, residual: int, t: float, user_data: int) -> None:
        """Give IDA the residual and the start in `y` and `yp`."""
        self.call("IDAInit", residual, t, self._y, self._yp)
        self.call("IDASetUserData", user_data)

    def begin_again(self, t: float) -> None:
        """Restart from `y` and `yp`."""
        sparse = self._parts.sparse
        if sparse is not None:
            # A sparse solver that starts anew would lose the memory of its factors.
            old = sparse.renew()
            self._use_solver(sparse.solver, sparse.matrix)
            sparse.free_solver(old)
        self.call("IDAReInit", t, self._y, self._yp)

    def set_linear_solver(
        self,
        entries: int,
        jacobian: int,
        is_sparse: bool,
        pivots: ChoosePivots | None,
        record: Record,
        sizes: FloatArray,
    ) -> None:
        """Make the matrix and the linear solver; a record takes up what goes wrong in Python there."""
        library, parts, n = self.library, self._parts, self.size
        if pivots is not None:
            parts.fixed = fixed = FixedSolver(library, pivots, parts.context, record, sizes)
            matrix, solver = fixed.matrix, fixed.solver
        elif is_sparse:
            parts.sparse = sparse = SparseSolver(library, n, entries, self._y, parts.context)
            matrix, solver = sparse.matrix, sparse.solver
        else:
            parts.matrix = matrix = self._created(library.SUNDenseMatrix(n, n, parts.context), "SUNDenseMatrix")
            made = library.SUNLinSol_Dense(self._y, matrix, parts.context)
            parts.solver = solver = self._created(made, "SUNLinSol_Dense")
        self._jacobian = jacobian
        self._use_solver(solver, matrix)

    def _use_solver(self, solver: int, matrix: int) -> None:
        self.call("IDASetLinearSolver", solver, matrix)
        self.call("IDASetJacFn", self._jacobian)

    def renew_factors(self, t: float, rate: float, user_data: int) -> bool:
        """Work out the Jacobian anew and factorise it, as IDA did last; return whether that worked."""
        parts, library = self._parts, self.library
        own = parts.fixed or parts.sparse
        solver, matrix = (own.solver, own.matrix) if own else (parts.solver, parts.matrix)
        library.SUNMatZero(matrix)
        jacobian = JACOBIAN(self._jacobian)
        flag = jacobian(t, rate, self._y, self._yp, self._y, matrix, user_data, None, None, None)
        return flag == 0 and bool(library.SUNLinSolSetup(solver, matrix) == 0)

    def call(self, name: str, *arguments: Any) -> None:
        """Call a function of IDA that must not fail."""
        self._check(getattr(self.library, name)(self._ida, *arguments), name)

    def solve(self, t_out: float, task: int) -> tuple[int, float]:
        """Go on; return IDA's flag and the time that belongs to `y` and `yp`."""
        flag = self.library.IDASolve(self._ida, t_out, self._time_place, self._y, self._yp, task)
        return flag, self._time.value

    def set_monitor(self, monitor: StepMonitor) -> Callable[[float, int], tuple[int, float]]:
        """Return what goes on to a time with at most so many steps, and looks at the motion on its way."""
        library, place = self.library, c_void_p()
        drive = ctypes.CFUNCTYPE(c_int, c_void_p, c_void_p, c_void_p, c_double, *[c_void_p] * 5, c_long, c_void_p)
        call = drive(monitor.drive)
        solve, steps = (ctypes.cast(getattr(library, name), c_void_p).value for name in ("IDASolve", "IDAGetNumSteps"))
        reached, y, yp = ctypes.addressof(self._time), self.y.ctypes.data, self.yp.ctypes.data
        place.value = monitor.data
        self.keep(monitor)

        def go(t_out: float, allowed: int) -> tuple[int, float]:
            flag = call(solve, steps, self._ida, t_out, reached, self._y, self._yp, y, yp, allowed, place)
            return flag, self._time.value

        return go

    def fill(self, monitor: StepMonitor) -> Callable[[FloatArray, FloatArray, int, int], tuple[int, float, int]]:
        """Return what goes on through times and fills the rows of a table after some that are filled already.

        It is given times, table, how many rows are filled, and how many steps to take at most; it returns a flag, the
        time that belongs to `y` and `yp` where that is IDA's own or a look's, and how many rows are filled then.
        """
        library, count, end = self.library, c_long(), c_double()
        call = ctypes.CFUNCTYPE(c_int, *[c_void_p] * 10, c_long, c_void_p, c_void_p, c_long, *[c_void_p] * 3)(
            monitor.fill
        )
        names = ("IDASolve", "IDAGetNumSteps", "IDAGetDky", "IDAGetCurrentTime")
        functions = tuple(ctypes.cast(getattr(library, name), c_void_p) for name in names)
        reached, y, yp = ctypes.addressof(self._time), self.y.ctypes.data, self.yp.ctypes.data
        places = reached, self._y, self._yp, y, yp
        data, filled_at, end_at = c_void_p(monitor.data), ctypes.addressof(count), ctypes.addressof(end)
        self.keep(monitor, count, end)  # machine code writes to them as long as the session lives

        def go(times: FloatArray, table: FloatArray, filled: int, allowed: int) -> tuple[int, float, int]:
            count.value = filled
            given = times.ctypes.data, len(times), table.ctypes.data, filled_at, end_at
            flag = call(*functions, self._ida, *places, allowed, data, *given)
            return flag, self._time.value, count.value

        return go

    def reader(self) -> StepReader:
        """Return what reads the last step without Python."""
        places = self._ida.value or 0, self._y, self._yp, self.y.ctypes.data, self.yp.ctypes.data
        return StepReader(self.size, (address_in(self.library, "IDAGetDky"), *places), self)

    def interpolate(self, t: float) -> int:
        """Put the solution at a time inside the last step into `y` and `yp`; return IDA's flag."""
        flag: int = self.library.IDAGetDky(self._ida, t, 0, self._y)
        return flag or int(self.library.IDAGetDky(self._ida, t, 1, self._yp))

    def interpolate_each(self, times: Sequence[float]) -> tuple[FloatArray, FloatArray]:
        """Return the solution at times inside the last step, one row each, and its derivative at the last of them."""
        rows = np.empty((len(times), self.size))
        read, ida, into, y = self.library.IDAGetDky, self._ida, self._y, self.y
        for row, t in zip(rows, times, strict=True):
            flag = read(ida, t, 0, into)
            row[:] = y if flag == 0 else np.nan
        flag = read(ida, times[-1], 1, self._yp)
        return rows, self.yp.copy() if flag == 0 else np.full(self.size, np.nan)

    def time(self) -> float:
        """Return the time at the end of the last step."""
        self.library.IDAGetCurrentTime(self._ida, self._time_place)
        return self._time.value

    def begin_of_step(self) -> float:
        """Return the time at the begin of the last step."""
        end = self.time()
        self.library.IDAGetLastStep(self._ida, self._time_place)
        return end - self._time.value

    def steps(self) -> int:
        """Return the number of steps since the last start."""
        self.library.IDAGetNumSteps(self._ida, self._count_place)
        return self._count.value

    def last_tried(self) -> tuple[FloatArray, FloatArray]:
        """Return the y and y' of IDA's last residual."""
        found = []
        for name in ("IDAGetCurrentY", "IDAGetCurrentYp"):
            vector = c_void_p()
            self.call(name, ctypes.byref(vector))
            where = self.library.N_VGetArrayPointer(vector)
            found.append(np.array((c_double * self.size).from_address(where)))
        return found[0], found[1]

    def counts(self) -> Counts:
        """Return what IDA has counted since the last start."""
        longs = [c_long() for _ in range(9)]
        steps, residuals, setups, error_failures, iterations, unsolved, jacobians, extra, failed = longs
        orders, numbers = [c_int(), c_int()], [c_double() for _ in range(4)]
        by = ctypes.byref
        values: tuple[Any, ...] = (steps, residuals, setups, error_failures, *orders, *numbers)
        self.call("IDAGetIntegratorStats", *(by(value) for value in values))
        self.call("IDAGetNonlinSolvStats", by(iterations), by(unsolved))
        self.call("IDAGetNumStepSolveFails", by(failed))
        self.call("IDAGetNumJacEvals", by(jacobians))
        self.call("IDAGetNumLinResEvals", by(extra))
        return Counts(
            steps=steps.value,
            residuals=residuals.value + extra.value,
            jacobians=jacobians.value,
            error_failures=error_failures.value,
            solve_failures=failed.value,
            newton_iterations=iterations.value,
            last_order=orders[0].value,
            last_step=numbers[1].value,
        )

    def _created(self, pointer: int | None, what: str) -> int:
        if not pointer:
            raise MemoryError(f"{what} failed")
        return pointer

    def _check(self, flag: int, name: str) -> None:
        if flag != 0:
            raise UsageError(f"SUNDIALS refused what {name} was given (flag {flag})")
