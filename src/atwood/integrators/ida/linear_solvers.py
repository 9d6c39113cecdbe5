"""A linear solver of our own for SUNDIALS: fixed pivots in the order of the bodies, without what a general one costs.

SUNDIALS' solvers begin with their content and have a table of functions. Where that is, and which function is where in
it, is not taken for granted: it is looked up in its own dense solver, whose functions are known by name. Where pivots
are no good for a matrix others are chosen by its numbers. Where that does not help, or has been done often, SciPy's
SuperLU, which looks for pivots each time, takes over until the next factorisation.

SuperLU_MT, the sparse linear solver of the shared libraries, with care for what it does not do itself.

Facts about SUNDIALS 7.9 with SuperLU_MT that this module rests on:

- it keeps its work space in global variables: two factorisations at the same time destroy each other;
- even when asked for one thread it starts as many as OpenMP offers, which wait for each other;
- freeing a solver that never had factors crashes, and a solver that starts anew loses the factors that it had.
"""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Mapping
from ctypes import CDLL, CFUNCTYPE, c_double, c_int, c_int64, c_void_p, sizeof
from functools import cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen.sundials.fixed_pivots import AGAIN, SLOTS, fixed_pivots_addresses
from atwood.integrators.ida.callbacks import address
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import scipy
from atwood.numerics.fixed_pivots import FixedPivots

if TYPE_CHECKING:
    from atwood.integrators.ida.callbacks import Record
    from atwood.integrators.ida.library import SundialsLibrary
    from atwood.integrators.protocol import ChoosePivots

_MEND = CFUNCTYPE(c_int)
_SOLVE = CFUNCTYPE(c_int, c_void_p, c_void_p)
_NAMES = {"type": "SUNLinSolGetType_Dense", "setup": "SUNLinSolSetup_Dense", "solve": "SUNLinSolSolve_Dense"}
_WORDS, _SLOTS_OF_A_TABLE = 4, 16
"""Among the first words of a solver there is the table, and among its first slots are the functions."""

_MOST_SAMPLES = 6
"""So many matrices of a run have pivots chosen by their numbers."""

_RECOVERABLE = 1
"""What a setup answers where the matrix is singular: a smaller step may help."""


@dataclass(frozen=True)
class TableLayout:
    """Where things are in SUNDIALS' linear solvers, in bytes.

    Attributes
    ----------
    table
        In a solver: the address of its table.
    slots
        In the table: what tells the kind of the solver, sets it up, and solves.
    """

    table: int
    slots: Mapping[str, int]


@cache
def table_layout(library: SundialsLibrary) -> TableLayout:
    """Return where solvers have their functions."""
    context, number = c_void_p(), c_double()
    library.SUNContext_Create(0, ctypes.byref(context))
    vector = library.N_VMake_Serial(1, ctypes.addressof(number), context)
    matrix = library.SUNDenseMatrix(1, 1, context)
    solver = library.SUNLinSol_Dense(vector, matrix, context)
    wanted = {key: address(getattr(library, name)) for key, name in _NAMES.items()}
    found = None
    for word, place in enumerate((c_void_p * _WORDS).from_address(solver)):
        if word and place not in (None, context.value):
            table = (c_void_p * _SLOTS_OF_A_TABLE).from_address(place)
            slots = {value: sizeof(c_void_p) * k for k, value in enumerate(table)}
            if all(address in slots for address in wanted.values()):
                found = TableLayout(sizeof(c_void_p) * word, {key: slots[one] for key, one in wanted.items()})
                break
    library.SUNLinSolFree(solver)
    library.SUNMatDestroy(matrix)
    library.N_VDestroy(vector)
    library.SUNContext_Free(ctypes.byref(context))
    if found is None:
        raise LookupError("SUNDIALS' dense solver has other functions than its library")
    return found


class FixedSolver:
    """A matrix as one column with its entries, and its linear solver.

    Parameters
    ----------
    library
        SUNDIALS.
    choose
        Returns pivots that are good for some matrices, given by their entries; see `ImplicitProblem.pivots`.
    context
        SUNDIALS' context.
    record
        Takes up what goes wrong in Python.
    sizes
        Of the unknowns, so that no unit decides whether pivots are good.

    Attributes
    ----------
    matrix, solver
        As SUNDIALS wants them.
    fallbacks
        How often fixed pivots were no good.
    """

    def __init__(
        self, library: SundialsLibrary, choose: ChoosePivots, context: c_void_p, record: Record, sizes: FloatArray
    ) -> None:
        pivots = choose(())
        if pivots is None:
            raise LookupError("there are no pivots")
        self._library, self._choose, self._record = library, choose, record
        self._samples: list[FloatArray] = []
        self.fallbacks = 0
        self._factors: Any = None
        self._functions = _MEND(self._mend), _SOLVE(self._solve)
        signs = np.where(np.random.default_rng(pivots.size).integers(0, 2, pivots.size), 1.0, -1.0)
        self._vectors = {name: np.zeros(pivots.size) for name in ("right", "work", "found")}
        self._vectors |= {"probe": signs, "sizes": np.array(sizes, dtype=float)}
        self._block = (c_int64 * len(SLOTS))()
        self._put({name: one.ctypes.data for name, one in self._vectors.items()})
        self._put({name: address(one) for name, one in zip(("mend", "solve"), self._functions, strict=True)})
        self._follow(pivots)
        self.matrix: int = library.SUNDenseMatrix(len(pivots.positions), 1, context)
        self.solver: int = library.SUNLinSolNewEmpty(context)
        if not (self.matrix and self.solver):
            raise MemoryError("SUNLinSolNewEmpty failed")
        layout = table_layout(library)
        table = c_void_p.from_address(self.solver + layout.table).value or 0
        kind = {"type": address(library.SUNLinSolGetType_Dense)}
        for key, place in (kind | dict(fixed_pivots_addresses())).items():
            c_void_p.from_address(table + layout.slots[key]).value = place
        c_void_p.from_address(self.solver).value = ctypes.addressof(self._block)

    def free(self) -> None:
        """Free everything."""
        if self.solver:
            c_void_p.from_address(self.solver).value = None
            self._library.SUNLinSolFreeEmpty(self.solver)
        if self.matrix:
            self._library.SUNMatDestroy(self.matrix)
        self.solver = self.matrix = 0

    def _put(self, values: Mapping[str, int]) -> None:
        for name, value in values.items():
            self._block[SLOTS.index(name)] = value

    def _follow(self, pivots: FixedPivots) -> None:
        """Eliminate in another way from now on."""
        self._pivots, self._values = pivots, np.zeros(pivots.room)
        self._put({name: getattr(pivots, name).ctypes.data for name in SLOTS[: SLOTS.index("size")]})
        self._put({"size": pivots.size, "count": len(pivots.positions), "room": pivots.room})
        self._put({"values": self._values.ctypes.data})

    def _mend(self) -> int:
        """Take pivots that are good for the present matrix too, or else any that SuperLU finds for it alone."""
        try:
            self.fallbacks += 1
            entries = np.array(self._present)
            if not np.all(np.isfinite(entries)):
                return _RECOVERABLE
            is_new = not self._samples or not np.array_equal(self._samples[-1], entries)
            if is_new and len(self._samples) < _MOST_SAMPLES:
                self._samples.append(entries)
                pivots = self._choose(tuple(self._samples))
                if pivots is not None:
                    self._follow(pivots)
                    return AGAIN
            return self._factorise(entries)
        except BaseException as error:
            return self._record.fail(error)

    @property
    def _present(self) -> Any:
        """The entries of the present matrix."""
        return (c_double * len(self._pivots.positions)).from_address(self._block[SLOTS.index("entries")])

    def _factorise(self, entries: FloatArray) -> int:
        pivots, self._factors = self._pivots, None
        rows = np.repeat(np.arange(pivots.size), np.diff(pivots.row_starts))
        matrix = scipy.sparse.csc_array(
            (entries[pivots.by_row], (rows, pivots.row_columns)), shape=(pivots.size, pivots.size)
        )
        try:
            self._factors = scipy.sparse.linalg.splu(matrix)
        except (RuntimeError, ValueError):  # a pivot is exactly zero, or something is not finite
            return _RECOVERABLE
        return 0

    def _solve(self, right: int, solution: int) -> int:
        """Solve with the factors that SuperLU has found."""
        try:
            given, wanted = ((c_double * self._pivots.size).from_address(where) for where in (right, solution))
            found = self._factors.solve(np.array(given))
            wanted[:] = found.tolist()
        except BaseException as error:
            return self._record.fail(error)
        return 0 if np.all(np.isfinite(found)) else _RECOVERABLE


BY_COLUMNS = 0
"""SUNDIALS' CSC_MAT."""

_THREADS = 1


class OneAtATime:
    """While this is entered, no other thread can factorise, and OpenMP starts no threads for this one.

    Parameters
    ----------
    openmp
        The OpenMP library that belongs to SUNDIALS, if there is one.
    """

    def __init__(self, openmp: CDLL | None) -> None:
        self._lock = threading.RLock()
        self._before: list[int] = []
        self._openmp: Any = openmp

    def __enter__(self) -> None:
        self._lock.acquire()
        if self._openmp is not None:
            self._before.append(self._openmp.omp_get_max_threads())
            self._openmp.omp_set_num_threads(_THREADS)

    def __exit__(self, *_: object) -> None:
        if self._openmp is not None:
            self._openmp.omp_set_num_threads(self._before.pop())
        self._lock.release()


class SparseSolver:
    """A matrix by columns and its linear solver.

    Parameters
    ----------
    library
        SUNDIALS.
    size, entries
        Of the matrix.
    vector
        A vector of this size.
    context
        SUNDIALS' context.

    Attributes
    ----------
    matrix, solver
        As SUNDIALS wants them.
    """

    def __init__(self, library: SundialsLibrary, size: int, entries: int, vector: int, context: c_void_p) -> None:
        make = library.superlu()
        self._library = library
        self._size = size
        # There must be room for a unit matrix; see `free`.
        self._entries = max(entries, size)
        self.matrix: int = library.SUNSparseMatrix(size, size, self._entries, BY_COLUMNS, context)
        if not self.matrix:
            raise MemoryError("SUNSparseMatrix failed")
        self._make = partial(make, vector, self.matrix, _THREADS, context)
        self.solver = 0
        self.solver = self._new_solver()

    def _new_solver(self) -> int:
        solver: int | None = self._make()
        if not solver:
            raise MemoryError("SUNLinSol_SuperLUMT failed")
        self._library.SUNLinSolInitialize(solver)
        return solver

    def renew(self) -> int:
        """Take a new solver for the same matrix; return the old one, which is for `free_solver`."""
        old, self.solver = self.solver, self._new_solver()
        return old

    @staticmethod
    def has_no_factors(solver: int) -> bool:
        """Tell whether nothing has been factorised since a solver was last initialised."""
        content = c_void_p.from_address(solver).value
        assert content is not None
        # It begins with the last flag and with whether the next factorisation is the first one.
        return bool(c_int.from_address(content + sizeof(c_int)).value)

    def factorise_unit_matrix(self, solver: int) -> None:
        """Give a solver factors."""
        library, n = self._library, self._size
        index = library.index_type
        starts = (index * (n + 1)).from_address(library.SUNSparseMatrix_IndexPointers(self.matrix))
        rows = (index * self._entries).from_address(library.SUNSparseMatrix_IndexValues(self.matrix))
        values = (c_double * self._entries).from_address(library.SUNSparseMatrix_Data(self.matrix))
        starts[:] = range(n + 1)
        rows[:n] = range(n)
        values[:n] = [1.0] * n
        library.SUNLinSolInitialize(solver)
        library.SUNLinSolSetup(solver, self.matrix)

    def free_solver(self, solver: int) -> None:
        """Free a solver of this matrix."""
        with self._library.sparse_guard:
            if not self._library.tells_factors or self.has_no_factors(solver):
                self.factorise_unit_matrix(solver)
            self._library.SUNLinSolFree(solver)

    def free(self) -> None:
        """Free everything."""
        if self.solver:
            self.free_solver(self.solver)
        self._library.SUNMatDestroy(self.matrix)

    def tells_factors(self) -> bool:
        """Try, on a solver that is of no further use, whether `has_no_factors` tells the truth."""
        before = self.has_no_factors(self.solver)
        self.factorise_unit_matrix(self.solver)
        return before and not self.has_no_factors(self.solver)
