"""Taylor recurrences of an assembled scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import UnsupportedError, UsageError
from atwood.expr import Expression, Program, live, substitute
from atwood.expr.series.taylor import TaylorPrograms, taylor_programs
from atwood.forms.accelerations import accelerations_of
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.integrators.methods import EXPLICIT, IDA, advise
from atwood.integrators.taylor.stepper import REACH, TaylorProblem

if TYPE_CHECKING:
    from atwood.integrators.taylor.stepper import CompiledRecurrences


_BRANCHES: Key[bool] = Key("whether a branch could be without a value")
_RECURRENCES: Key[TaylorPrograms] = Key("recurrences")
_COMPILED: Key[CompiledRecurrences] = Key("machine code of recurrences")

_LANES = 8


def recurrences(assembly: Assembly) -> TaylorPrograms:
    """Return the recurrences of a scene in the reduced form, with the state (q, u)."""
    found = accelerations_of(assembly)
    if found is None or not len(assembly.reduced.coordinates):
        raise UsageError(
            "the Taylor-series method needs accelerations as formulas, and a scene in which something can move",
            where=assembly.flat.name,
            advice=advise(IDA),
        )
    return recurrences_of(assembly, found.program)


def recurrences_of(assembly: Assembly, found: Program) -> TaylorPrograms:
    """Return the recurrences of accelerations of a scene; errors as for `recurrences`."""
    is_partial = assembly.shared.get(_BRANCHES, lambda: _has_partial_branch(assembly, found), found)
    chosen = assembly.known_relations if is_partial else {}
    return assembly.shared.get(_RECURRENCES, lambda: _make(found, chosen), found, tuple(chosen.values()))


_PARTIAL = frozenset({"sqrt", "log", "pow", "asin", "acos", "tan", "atan2", "div"})
"""Operations that have no value, or no series, somewhere."""


def _has_partial_branch(assembly: Assembly, found: Program) -> bool:
    """Return whether a branch that a relation of functions of time leaves out could be without a value.

    A series is of all that there is, whatever is chosen of it. Then each piece has recurrences of its own, in which
    there is only what acts.
    """
    symbols = {one.symbol for one in assembly.relations}
    nodes = found.nodes if symbols else ()
    branches = [
        one
        for node in nodes
        if node.operation == "select" and node.arguments[0] in symbols
        for one in node.arguments[1:]
    ]
    return any(node.operation in _PARTIAL and not node.is_parametric for node in live(branches))


def _make(program: Program, chosen: Mapping[Expression, float]) -> TaylorPrograms:
    (time,), q, u = (group.symbols for group in program.inputs)
    results = substitute(program.results, chosen)
    rates = u if len(program.outputs) == 1 else ()  # else the program gives them
    try:
        return taylor_programs(program.name, time, [*q, *u], [*rates, *results], program.parameters, _LANES)
    except UnsupportedError as error:
        error.advice = advise(EXPLICIT, IDA)
        raise


def taylor_problem(
    assembly: Assembly,
    stop_time: float = inf,
    has_events: bool = False,
    found: Program | None = None,
    values: FloatArray | None = None,
) -> TaylorProblem:
    """Return what the Taylor-series method is given of a scene; errors as for `recurrences`."""
    programs = recurrences(assembly) if found is None else recurrences_of(assembly, found)
    parameters = np.asarray(assembly.parameter_values if values is None else values, dtype=np.float64)
    return TaylorProblem(
        programs=programs,
        parameters=parameters,
        stop_time=stop_time,
        reach=REACH if has_events else inf,
        compiled=_compiled(assembly, programs, parameters),
        wide=lambda runs: _code(assembly, programs, runs),
    )


def _compiled(
    assembly: Assembly, programs: TaylorPrograms, values: FloatArray
) -> Callable[[], tuple[CompiledRecurrences, FloatArray]]:
    """Return what gives the machine code, made when it is first asked for."""

    @cache
    def bound() -> tuple[CompiledRecurrences, FloatArray]:
        code = _code(assembly, programs, 1)
        return code, code.bind(values)

    return bound


def _code(assembly: Assembly, programs: TaylorPrograms, runs: int) -> CompiledRecurrences:
    """Return recurrences as machine code for so many runs side by side."""
    from atwood.integrators.taylor.stepper import CompiledRecurrences

    return assembly.shared.get(_COMPILED, lambda: CompiledRecurrences(programs, runs), programs, runs)
