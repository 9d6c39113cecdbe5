"""The SUNDIALS libraries that the scikit-sundae wheel ships, opened without importing scikit-sundae.

Nothing about them is taken for granted: the folder is searched for, the version is asked of the library, and the
width of its indices is read from scikit-sundae's settings and checked against what the library does.
"""

from __future__ import annotations

import ctypes
import importlib.util
import os
import re
import sys
import threading
from ctypes import POINTER, c_double, c_int, c_int32, c_int64, c_long, c_void_p
from functools import cached_property
from pathlib import Path
from typing import Any

from atwood.codegen.sundials.layout import INDEX_BYTES, build_settings
from atwood.errors import AtwoodError
from atwood.integrators.ida.linear_solvers import BY_COLUMNS, OneAtATime, SparseSolver, table_layout

OLDEST = 7
"""The first major version with the calls that are used here."""

_ENDINGS = r"\.(?:so(?:\.[0-9]+)*|(?:[0-9]+\.)*dylib|dll)$"

_FREE_OF_CHARGE = ("sundials_core", "sundials_ida")
_MATRIX_LIBRARIES = (
    "sundials_nvecserial",
    "sundials_sunmatrixdense",
    "sundials_sunmatrixsparse",
    "sundials_sunlinsoldense",
)
_SUPERLU = "sundials_sunlinsolsuperlumt"
_BELOW_SUPERLU = ("gomp", "omp", "quadmath", "gfortran", "openblas", "openblasp", "sundials_sunmatrixsparse")

_I, _L, _D, _P = "index", POINTER(c_long), c_double, c_void_p
_SIGNATURES: dict[str, tuple[Any, ...]] = {
    # name: result, arguments
    "SUNDIALSGetVersionNumber": (c_int, POINTER(c_int), POINTER(c_int), POINTER(c_int), _P, c_int),
    "SUNContext_Create": (c_int, c_int, POINTER(_P)),
    "SUNContext_Free": (c_int, POINTER(_P)),
    "SUNContext_ClearErrHandlers": (c_int, _P),
    "N_VMake_Serial": (_P, _I, _P, _P),
    "N_VGetArrayPointer": (_P, _P),
    "N_VDestroy": (None, _P),
    "SUNDenseMatrix": (_P, _I, _I, _P),
    "SUNDenseMatrix_Data": (_P, _P),
    "SUNSparseMatrix": (_P, _I, _I, _I, c_int, _P),
    "SUNSparseFromDenseMatrix": (_P, _P, _D, c_int),
    "SUNSparseMatrix_Data": (_P, _P),
    "SUNSparseMatrix_IndexValues": (_P, _P),
    "SUNSparseMatrix_IndexPointers": (_P, _P),
    "SUNMatDestroy": (None, _P),
    "SUNMatZero": (c_int, _P),
    "SUNLinSol_Dense": (_P, _P, _P, _P),
    "SUNLinSolInitialize": (c_int, _P),
    "SUNLinSolSetup": (c_int, _P, _P),
    "SUNLinSolSolve": (c_int, _P, _P, _P, _P, _D),
    "SUNLinSolFree": (c_int, _P),
    "SUNLinSolNewEmpty": (_P, _P),
    "SUNLinSolFreeEmpty": (None, _P),
    "SUNLinSolGetType_Dense": (c_int, _P),
    "SUNLinSolSetup_Dense": (c_int, _P, _P),
    "SUNLinSolSolve_Dense": (c_int, _P, _P, _P, _P, _D),
    "IDACreate": (_P, _P),
    "IDAFree": (None, POINTER(_P)),
    "IDAInit": (c_int, _P, _P, _D, _P, _P),
    "IDAReInit": (c_int, _P, _D, _P, _P),
    "IDASVtolerances": (c_int, _P, _D, _P),
    "IDAWFtolerances": (c_int, _P, _P),
    "IDASetUserData": (c_int, _P, _P),
    "IDASetLinearSolver": (c_int, _P, _P, _P),
    "IDASetJacFn": (c_int, _P, _P),
    "IDASetId": (c_int, _P, _P),
    "IDASetSuppressAlg": (c_int, _P, c_int),
    "IDASetNonlinConvCoef": (c_int, _P, _D),
    "IDASetMaxOrd": (c_int, _P, c_int),
    "IDASetEtaFixedStepBounds": (c_int, _P, _D, _D),
    "IDASetDeltaCjLSetup": (c_int, _P, _D),
    "IDASetInitStep": (c_int, _P, _D),
    "IDASetMaxStep": (c_int, _P, _D),
    "IDASetMaxConvFails": (c_int, _P, c_int),
    "IDASetStopTime": (c_int, _P, _D),
    "IDAClearStopTime": (c_int, _P),
    "IDASetMaxNumSteps": (c_int, _P, c_long),
    "IDARootInit": (c_int, _P, c_int, _P),
    "IDASetNoInactiveRootWarn": (c_int, _P),
    "IDASolve": (c_int, _P, _D, POINTER(c_double), _P, _P, c_int),
    "IDAGetDky": (c_int, _P, _D, c_int, _P),
    "IDAGetCurrentTime": (c_int, _P, POINTER(c_double)),
    "IDAGetCurrentY": (c_int, _P, POINTER(_P)),
    "IDAGetCurrentYp": (c_int, _P, POINTER(_P)),
    "IDAGetLastStep": (c_int, _P, POINTER(c_double)),
    "IDAGetNumSteps": (c_int, _P, _L),
    "IDAGetIntegratorStats": (
        c_int, _P, _L, _L, _L, _L, POINTER(c_int), POINTER(c_int),
        POINTER(c_double), POINTER(c_double), POINTER(c_double), POINTER(c_double),
    ),
    "IDAGetNonlinSolvStats": (c_int, _P, _L, _L),
    "IDAGetNumStepSolveFails": (c_int, _P, _L),
    "IDAGetNumJacEvals": (c_int, _P, _L),
    "IDAGetNumLinResEvals": (c_int, _P, _L),
}  # fmt: skip


class SundialsMissing(AtwoodError):
    """The shared libraries of SUNDIALS cannot be used."""


class SundialsLibrary:
    """SUNDIALS' functions as attributes, with their C signatures.

    Attributes
    ----------
    folder
        Where the libraries are.
    version
        SUNDIALS' version.
    index_type
        The C type of its indices.
    sparse_guard
        To be entered while a sparse matrix can be factorised.
    tells_factors
        Whether a sparse solver tells if it has been used.
    """

    def __init__(self) -> None:
        package = _package_folder()
        self._files = _library_files(package)
        self._opened: dict[str, ctypes.CDLL] = {}
        self.folder = self._files["sundials_ida"].parent
        self._allow_folder()
        for name in _FREE_OF_CHARGE:
            self._open(name)
        self.index_type: type[c_int32] | type[c_int64] = c_int64
        self.version = self._read_version()
        self.index_type = self._read_index_type(package)
        for name in _SIGNATURES:
            self._bind(name)
        self.sparse_guard = OneAtATime(None)
        self.tells_factors = False
        self._superlu: Any = None
        self._superlu_lock = threading.RLock()

    def superlu(self) -> Any:
        """Return the function that makes a sparse linear solver; its library is large and opened when first used."""
        with self._superlu_lock:
            if self._superlu is None:
                try:
                    opened = self._open(_SUPERLU)
                except SundialsMissing:
                    # Where a library does not know where its neighbours are, they have to be there before it.
                    for name in _BELOW_SUPERLU:
                        if name in self._files:
                            ctypes.CDLL(str(self._files[name]), mode=ctypes.RTLD_GLOBAL)
                    opened = self._open(_SUPERLU)
                function = opened.SUNLinSol_SuperLUMT
                function.restype, function.argtypes = _P, [_P, _P, c_int, _P]
                self._superlu = function
                openmp = next((name for name in ("gomp", "omp") if name in self._files), None)
                self.sparse_guard = OneAtATime(self._open(openmp) if openmp else None)
                self.tells_factors = self._try_sparse_solver()
        return self._superlu

    def _try_sparse_solver(self) -> bool:
        """Solve something small; return whether a solver tells if it has factors."""
        context = c_void_p()
        self.SUNContext_Create(0, ctypes.byref(context))
        self.SUNContext_ClearErrHandlers(context)
        numbers = (c_double * 2)()
        vector = self.N_VMake_Serial(2, ctypes.addressof(numbers), context)
        solver = SparseSolver(self, 2, 2, vector, context)
        with self.sparse_guard:
            tells = solver.tells_factors()
            self.SUNLinSolFree(solver.solver)
        self.SUNMatDestroy(solver.matrix)
        self.N_VDestroy(vector)
        self.SUNContext_Free(ctypes.byref(context))
        return tells

    @cached_property
    def has_fixed_solvers(self) -> bool:
        """Whether linear solvers of our own can be made: see `atwood.integrators.ida.linear_solvers`."""
        try:
            table_layout(self)
        except LookupError:
            return False
        return True

    def __getattr__(self, name: str) -> Any:
        # Only so that type checkers know that further attributes exist; what was found is an attribute itself.
        raise AttributeError(f"SUNDIALS' function {name} is not used here")

    def _open(self, name: str) -> ctypes.CDLL:
        if name not in self._opened:
            path = self._files.get(name)
            if path is None:
                raise SundialsMissing(f"{self.folder} has no library {name}")
            try:
                self._opened[name] = ctypes.CDLL(str(path))
            except OSError as error:
                raise SundialsMissing(f"the library {path.name} cannot be opened: {error}") from error
        return self._opened[name]

    def _bind(self, name: str) -> Any:
        """Find a function, give it its C signature and keep it as an attribute."""
        for source in (*_FREE_OF_CHARGE, *_MATRIX_LIBRARIES):
            if source in self._files and hasattr(self._open(source), name):
                function = getattr(self._open(source), name)
                break
        else:
            raise SundialsMissing(f"the SUNDIALS library in {self.folder} has no function {name}")
        result, *arguments = _SIGNATURES[name]
        function.restype = result
        function.argtypes = [self.index_type if argument is _I else argument for argument in arguments]
        setattr(self, name, function)
        return function

    def _allow_folder(self) -> None:
        if sys.platform == "win32":
            self._folder_permission = os.add_dll_directory(str(self.folder))

    def _read_version(self) -> tuple[int, int, int]:
        parts = c_int(), c_int(), c_int()
        label = ctypes.create_string_buffer(64)
        self._bind("SUNDIALSGetVersionNumber")(*(ctypes.byref(part) for part in parts), label, len(label))
        version = (parts[0].value, parts[1].value, parts[2].value)
        if version[0] < OLDEST:
            found = ".".join(map(str, version))
            raise SundialsMissing(f"SUNDIALS {OLDEST} or newer is needed, and {self.folder} has {found}")
        return version

    def _read_index_type(self, package: Path) -> type[c_int32] | type[c_int64]:
        """Return the type of indices that the library was built with, as it says and as it does."""
        settings = build_settings(package)
        number_type = settings.get("SUNDIALS_FLOAT_TYPE", "double")
        if number_type != "double":
            raise SundialsMissing(f"SUNDIALS was built for numbers of type {number_type}, not double")
        found = self._measure_index_width()
        said = settings.get("SUNDIALS_INT_TYPE")
        if said is not None and 8 * INDEX_BYTES.get(said, found // 8) != found:
            raise SundialsMissing(f"SUNDIALS' indices have {found} bits, but scikit-sundae says {said!r}")
        return c_int32 if found == 32 else c_int64

    def _measure_index_width(self) -> int:
        """Return the width of an index in bits, from the column starts 0, 1, 2 of a sparse unit matrix.

        Arguments are handed over as 64 bits; where fewer are wanted the others are ignored.
        """
        for name in ("SUNContext_Create", "SUNContext_Free", "SUNDenseMatrix", "SUNDenseMatrix_Data", "SUNMatDestroy",
                     "SUNSparseFromDenseMatrix", "SUNSparseMatrix_IndexPointers"):  # fmt: skip
            self._bind(name)
        context = c_void_p()
        if self.SUNContext_Create(0, ctypes.byref(context)) != 0:
            raise SundialsMissing("SUNDIALS cannot be set up")
        dense = self.SUNDenseMatrix(2, 2, context)
        numbers = (c_double * 4).from_address(self.SUNDenseMatrix_Data(dense))
        numbers[:] = [1.0, 0.0, 0.0, 1.0]
        sparse = self.SUNSparseFromDenseMatrix(dense, 0.0, BY_COLUMNS)
        starts = (c_int32 * 3).from_address(self.SUNSparseMatrix_IndexPointers(sparse))
        width = {(0, 1, 2): 32, (0, 0, 1): 64}.get((starts[0], starts[1], starts[2]))
        self.SUNMatDestroy(sparse)
        self.SUNMatDestroy(dense)
        self.SUNContext_Free(ctypes.byref(context))
        if width is None:
            raise SundialsMissing("the width of SUNDIALS' indices is neither 32 nor 64 bits")
        return width


def _package_folder() -> Path:
    """Return scikit-sundae's folder without importing it."""
    try:
        spec = importlib.util.find_spec("sksundae")
    except (ImportError, ValueError):
        spec = None
    if spec is None or not spec.submodule_search_locations:
        raise SundialsMissing("scikit-sundae is not installed")
    return Path(next(iter(spec.submodule_search_locations)))


def _library_files(package: Path) -> dict[str, Path]:
    """Return the libraries that belong to a package, by their names without version, hash and ending."""
    beside = package.parent
    # Wheels carry them beside the package (Linux, Windows) or inside it (macOS); conda has one folder for all.
    folders = [
        beside / "scikit_sundae.libs",
        beside / "sksundae.libs",
        package / ".dylibs",
        package / ".libs",
        package,
        Path(sys.prefix) / "lib",
        Path(sys.prefix) / "Library" / "bin",
    ]
    pattern = re.compile(r"^(?:lib)?(?P<name>[A-Za-z_]+)(?:-[0-9A-Za-z]+)*(?:-?[.0-9]+)?" + _ENDINGS)
    for folder in folders:
        if not folder.is_dir():
            continue
        files: dict[str, Path] = {}
        for path in sorted(folder.iterdir()):
            match = pattern.match(path.name)
            if match is not None:
                files.setdefault(match["name"], path)
        if all(name in files for name in _FREE_OF_CHARGE):
            return files
    # Elsewhere they are found by what was linked with them.
    for path in sorted(package.glob("_cy_ida*.so")):
        return dict.fromkeys((*_FREE_OF_CHARGE, *_MATRIX_LIBRARIES, _SUPERLU), path)
    raise SundialsMissing(f"no SUNDIALS libraries were found near {package}")


_lock = threading.Lock()
_found: SundialsLibrary | SundialsMissing | None = None


def library() -> SundialsLibrary:
    """Return the libraries, opened once for the whole process."""
    global _found
    with _lock:
        if _found is None:
            try:
                _found = SundialsLibrary()
            except SundialsMissing as error:
                _found = error
    if isinstance(_found, SundialsMissing):
        raise SundialsMissing(
            f"SUNDIALS IDA cannot be used: {_found.message}",
            advice="Let scikit-sundae be installed as it comes from PyPI or conda-forge, or choose another solver.",
        )
    return _found


def available() -> bool:
    """Tell whether the libraries can be used."""
    return not why_not()


def why_not() -> str:
    """Return why the libraries cannot be used; empty if they can."""
    try:
        library()
    except SundialsMissing as error:
        return str(error)
    return ""
