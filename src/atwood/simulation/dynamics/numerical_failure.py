"""Why linear algebra or arithmetic gives up on the numbers of a scene: when, in which component, law or input.

A matrix whose singular values do not come out, a division by what has become zero: libraries raise their own errors,
which know nothing of mechanisms. There is one door for them in a run, and one where its start is looked for. A solver
only sees that a residual or a rate is not a number. So the laws of all components are evaluated by themselves, at the
last good state and a little ahead of it, and the first that has no value is named.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from math import isfinite

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, SolveError
from atwood.expr import Expression, Program, evaluate, live, vjp
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.program import state_groups
from atwood.forms.quantities import coordinate_program
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.build import resolve_signals
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.dynamics.forces import place_part
from atwood.model.declare.component import bind
from atwood.model.declare.law_results import CoordinateLoad, Load
from atwood.model.declare.laws import scalars
from atwood.model.local.parts import LocalPart
from atwood.simulation.dynamics.balance import Balance, balance_of
from atwood.simulation.dynamics.scales import motion_names, motion_scales, scene_length

_OURS = ("atwood", "numpy", "scipy")
"""Errors of anything else, such as what a person is called back with, are for whoever wrote it."""

_MISSED = 1e-6
"""Relative to the scene's size: a constraint that is missed by more contradicts the others."""


def is_numerical(error: Exception) -> bool:
    """Return whether an error says that numbers cannot be worked with, and comes from where they are."""
    if isinstance(error, np.linalg.LinAlgError):
        return True
    if isinstance(error, AtwoodError) or not isinstance(error, (ValueError, ArithmeticError)):
        return False
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    room = "" if trace is None else str(trace.tb_frame.f_globals.get("__name__", "")).partition(".")[0]
    # A ValueError that is no matter of numbers is raised here, or inside NumPy without a frame of its own.
    return room in (_OURS if isinstance(error, ArithmeticError) else _OURS[1:])


def numerical_failure(assembly: Assembly, t: float, q: FloatArray, u: FloatArray, error: Exception) -> SolveError:
    """Return the error of a scene whose numbers could not be worked with, with what is to blame as far as it shows.

    That is a law without a value, else the constraint that is missed most, else what moves fastest.
    """
    said = f"at t = {t:.6g} its numbers could not be worked with ({error})"
    missing = undefined_value_at(assembly, t, q, u)
    if missing is not None:
        return SolveError(
            f"{missing.describe()}, so that nothing can be worked out there",
            where=missing.part,
            advice="A law is evaluated where it has no value: look at its formula, and at what the scene does before.",
        )
    equations = assembly.own_equations
    balance, sizes = balance_of(assembly, assembly.form), motion_scales(equations, scene_length(assembly))
    with np.errstate(all="ignore"):
        contradicts = _most_missed(equations, balance, t, q, sizes)
        if contradicts is not None:
            label, part, miss = contradicts
            return SolveError(
                f"{said}: {label} is missed there by {miss:.3g} of the scene's size",
                where=part,
                advice="Constraints, drives or lengths contradict each other, or differ too much in size.",
            )
        speed = np.abs(u) / sizes
    fastest = int(np.argmax(np.where(np.isfinite(speed), speed, np.inf))) if len(u) else None
    if fastest is None:
        return SolveError(
            said, where=assembly.flat.name, advice="Look at the sizes of masses, lengths and stiffnesses."
        )
    name, unit = motion_names(equations)[fastest], equations.speed_names[fastest].unit
    return SolveError(
        f"{said}; what moves fastest there is {name}, at {u[fastest]:.3g} {unit}",
        where=name.rpartition(".")[0] or assembly.flat.name,
        advice=f"Look at what acts on {name}, and at masses and lengths that differ by many powers of ten.",
    )


def _most_missed(
    equations: Equations, balance: Balance, t: float, q: FloatArray, sizes: FloatArray
) -> tuple[str, str, float] | None:
    """Return label and part of the constraint on positions that is missed most, and by how much; None if all hold."""
    if not balance.constraints:
        return None
    try:
        now = balance.constraints_at(t, q, np.zeros_like(sizes))
        misses = np.abs(now.value / balance.row_scales(now, t, q, sizes))[balance.holonomic]
    except (AtwoodError, ValueError, ArithmeticError):
        return None  # that has no value either, and says nothing about contradictions
    worst = int(np.argmax(misses)) if len(misses) and np.isfinite(misses).all() else None
    if worst is None or not misses[worst] > _MISSED:
        return None
    one = equations.constraints[int(balance.holonomic[worst])]
    return one.label, one.key[0], float(misses[worst])


class named:
    """Turns the errors of libraries in a ``with`` block into those of a scene at a state; see `numerical_failure`."""

    def __init__(self, assembly: Assembly, t: float, q: FloatArray, u: FloatArray) -> None:
        self._state = assembly, t, q, u

    def __enter__(self) -> None:
        return

    def __exit__(self, _: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, (ValueError, ArithmeticError)) and is_numerical(error):
            raise numerical_failure(*self._state, error) from error


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
    """Return a state and others ahead of it, nearer ones first: times, coordinates and speeds."""
    h = np.concatenate([[0.0], horizon * np.geomspace(1e-16, _FARTHEST, 97)])
    with np.errstate(all="ignore"):
        q_rate, a = (np.where(np.isfinite(one), one, 0.0)[:, None] for one in rates)
        q, u = (one[:, None] for one in state)
        # A parabola where coordinates are integrals of the speeds; orientations go straight ahead.
        bent = 0.5 * h * h * a if len(q) == len(u) else 0.0
        return t + h, q + h * q_rate + bent, u + h * a


def find_undefined_value(assembly: Assembly, t: FloatArray, q: FloatArray, u: FloatArray) -> UndefinedValue | None:
    """Return the first law or input of a component that has no value at the first of some states where one has none."""
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
        part = place_part(equations.site, local, equations.kinematics, signals)
        for words, values in _quantities(local, assembly.modes.get(path, "")):
            placed = part.put(values)
            for value in placed:
                if all(node in known for node in live([value]) if node.is_symbol):
                    quantities.append(_Quantity(path, words))
                    expressions.append(value)
    for symbol, value in equations.read.items():
        path, _, law = symbol.name.removeprefix("read:").removeprefix("lambda:").partition("[")[0].rpartition(".")
        why = "no reaction agrees with the forces that it causes, as where friction jams or is without bounds"
        quantities.append(_Quantity(path, f"the reaction of the law {law!r}, which a force reads,", why))
        expressions.append(value)
    return quantities, coordinate_program(assembly, "laws", equations, expressions)


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
