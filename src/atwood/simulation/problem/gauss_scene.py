"""Hamilton's equations of an assembled scene, for symplectic methods."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen import BoundKernel
from atwood.errors import UsageError
from atwood.expr import Program
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.canonical import CanonicalPrograms, canonical_programs, closed_canonical_programs, separable_programs
from atwood.integrators.methods import IDA, advise
from atwood.integrators.protocol import ExplicitProblem
from atwood.integrators.symplectic.stepper import CompiledMethod, Hamiltonian
from atwood.simulation.problem.closed_loops import Solved

_COMPILED: Key[CompiledMethod] = Key("compiled symplectic method")


Momenta: TypeAlias = Callable[[float, FloatArray, FloatArray], FloatArray]


def momenta_of(found: CanonicalPrograms, kernel: BoundKernel) -> Momenta:
    """Return the function that gives the momenta of the coordinates at (t, q, u).

    Where there are more coordinates than speeds, they are those of least size: the others are constants of the motion
    that nothing depends on.
    """

    def momenta(t: float, q: FloatArray, u: FloatArray) -> FloatArray:
        given = kernel([t], q, u)
        along = np.asarray(given[0], dtype=float)
        if found.plain:
            return along
        slopes = np.asarray(given[1], dtype=float).reshape(len(q), len(u))
        return np.asarray(slopes @ np.linalg.solve(slopes.T @ slopes, along))

    return momenta


def _canonical_sizes(momenta: Momenta, t: float, y: FloatArray, n: int, sizes: FloatArray) -> FloatArray:
    """Return the sizes of coordinates and momenta; momenta are as large as speeds of their sizes make them."""
    q, u = y[:n], y[n:]
    here = momenta(t, q, u)
    shifted = [momenta(t, q, u + change) - here for change in 1e-3 * np.diag(sizes[n:])]
    found = 1e3 * np.max(np.abs(shifted), axis=0)
    return np.concatenate([sizes[:n], np.where(found > 0.0, found, np.max(found))])


def hamiltonian(
    assembly: Assembly,
    problem: ExplicitProblem,
    start: tuple[float, FloatArray],
    sizes: FloatArray,
    asked: tuple[int | None, float | None],
    solved: Solved | None = None,
) -> Hamiltonian:
    """Return Hamilton's equations of a scene in the reduced form."""
    programs = canonical_programs(assembly) if solved is None else closed_canonical_programs(assembly, solved.form)
    name, (t, y) = assembly.flat.name, start
    if problem.compiled is None:
        what = "its laws call functions in Python, which symplectic methods cannot"
        raise UsageError(what, where=name, advice=advise(IDA))

    def separated() -> tuple[Program, Program] | None:
        found = None if assembly.reduced.constraints else separable_programs(assembly)
        return None if found is None else (found.forces, found.velocities)

    def compiled(make: Callable[[], CompiledMethod], *key: object) -> CompiledMethod:
        return assembly.shared.get(_COMPILED, make, programs, *key)

    speeds = len(assembly.reduced.speeds) if solved is None else len(solved.independent)
    values = np.asarray(assembly.parameter_values, dtype=float) if solved is None else solved.values
    kernel = assembly.kernel(programs.momenta) if solved is None else solved.kernel(programs.momenta)
    momenta = momenta_of(programs, kernel)
    found = _canonical_sizes(momenta, t, y, len(y) - speeds, sizes)
    return Hamiltonian(name, programs.equations, separated, speeds, values, momenta, found, *asked, compiled)
