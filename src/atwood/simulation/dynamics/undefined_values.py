"""What has no value where a run cannot go on: the component, its law or input, and why.

A solver only sees that a residual or a rate is not a number. So the laws of all components are evaluated by themselves,
at the last good state and a little ahead of it, and the first that has no value is named.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from math import isfinite

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Expression, OutputGroup, Program, evaluate, live, substitute, vjp
from atwood.forms.assembly import Assembly
from atwood.forms.kept import Key
from atwood.forms.program import state_groups
from atwood.late import dataclass
from atwood.mechanics.build import resolve_signals
from atwood.mechanics.dynamics.forces import local_map
from atwood.model.declare.component import bind
from atwood.model.declare.contributions import CoordinateLoad, Load
from atwood.model.declare.law import scalars
from atwood.model.local.parts import LocalPart

__all__ = ["ADVICE_AT_START", "UndefinedValue", "find_undefined_value", "states_ahead", "undefined_value_at"]

ADVICE_AT_START = (
    "Do two points coincide that a spring, damper or rope joins, or do two axes point against each other between which "
    "an angle is measured? Give start positions that part them; or look at the formula of the law."
)
"""What to do where a law has no value at the start."""

_FARTHEST = 1e-4
"""So much of a run is looked ahead: where steps get too small, what stops them is near."""


@dataclass(frozen=True)
class UndefinedValue:
    """Something that has no value.

    Attributes
    ----------
    time
        When, s.
    part
        Path of the component.
    quantity
        What of it, in words.
    reason
        Why, in words; empty if that is not known.
    """

    time: float
    part: str
    quantity: str
    reason: str

    def describe(self) -> str:
        """Return what is missing and when, without the component."""
        why = f" ({self.reason})" if self.reason else ""
        return f"at t = {self.time:.9g} {self.quantity} has no value{why}"


@dataclass(frozen=True)
class _Quantity:
    part: str
    words: str
    why: str = ""


def states_ahead(
    t: float, state: tuple[FloatArray, FloatArray], rates: tuple[FloatArray, FloatArray], horizon: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return a state and others ahead of it, nearer ones first: times, coordinates and speeds.

    Parameters
    ----------
    t
        Time, s.
    state, rates
        Coordinates and speeds, and their derivatives.
    horizon
        Length of the run, s.
    """
    h = np.concatenate([[0.0], horizon * np.geomspace(1e-16, _FARTHEST, 97)])
    with np.errstate(all="ignore"):
        q_rate, a = (np.where(np.isfinite(one), one, 0.0)[:, None] for one in rates)
        q, u = (one[:, None] for one in state)
        # A parabola where coordinates are integrals of the speeds; orientations go straight ahead.
        bent = 0.5 * h * h * a if len(q) == len(u) else 0.0
        return t + h, q + h * q_rate + bent, u + h * a


def find_undefined_value(assembly: Assembly, t: FloatArray, q: FloatArray, u: FloatArray) -> UndefinedValue | None:
    """Return the first law or input of a component that has no value at the first of some states where one has none.

    Parameters
    ----------
    assembly
        The scene in its mode.
    t, q, u
        States in the coordinates of the form, shape (states,) and (number, states).
    """
    quantities, program = assembly.shared.get(_LAW_VALUES, lambda: _law_values(assembly))
    if not quantities:
        return None
    with np.errstate(all="ignore"):
        values = assembly.kernel(program, vectorized=True)(t[None, :], q, u)[0]
    missing = ~np.isfinite(values)
    places = np.flatnonzero(missing.any(axis=0))
    if not len(places):
        return None
    i = int(places[0])
    row = int(np.argmax(missing[:, i]))
    reason = quantities[row].why or _reason(assembly, program, row, (float(t[i]), q[:, i], u[:, i]))
    return UndefinedValue(float(t[i]), quantities[row].part, quantities[row].words, reason)


def undefined_value_at(assembly: Assembly, t: float, q: FloatArray, u: FloatArray) -> UndefinedValue | None:
    """Return the same for one state."""
    return find_undefined_value(assembly, np.array([t]), q[:, None], u[:, None])


_LAW_VALUES: Key[tuple[list[_Quantity], Program]] = Key("values of laws")


def _law_values(assembly: Assembly) -> tuple[list[_Quantity], Program]:
    """Return every law and input of every component as a program of (t, q, u)."""
    equations, mechanism = assembly.own_equations, assembly.mechanism
    # Laws that read reactions are looked at by themselves first, with any value of these.
    some = dict.fromkeys(equations.read, equations.graph.one)
    signals = resolve_signals(mechanism, equations.site, equations.kinematics, some)
    quantities: list[_Quantity] = []
    expressions: list[Expression] = []
    known = {*assembly.parameters, *(s for group in state_groups(equations) for s in group.symbols)}
    for path, local in mechanism.locals_.items():
        mapping = {**local_map(equations.site, local, equations.kinematics), **signals}
        for words, values in _quantities(local, assembly.modes.get(path, "")):
            placed = substitute(values, mapping)
            for value in placed:
                if all(node in known for node in live([value]) if node.is_symbol):
                    quantities.append(_Quantity(path, words))
                    expressions.append(value)
    for symbol, value in equations.read.items():
        path, _, law = symbol.name.removeprefix("lambda:").partition("[")[0].rpartition(".")
        why = "no reaction agrees with the forces that it causes, as where friction jams or is without bounds"
        quantities.append(_Quantity(path, f"the reaction of the law {law!r}, which a force reads,", why))
        expressions.append(value)
    outputs = (OutputGroup("laws", tuple(expressions)),)
    return quantities, Program(f"{assembly.flat.name} laws", state_groups(equations), assembly.parameters, outputs)


def _quantities(local: LocalPart, mode: str) -> Iterator[tuple[str, list[Expression]]]:
    """Yield what a part computes, on its local symbols: what others are made of first."""
    for name in local.part.signals:
        value = local.binding.values[name]
        if isinstance(value, Expression):
            yield f"the input {name!r}", [value]
    component = local.part.component
    bound = bind(component, local.binding)
    for kind in ("potential", "dissipation", "force", "constraint", "derivative"):
        for law in component.laws(kind):
            if not (law.holds_in(local.binding.space) and law.acts_in(mode or (component.modes or ("",))[0])):
                continue
            made = getattr(bound, law.name)()
            values = _loads(made) if kind == "force" else [*scalars(made)]
            found = [value for value in values if isinstance(value, Expression)]
            if found:
                yield f"the law {law.name!r}", found
            if found and kind not in ("force", "derivative"):
                yield f"the force of the law {law.name!r}", _slopes(local, found, kind == "dissipation")


def _loads(made: Iterable[Load | CoordinateLoad]) -> list[object]:
    return [
        value
        for load in made  # once, since laws may yield them
        for value in ((load.value,) if isinstance(load, CoordinateLoad) else load.components)
    ]


def _slopes(local: LocalPart, values: list[Expression], of_velocities: bool) -> list[Expression]:
    """Return the derivatives of values with respect to what the connectors know."""
    wanted: list[Expression] = []
    for one in local.connectors.values():
        wanted += one.velocity if of_velocities else one.position
        angle = one.angular_speed if of_velocities else one.angle
        wanted += [angle] if angle is not None else []
    one_each = values[0].graph.constant(1.0)
    return [constraint_jacobian for value in values for constraint_jacobian in vjp([value], [one_each], wanted)]


def _reason(assembly: Assembly, program: Program, row: int, state: tuple[float, FloatArray, FloatArray]) -> str:
    """Return which operation has no value though its arguments have one."""
    t, q, u = state
    values: dict[Expression, float] = dict(zip(program.parameters, assembly.parameter_values.tolist(), strict=True))
    for group, numbers in zip(program.inputs, ([t], q.tolist(), u.tolist()), strict=True):
        values.update(zip(group.symbols, numbers, strict=True))
    known: dict[int, float] = {}
    for node in live([program.results[row]]):
        if node.operation == "solve":
            continue
        try:
            value = evaluate([node], values)[0]
        except Exception as error:  # whatever a function in Python can raise
            return f"the function {node.payload.name!r} raises {type(error).__name__}: {error}"
        known[node.index] = value
        if not isfinite(value):
            given = [known.get(one.index, float("nan")) for one in node.arguments]
            return _in_words(node, given, value)
    return ""


def _in_words(node: Expression, given: Sequence[float], value: float) -> str:
    numbers = [f"{one:.4g}" for one in given]
    match node.operation:
        case "div":
            return f"{numbers[0]} divided by {numbers[1]}"
        case "pow":
            return f"{numbers[0]} to the power of {numbers[1]}"
        case "sqrt":
            return f"the square root of {numbers[0]}"
        case "log":
            return f"the logarithm of {numbers[0]}"
        case "external":
            return f"the function {node.payload.name!r} of {', '.join(numbers)} returns {value:g}"
        case "symbol" | "constant":
            return f"{node!r} is {value:g}"
    return f"{node.operation} of {' and '.join(numbers)} is {value:g}"
