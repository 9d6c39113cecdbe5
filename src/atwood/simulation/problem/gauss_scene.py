"""From an assembled scene to a run with a symplectic method of Gauss, in coordinates and momenta."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from atwood.codegen import BoundKernel
from atwood.errors import UnsupportedError, UsageError
from atwood.forms.assembly import Assembly
from atwood.forms.canonical import CanonicalPrograms, canonical_programs, closed_canonical_programs, separable_programs
from atwood.forms.kept import Key
from atwood.integrators.composition.coefficients import ORDERS as COMPOSITIONS
from atwood.integrators.composition.native import CompiledComposition
from atwood.integrators.explicit_problem import ExplicitProblem
from atwood.integrators.explicit_session import ExplicitSession
from atwood.integrators.gauss.native import CompiledGauss, CompiledMethod, GaussStepper
from atwood.integrators.protocol import Budget, FloatArray, SolverOptions
from atwood.late import dataclass
from atwood.simulation.problem.closed_loops import Solved

__all__ = ["ORDER", "GaussSettings", "open_gauss"]

ORDER = 8
"""The order unless another one is asked for: it costs least at most tolerances."""

_COMPILED: Key[CompiledMethod] = Key("compiled symplectic method")


Momenta: TypeAlias = Callable[[float, FloatArray, FloatArray], FloatArray]


def momenta_of(found: CanonicalPrograms, kernel: BoundKernel) -> Momenta:
    """Return the function that gives the momenta of the coordinates at (t, q, u).

    Where there are more coordinates than speeds, they are those of least size: the others are constants of the motion
    that nothing depends on.

    Parameters
    ----------
    found
        Hamilton's equations.
    kernel
        Its program of the momenta, with values of the parameters.
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


def _compile(assembly: Assembly, programs: CanonicalPrograms, speeds: int, solver: str, order: int) -> CompiledMethod:
    """Return a method as machine code."""
    name = assembly.flat.name
    if solver == "gauss":
        return CompiledGauss(programs.equations, speeds, order)
    if order not in COMPOSITIONS:
        raise UsageError(
            f"there is no composition of order {order}",
            where=name,
            advice=f"Give one of {', '.join(map(str, COMPOSITIONS))}, or the solver 'gauss'.",
        )
    found = None if assembly.reduced.constraints else separable_programs(assembly)
    if found is None:
        raise UnsupportedError(
            "its H is no sum of a function of momenta and one of coordinates, so that its steps cannot be split",
            where=name,
            advice="Use the solver 'gauss', which is symplectic for any H.",
        )
    return CompiledComposition(found.forces, found.velocities, order)


@dataclass(frozen=True, eq=False)
class GaussSettings:
    """What a run with a method of Gauss is given beside its accuracy.

    Attributes
    ----------
    solver
        ``"gauss"`` or ``"composition"``.
    order
        2, 4, 6, 8, and of the methods of Gauss 10 or 12; `ORDER` if None.
    step
        The step, s; chosen by the accuracy if None.
    end
        The time of the end, s.
    sizes
        How large (q, u) are in the scene.
    """

    solver: str
    order: int | None
    step: float | None
    end: float
    sizes: FloatArray


def open_gauss(
    assembly: Assembly,
    problem: ExplicitProblem,
    options: SolverOptions,
    settings: GaussSettings,
    t: float,
    y: FloatArray,
    budget: Budget | None = None,
    solved: Solved | None = None,
) -> ExplicitSession:
    """Start a run with a method of Gauss, or a composition.

    Parameters
    ----------
    assembly
        The scene, in the reduced form.
    problem
        The same for explicit methods, of which events and the rates at outputs are read.
    options
        Accuracy, by which a step is chosen where none is given.
    settings
        The method.
    t, y
        Start values, (q, u).
    budget
        Limits of the session.
    solved
        Its closed loops, solved by formulas; (q, u) are then the independent ones.

    Raises
    ------
    UnsupportedError
        If the scene is no Hamiltonian system, or for a composition one that is not separable.
    """
    programs = canonical_programs(assembly) if solved is None else closed_canonical_programs(assembly, solved.form)
    if problem.compiled is None:
        what = "its laws call functions in Python, which symplectic methods cannot"
        raise UsageError(what, where=assembly.flat.name, advice="Use the solver 'ida'.")
    order, solver = settings.order or ORDER, settings.solver
    speeds = len(assembly.reduced.speeds) if solved is None else len(solved.independent)
    compiled = assembly.shared.get(
        _COMPILED, lambda: _compile(assembly, programs, speeds, solver, order), programs, solver, order
    )
    values = np.asarray(assembly.parameter_values, dtype=float) if solved is None else solved.values
    kernel = assembly.kernel(programs.momenta) if solved is None else solved.kernel(programs.momenta)
    momenta = momenta_of(programs, kernel)
    sizes = _canonical_sizes(momenta, t, y, len(y) - speeds, settings.sizes)
    stepper = GaussStepper(compiled, values, momenta, problem.compiled(), settings.step or 1.0, sizes, problem.guard)
    if settings.step is None:
        absolute = np.broadcast_to(np.asarray(options.absolute_tolerances, dtype=float), y.shape)
        longest = stepper.find_step(t, y, settings.end, absolute, options.relative_tolerance)
        if options.max_step is not None and options.max_step < longest:
            stepper.take_step(options.max_step)
        stepper.vary_step()
    return ExplicitSession(problem, options, stepper, t, y, budget, end=settings.end)
