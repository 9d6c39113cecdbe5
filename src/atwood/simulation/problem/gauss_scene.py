"""From an assembled scene to a run with a symplectic method of Gauss, in coordinates and momenta."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from atwood.errors import UsageError
from atwood.forms.assembly import Assembly
from atwood.forms.canonical import CanonicalPrograms, canonical_programs
from atwood.forms.kept import Key
from atwood.integrators.explicit_problem import ExplicitProblem
from atwood.integrators.explicit_session import ExplicitSession
from atwood.integrators.gauss.native import CompiledGauss, GaussStepper
from atwood.integrators.protocol import Budget, FloatArray, SolverOptions
from atwood.late import dataclass

__all__ = ["ORDER", "GaussSettings", "open_gauss"]

ORDER = 8
"""The order unless another one is asked for: it costs least at most tolerances."""

_COMPILED: Key[CompiledGauss] = Key("compiled method of Gauss")


def momenta_of(assembly: Assembly, found: CanonicalPrograms) -> Callable[[float, FloatArray, FloatArray], FloatArray]:
    """Return the function that gives the momenta of the coordinates at (t, q, u).

    Where there are more coordinates than speeds, they are those of least size: the others are constants of the motion
    that nothing depends on.
    """
    kernel = assembly.kernel(found.momenta)

    def momenta(t: float, q: FloatArray, u: FloatArray) -> FloatArray:
        given = kernel([t], q, u)
        along = np.asarray(given[0], dtype=float)
        if found.plain:
            return along
        slopes = np.asarray(given[1], dtype=float).reshape(len(q), len(u))
        return np.asarray(slopes @ np.linalg.solve(slopes.T @ slopes, along))

    return momenta


def _canonical_sizes(
    momenta: Callable[[float, FloatArray, FloatArray], FloatArray], t: float, y: FloatArray, n: int, sizes: FloatArray
) -> FloatArray:
    """Return the sizes of coordinates and momenta; momenta are as large as speeds of their sizes make them."""
    q, u = y[:n], y[n:]
    here = momenta(t, q, u)
    shifted = [momenta(t, q, u + change) - here for change in 1e-3 * np.diag(sizes[n:])]
    found = 1e3 * np.max(np.abs(shifted), axis=0)
    return np.concatenate([sizes[:n], np.where(found > 0.0, found, np.max(found))])


@dataclass(frozen=True, eq=False)
class GaussSettings:
    """What a run with a method of Gauss is given beside its accuracy.

    Attributes
    ----------
    order
        2, 4, 6, 8, 10 or 12; `ORDER` if None.
    step
        The step, s; chosen by the accuracy if None.
    end
        The time of the end, s.
    sizes
        How large (q, u) are in the scene.
    """

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
) -> ExplicitSession:
    """Start a run with a method of Gauss.

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

    Raises
    ------
    UnsupportedError
        If the scene is no Hamiltonian system.
    """
    programs = canonical_programs(assembly)
    if problem.compiled is None:
        what = "its laws call functions in Python, which the methods of Gauss cannot"
        raise UsageError(what, where=assembly.flat.name, advice="Use the solver 'ida'.")
    order, speeds = settings.order or ORDER, len(assembly.reduced.speeds)
    compiled = assembly.shared.get(_COMPILED, lambda: CompiledGauss(programs.equations, speeds, order), order)
    values, momenta = np.asarray(assembly.parameter_values, dtype=float), momenta_of(assembly, programs)
    sizes = _canonical_sizes(momenta, t, y, len(y) - speeds, settings.sizes)
    stepper = GaussStepper(compiled, values, momenta, problem.compiled(), settings.step or 1.0, sizes)
    if settings.step is None:
        absolute = np.broadcast_to(np.asarray(options.absolute_tolerances, dtype=float), y.shape)
        longest = stepper.find_step(t, y, settings.end, absolute, options.relative_tolerance)
        if options.max_step is not None and options.max_step < longest:
            stepper.take_step(options.max_step)
    return ExplicitSession(problem, options, stepper, t, y, budget, end=settings.end)
