"""From an assembled scene to the problem that an explicit method solves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import TYPE_CHECKING

from atwood.arrays import FloatArray
from atwood.codegen import BoundKernel
from atwood.forms.accelerations import AccelerationProgram, accelerations_of
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.integrators.explicit_problem import CompiledRates, ExplicitProblem
from atwood.integrators.protocol import Values

if TYPE_CHECKING:
    from atwood.integrators.embedded.rates import CompiledAccelerations, OwnRates


_EXTERNAL: Key[bool] = Key("whether accelerations call functions in Python")
_COMPILED: Key[CompiledAccelerations] = Key("machine code of accelerations")


def explicit_problem(
    assembly: Assembly,
    events: Callable[[float, FloatArray, FloatArray], Values] | None = None,
    directions: tuple[int, ...] = (),
    found: AccelerationProgram | None = None,
) -> ExplicitProblem | None:
    """Return the equations of a scene in the reduced form for an explicit method, with ``y = (q, u)``."""
    program = found or accelerations_of(assembly)
    if program is None or len(assembly.reduced.coordinates) == 0:
        return None
    return explicit_problem_of(assembly, program, assembly.parameter_values, events, directions)


def explicit_problem_of(
    assembly: Assembly,
    program: AccelerationProgram,
    values: FloatArray,
    events: Callable[[float, FloatArray, FloatArray], Values] | None = None,
    directions: tuple[int, ...] = (),
) -> ExplicitProblem:
    """Return what an explicit method is given of accelerations."""
    _, n, m = (len(group.symbols) for group in program.program.inputs)
    kernel = assembly.compiled(program.program).bind(values)

    return ExplicitProblem(
        size=n + m,
        rates=first_order(kernel, n),
        events=events,
        event_count=len(directions),
        event_directions=directions,
        compiled=_compiled(assembly, program, values),
    )


def first_order(kernel: BoundKernel, coordinates: int) -> Callable[[float, FloatArray], Sequence[float]]:
    """Return the rates of ``y = (q, u)`` from a kernel of accelerations, or of (q', u') where q' is not u."""

    def rates(t: float, y: FloatArray) -> Sequence[float]:
        u = y[coordinates:]
        found = kernel([t], y[:coordinates], u)
        return [*(u if len(found) == 1 else found[0]), *found[-1]]

    return rates


def compiled_rates(assembly: Assembly, found: AccelerationProgram) -> CompiledAccelerations:
    """Return the accelerations of a scene as machine code, for any parameter values."""
    from atwood.integrators.embedded.rates import CompiledAccelerations

    return assembly.shared.get(_COMPILED, lambda: CompiledAccelerations(found.program), found)


def _compiled(assembly: Assembly, found: AccelerationProgram, values: FloatArray) -> Callable[[], CompiledRates] | None:
    """Return what gives each session compiled rates, made when they are first asked for; None if they cannot be."""
    if not _compiles(assembly, found):
        return None

    @cache
    def bound() -> Callable[[], CompiledRates]:
        return compiled_rates(assembly, found).bind(values)

    return lambda: bound()()


def own_rates(assembly: Assembly) -> tuple[CompiledAccelerations, OwnRates] | None:
    """Return the accelerations of a scene as machine code, and rates with its parameters, for which others can be set.

    None where they cannot be compiled, and where the scene is not one for explicit methods.
    """
    found = accelerations_of(assembly)
    if found is None or not _compiles(assembly, found):
        return None
    code = compiled_rates(assembly, found)
    rates = code.open()
    code.fill(rates, assembly.parameter_values)
    return code, rates


def _compiles(assembly: Assembly, found: AccelerationProgram) -> bool:
    """Return whether accelerations can be machine code: they call nothing in Python."""
    nodes = found.program.nodes
    return not assembly.shared.get(_EXTERNAL, lambda: any(node.operation == "external" for node in nodes), found)
