"""SuperLU_MT, the sparse linear solver of the shared libraries, with care for what it does not do itself.

Facts about SUNDIALS 7.9 with SuperLU_MT that this module rests on:

- it keeps its work space in global variables: two factorisations at the same time destroy each other;
- even when asked for one thread it starts as many as OpenMP offers, which wait for each other;
- freeing a solver that never had factors crashes, and a solver that starts anew loses the factors that it had.
"""

from __future__ import annotations

import threading
from ctypes import CDLL, c_double, c_int, c_void_p, sizeof
from functools import partial
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from atwood.integrators.ida.library import SundialsLibrary


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
