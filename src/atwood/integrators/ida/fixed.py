"""A linear solver of our own for SUNDIALS: fixed pivots in the order of the bodies, without what a general one costs.

SUNDIALS' solvers begin with their content and have a table of functions. Where that is, and which function is where in
it, is not taken for granted: it is looked up in its own dense solver, whose functions are known by name. Where pivots
are no good for a matrix others are chosen by its numbers. Where that does not help, or has been done often, SciPy's
SuperLU, which looks for pivots each time, takes over until the next factorisation.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from ctypes import CFUNCTYPE, c_double, c_int, c_int64, c_void_p, sizeof
from functools import cache
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

    Attributes
    ----------
    matrix, solver
        As SUNDIALS wants them.
    fallbacks
        How often fixed pivots were no good.
    """

    def __init__(self, library: SundialsLibrary, choose: ChoosePivots, context: c_void_p, record: Record) -> None:
        pivots = choose(())
        if pivots is None:
            raise LookupError("there are no pivots")
        self._library, self._choose, self._record = library, choose, record
        self._samples: list[FloatArray] = []
        self.fallbacks = 0
        self._factors: Any = None
        self._functions = _MEND(self._mend), _SOLVE(self._solve)
        signs = np.where(np.random.default_rng(pivots.size).integers(0, 2, pivots.size), 1.0, -1.0)
        self._vectors = {name: np.zeros(pivots.size) for name in ("right", "work", "found")} | {"probe": signs}
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
