"""Derivatives of quantities along a motion whose states have derivatives."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import UnsupportedError
from atwood.expr import Expression, Program, jvp, read_by, substitute
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.event_program import event_program
from atwood.forms.program import state_groups
from atwood.forms.quantities import coordinate_program, find_observables
from atwood.simulation.dynamics.balance import balance_of
from atwood.simulation.dynamics.redundancy import find_rank
from atwood.simulation.dynamics.scales import motion_scales, scene_length
from atwood.simulation.problem.problem import SceneProblem

_WRITTEN: Key[tuple[Expression, ...]] = Key("quantities as functions of the state")
_DERIVED: Key[Program] = Key("quantities with their derivatives along a direction")


def written(plan: SceneProblem, paths: tuple[str, ...], t: float, y: FloatArray) -> tuple[Expression, ...]:
    """Return quantities as expressions of time, coordinates and speeds, with forces and accelerations solved for."""
    assembly = plan.assembly
    wanted = [one.value for one in find_observables(assembly, paths)]
    reads = bool(read_by(wanted, [one.symbol for one in assembly.reactions]))
    kept, maximal = tuple(plan.finding.kept), _kept_in_maximal(assembly, plan, t, y) if reads else ()

    def make() -> tuple[Expression, ...]:
        program = event_program(assembly, wanted, kept, maximal)
        if program is None:
            raise UnsupportedError(
                "a reaction among the quantities is not determined by the state alone, or would take too many formulas",
                where=", ".join(paths),
                advice="Leave reactions out, or free the scene of redundant constraints.",
            )
        shifts = dict.fromkeys(program.inputs[-1].symbols, 0.0)
        return tuple(map(assembly.own_equations.graph.convert, substitute(list(program.results), shifts)))

    return assembly.shared.get(_WRITTEN, make, paths, kept, maximal)


def _kept_in_maximal(assembly: Assembly, plan: SceneProblem, t: float, y: FloatArray) -> tuple[int, ...]:
    """Return the constraints in maximal coordinates that are independent."""
    if assembly.form == "dae":
        return tuple(plan.finding.kept)
    from atwood.simulation.dynamics.reactions import maximal_state

    q, u = plan.program.split(y)
    big, _ = maximal_state(assembly, np.array([t]), q[:, None], u[:, None])
    sizes = motion_scales(assembly.maximal, scene_length(assembly))
    return tuple(find_rank(balance_of(assembly, "dae"), t, big[:, 0], sizes).kept)


def derived(assembly: Assembly, expressions: tuple[Expression, ...]) -> Program:
    """Return the program of (t, q, u, dt, dq, du, dp) with expressions and their derivatives along a direction."""

    def make() -> Program:
        groups = state_groups(assembly.own_equations)
        graph = assembly.own_equations.graph
        symbols = (*(one.symbols for one in groups), assembly.parameters)
        along = [tuple(graph.symbol(f"along {s.name}") for s in some) for some in symbols]
        tangents: dict[Expression, Expression | float] = {}
        for some, moved in zip(symbols, along, strict=True):
            tangents.update(zip(some, moved, strict=True))
        own = {"values": expressions, "derivatives": jvp(expressions, tangents)}
        more = dict(zip(("dt", "dq", "du", "dp"), along, strict=True))
        return coordinate_program(assembly, "derivatives of quantities", assembly.own_equations, own, **more)

    return assembly.shared.get(_DERIVED, make, expressions)


def derivatives(
    assembly: Assembly,
    expressions: Sequence[Expression],
    times: FloatArray,
    states: FloatArray,
    columns: FloatArray,
    seeds: FloatArray,
    passing: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Return values and derivatives of expressions at many states.

    Parameters
    ----------
    assembly, expressions
        The scene in its mode, and expressions of its state.
    times, states, columns
        Shapes (times,), (times, n) and (times, columns, n).
    seeds
        The change of each parameter by each column, shape (columns, parameters).
    passing
        The change of time by each column, s; none when not given.

    Returns
    -------
    values, derivatives
        Shapes (expressions, times) and (expressions, columns, times).
    """
    kernel = assembly.kernel(derived(assembly, tuple(expressions)), vectorized=True)
    n, count = len(assembly.own_equations.coordinates), columns.shape[1]
    steps, total = len(times), len(times) * count
    if not total:
        return np.empty((len(expressions), steps)), np.empty((len(expressions), 0, steps))
    # One column after the other, each with all times.
    q, u = np.tile(states[:, :n].T, count), np.tile(states[:, n:].T, count)
    along = np.moveaxis(columns, 2, 0).transpose(0, 2, 1).reshape(-1, total)
    dt = np.repeat(np.zeros(count) if passing is None else passing, steps)[None, :]
    dp = np.repeat(seeds.T, steps, axis=1)
    made = kernel(np.tile(times, count)[None, :], q, u, dt, along[:n], along[n:], dp)
    values, found = (np.broadcast_to(one, (len(expressions), total)) for one in made)
    return values[:, :steps], found.reshape(len(expressions), count, steps)
