"""Laws that may act briefly or narrowly, and a program that says whether a step may have passed over what they do.

An exponential, a hyperbolic tangent, a quotient or a high power changes with its argument as fast as that is large: a
hill of a tenth of a metre on a way of many metres, a tap of a millisecond in an hour. A method that takes slopes at a
few moments of a step may see nothing of it. So over each step the arguments of these functions are enclosed between
bounds (`atwood.expr.core.enclosures`), and no argument may change by more than the function's own scale, unless the
function is as good as constant there. What arguments are made of are linear functions, products, sines and cosines of
coordinates and speeds; these lie between the control points of the cubics through their values and rates at both ends.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from math import inf

import numpy as np

from atwood.expr import Expression, InputGroup, OutputGroup, Program, jvp, live, substitute
from atwood.expr.core.enclosures import Pair, enclose, magnitude
from atwood.expr.core.functions import Scalar, absolute, exp, log, maximum, minimum, select, sign, sqrt
from atwood.expr.core.intervals import bounds
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.build import resolve_signals
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.dynamics.forces import in_joint_coordinates, place_part
from atwood.model.local.parts import LocalPart

_CURVED: Key[tuple[Curved, ...]] = Key("functions that may change fast")

_EXTERNAL: Key[tuple[Expression, ...]] = Key("functions in Python in laws")

_FAINT = 60.0
"""An exponential of less than minus this is as good as zero, whatever it is multiplied by."""

_GROWING = frozenset({"exp", "sinh", "cosh"})
"""What grows so fast that a quotient with it as divisor is as good as zero soon."""

_LARGEST = 700.0
"""An exponential of more is no number."""

_FLAT = 20.0
"""Beyond this argument a hyperbolic tangent is one, to rounding."""

_TURN = 3.0
"""No angle that an argument is made of turns farther in a step, rad: its sine is between the control points then."""

_ROOT, _WAVE = 2.0, 4.0
"""A root's argument may change by the exponential of so many reaches, that of a wave by so many, as in steps of fixed
length that are accurate."""

_HIGH = 4.0
"""Powers from here on are curved."""

_ALWAYS = frozenset({"exp", "tanh", "sinh", "cosh", "tan", "atan", "log", "pow"})

_UNESTIMATED = frozenset({"sqrt", "sin", "cos"})
"""Curved, too, where no error is estimated. Estimates see these: they differ on both sides of what is narrow."""


@dataclass(frozen=True)
class Curved:
    """A function in a law that may change fast: its operation, what it is of, and its exponent if it is a power.

    Beyond ``faint`` what grows in divisors alone, as in ``1/(1 + exp(x))``, is as good as infinite. It is an argument,
    or the logarithm of a divisor.
    """

    operation: str
    argument: Expression
    exponent: Expression | None = None
    faint: float = inf


def find_curved(assembly: Assembly, is_estimated: bool = True) -> tuple[Curved, ...]:
    """Return the functions in the laws of a scene that may change fast, in the coordinates and speeds of its form."""
    more = frozenset() if is_estimated else _UNESTIMATED

    def find() -> tuple[Curved, ...]:
        return tuple(_find(assembly, assembly.own_equations, more))

    return assembly.shared.get(_CURVED, find, assembly.form, is_estimated)


def find_external(assembly: Assembly) -> tuple[Expression, ...]:
    """Return the calls of functions in Python that move a scene, in the coordinates and speeds of its form.

    Those that are known to be smooth are none of them.
    """

    def find() -> tuple[Expression, ...]:
        equations = assembly.own_equations
        if "external" not in equations.graph.operations:
            return ()
        nodes = live([*equations.rows, *equations.rates, *(one.second for one in equations.constraints)])
        known = _known(assembly, equations)
        calls = (one for one in nodes if one.operation == "external" and not one.is_parametric)
        called = [one for one in calls if not one.payload.is_smooth]
        return tuple(one for one in called if all(node in known for node in live([one]) if node.is_symbol))

    return assembly.shared.get(_EXTERNAL, find, assembly.form)


def _known(assembly: Assembly, equations: Equations) -> set[Expression]:
    return {equations.time, *equations.coordinates, *equations.speeds, *assembly.parameters}


def _find(assembly: Assembly, equations: Equations, more: frozenset[str]) -> Iterable[Curved]:
    rows = [*equations.rows, *equations.rates, *(one.second for one in equations.constraints)]
    found = dict.fromkeys(_curved_in(rows, _ALWAYS - {"log", "pow", "tan"}))
    kinematics = equations.kinematics
    signals = resolve_signals(assembly.mechanism, equations.site, kinematics)
    for local in equations.locals_.values():
        laws, _ = in_joint_coordinates(local, kinematics, _laws_of(local))
        mine = list(_curved_in([*laws, *signals.values()], _ALWAYS | more | {"div", "mul"}))
        places = [one.value for one in local.constraints]  # where a quotient with a root is a direction
        mine += [one for one in _curved_in(places, _ALWAYS - {"tan"} | {"div", "mul"}) if not _has_root(one.argument)]
        if mine:
            both = [one.argument for one in mine] + [one.exponent or equations.graph.one for one in mine]
            both = substitute(
                place_part(equations.site, local, kinematics, signals).put(both), equations.read
            )  # how reactions are solved for is no law
            if assembly.sides is not None:
                both = assembly.sides.taken_out(both)
            triples = zip(mine, both[: len(mine)], both[len(mine) :], strict=True)
            found |= dict.fromkeys(replace(a, argument=b, exponent=a.exponent and c) for a, b, c in triples)
    known = _known(assembly, equations)
    for one in found:
        nodes = live([one.argument] if one.exponent is None else [one.argument, one.exponent])
        moves = any(node.is_symbol and not node.is_parametric and node not in assembly.parameters for node in nodes)
        calls = any(node.operation == "external" for node in nodes)
        if moves and not calls and all(node in known for node in nodes if node.is_symbol):
            yield one


def _laws_of(local: LocalPart) -> list[Expression]:
    """Return what the laws of a part give; of friction the limit, since where its direction turns is an event."""
    of_contacts = {one.stand_in for one in local.contacts}
    found: list[Scalar] = [*local.potentials, *local.dissipations, *local.lagrangians]
    found += [value for symbol, value in local.stand_ins.items() if symbol not in of_contacts]
    found += [one.limit for one in local.contacts if one.limit is not None]
    found += [c for load in local.loads for c in (*load.force, *load.torque)]
    found += [one.rate for one in local.states]
    return [one for one in found if isinstance(one, Expression)]


def _has_root(value: Expression) -> bool:
    return any(node.operation == "sqrt" for node in live([value]))


def _curved_in(outputs: Sequence[Expression], operations: frozenset[str]) -> Iterable[Curved]:
    if not outputs or operations.isdisjoint(outputs[0].graph.operations):
        return
    nodes = live(outputs)
    faint = _faint(outputs, nodes)
    for node in nodes:
        if node.is_parametric or node.operation not in operations:
            continue
        first = node.arguments[0]
        if node.operation == "pow":
            exponent = node.arguments[1]
            yield Curved("pow", first, exponent)
            if "sqrt" in operations and exponent.operation == "constant" and 0.0 < exponent.value < 1.0:
                yield Curved("sqrt", first)
        elif node.operation == "div":
            over = node.arguments[1]
            if not over.is_parametric and (first.is_parametric or over.operation != "sqrt"):  # else a direction
                ends = [faint[one.index] for one in live([over]) if one.index in faint] if faint else []
                yield Curved("div", over, faint=max(ends, default=inf))
        elif node.operation == "mul":
            base, power = node, 1.0
            while base.operation == "mul" and base.arguments[0] is base.arguments[1]:
                base, power = base.arguments[0], 2.0 * power
            if power > _HIGH:
                yield Curved("pow", base, node.graph.constant(power))
        else:
            yield Curved(node.operation, first, faint=faint.get(node.index, inf))


def _faint(outputs: Sequence[Expression], nodes: Iterable[Expression]) -> dict[int, float]:
    """Return from which arguments on functions that grow in divisors are as good as infinite, by their numbers.

    Numbers beside them, as in ``1e50/(1e50 + exp(x))``, move that; where such a function is no divisor, or of
    parameters alone, it is not known.
    """
    found: dict[int, float] = {}
    if not any(one.operation in _GROWING and not one.is_parametric for one in nodes):
        return found
    for output in outputs:
        within, direct = live([output]), _not_dividing([output])
        growing = [one for one in within if one.operation in _GROWING]
        sizes = [abs(one.value) for one in within if one.is_constant and one.value]
        end = _FAINT + 2.0 * max((abs(math.log(one)) for one in sizes if math.isfinite(one)), default=0.0)
        if end > _LARGEST or any(one.is_parametric or one.index in direct for one in growing):
            end = inf
        found |= {one.index: max(end, found.get(one.index, 0.0)) for one in growing}
    return found


def _not_dividing(outputs: Sequence[Expression]) -> set[int]:
    """Return the numbers of what outputs are made of otherwise than as divisors, or inside these."""
    found: set[int] = set()
    ahead = list(outputs)
    while ahead:
        node = ahead.pop()
        if node.index not in found:
            found.add(node.index)
            ahead += node.arguments[:1] if node.operation == "div" else node.arguments
    return found


# -- how far an argument goes, in units of the function's scale ----------------------------------------------------


def _share(one: Curved, argument: Pair, exponent: Pair | None, reach: Scalar) -> Scalar:
    """Return how far a function changes between bounds of its argument, as a share of how far it may."""
    low, high = argument
    if one.faint < inf:
        low, high = (maximum(minimum(x, one.faint), -one.faint) for x in argument)
    if one.operation == "exp":
        return (maximum(high, -_FAINT) - maximum(low, -_FAINT)) / reach
    if one.operation == "tanh":
        return (maximum(minimum(high, _FLAT), -_FLAT) - maximum(minimum(low, _FLAT), -_FLAT)) / reach
    if one.operation in ("sinh", "cosh"):
        return (high - low) / reach
    if one.operation == "atan":
        return 3.0 * (_steep(high) - _steep(low)) / reach
    if one.operation in ("sin", "cos"):
        return (high - low) / (_WAVE * reach)
    if one.operation == "tan":
        return 3.0 * (high - low) / reach
    least, most = magnitude(argument)
    if one.operation == "sqrt":
        return most / (maximum(least, 1e-150) * exp(_ROOT * reach))
    if one.operation == "div" and one.faint < inf:
        least, most = (minimum(x, math.exp(one.faint)) for x in (least, most))
    if exponent is None:  # a quotient or a logarithm
        return most / (maximum(least, 1e-150) * exp(0.5 * reach))
    power = maximum(absolute(exponent[0]), absolute(exponent[1]))
    ends = [power * log(maximum(x, 1e-150)) for x in (least, most)]
    faint = [select(exponent[1] < 0.0, x, maximum(x, -_FAINT)) for x in ends]
    is_low = (exponent[0] > 0.0) * (exponent[1] <= _HIGH)
    return select(is_low, 0.0, (faint[1] - faint[0]) / reach)


def _steep(x: Scalar) -> Scalar:
    """Return the inverse of the hyperbolic sine."""
    return sign(x) * log(absolute(x) + sqrt(x * x + 1.0))


def is_needed(assembly: Assembly, curved: Sequence[Curved], span: tuple[float, float], reach: float) -> bool:
    """Return whether any of the functions can change by more than a step may, whatever coordinates and speeds are."""
    equations, values = assembly.own_equations, assembly.parameter_values.tolist()
    known = {s: (np.array([v]), np.array([v])) for s, v in zip(assembly.parameters, values, strict=True)}
    anywhere = np.array([-inf]), np.array([inf])
    known |= dict.fromkeys((*equations.coordinates, *equations.speeds), anywhere)
    known[equations.time] = np.array([span[0]]), np.array([span[1]])
    for one in curved:
        pairs = bounds([one.argument] if one.exponent is None else [one.argument, one.exponent], known)
        ends = [(float(low[0]), float(high[0])) for low, high in pairs]
        with np.errstate(all="ignore"):
            if not np.all(np.isfinite(ends[0])) and one.operation not in ("exp", "tanh"):
                return True
            power = ends[1] if one.exponent is not None else None
            if not float(_share(one, ends[0], power, reach)) <= 1.0:
                return True
    return False


# -- the program ---------------------------------------------------------------------------------------------------


def watched_program(
    name: str,
    curved: Sequence[Curved],
    inputs: Sequence[InputGroup],
    parameters: Sequence[Expression],
    angles: Sequence[Expression] = (),
    known: Mapping[Expression, Expression] | None = None,
    smooth: Iterable[Expression] = (),
) -> Program:
    """Return a program that says how far functions change over a step of a solver.

    Its inputs are the time, the unknowns and their rates at the beginning of the step, then at its end, and the reach:
    how far a function may change, in units of its own scale. Its one output is how many times that it changes.
    """
    (time,), *states = (group.symbols for group in inputs)
    unknowns = [one for group in states for one in group]
    graph = time.graph
    ends = [_End(time, unknowns, number) for number in (0, 1)]
    reach = graph.symbol("watched:reach")
    along: dict[Expression, Expression | float] = {time: 1.0}
    along |= {y: graph.symbol(f"watched:{y.name}'") for y in unknowns}
    hull = _Hull(ends, along, set(parameters), set(angles), dict(known or {}), smooth)
    wanted = [x for one in curved for x in (one.argument, one.exponent) if x is not None]
    found = enclose(wanted, hull)
    score: Scalar = 0.0
    for one in curved:
        power = None if one.exponent is None else found[one.exponent.index]
        score = maximum(score, _share(one, found[one.argument.index], power, reach))
    for angle in hull.angles.values():
        score = maximum(score, (angle[1] - angle[0]) * (1.0 / _TURN))
    groups = [group for end in ends for group in end.groups]
    outputs = (OutputGroup("share", (graph.convert(score),)),)
    return Program(f"{name} (steps)", (*groups, InputGroup("reach", (reach,))), tuple(parameters), outputs)


class _End:
    """One end of a step: symbols for time, unknowns and their rates there."""

    def __init__(self, time: Expression, unknowns: Sequence[Expression], number: int) -> None:
        symbol = time.graph.symbol
        self.time = symbol(f"watched:t{number}")
        self.values = [symbol(f"watched:{y.name}:{number}") for y in unknowns]
        self.rates = [symbol(f"watched:{y.name}':{number}") for y in unknowns]
        moved = [symbol(f"watched:{y.name}'") for y in unknowns]
        self.there = {time: self.time, **dict(zip([*unknowns, *moved], [*self.values, *self.rates], strict=True))}
        self.groups = (
            InputGroup(f"t{number}", (self.time,)),
            InputGroup(f"y{number}", tuple(self.values)),
            InputGroup(f"rates{number}", tuple(self.rates)),
        )


class _Hull:
    """Bounds over a step of what is smooth in it: control points of the cubic through both ends with their rates."""

    def __init__(
        self,
        ends: Sequence[_End],
        along: Mapping[Expression, Expression | float],
        parameters: set[Expression],
        coordinates: set[Expression],
        known: Mapping[Expression, Expression],
        smooth: Iterable[Expression],
    ) -> None:
        self._ends, self._along, self._parameters, self._known = ends, dict(along), parameters, known
        self._coordinates = coordinates
        self._smooth = {one.index: "fixed" if one.is_parametric else "smooth" for one in smooth}
        self.angles: dict[int, Pair] = {}

    def __call__(self, node: Expression) -> Pair | None:
        kind = self._kind(node)
        if kind == "fixed":
            return node, node
        if kind == "":
            return None
        for one in live([node]):
            if one.operation in ("sin", "cos") and self._kind(one) == "smooth":
                angle = one.arguments[0]
                if angle.index not in self.angles:
                    self.angles[angle.index] = self._points(angle)
        return self._points(node)

    def _points(self, node: Expression) -> Pair:
        (value,) = substitute([node], self._known) if self._known else [node]
        (rate,) = jvp([value], self._along)
        begin, end = (substitute([value, rate], one.there) for one in self._ends)
        third = (self._ends[1].time - self._ends[0].time) * (1.0 / 3.0)
        points = [begin[0], begin[0] + third * begin[1], end[0] - third * end[1], end[0]]
        low: Scalar = points[0]
        high: Scalar = points[0]
        for point in points[1:]:
            low, high = minimum(low, point), maximum(high, point)
        return low, high

    def _kind(self, node: Expression) -> str:
        """Return ``"fixed"``, ``"angle"`` or ``"smooth"`` for what is so over any step; empty for all else."""
        if node.index not in self._smooth:
            for one in live([node]):
                if one.index not in self._smooth:
                    self._smooth[one.index] = self._kind_of(one)
        return self._smooth[node.index]

    def _kind_of(self, node: Expression) -> str:
        if node.is_symbol:
            if node in self._parameters:
                return "fixed"
            return "angle" if node in self._coordinates else "smooth"
        kinds = [self._smooth[one.index] for one in node.arguments]
        if all(kind == "fixed" for kind in kinds):
            return "fixed"
        if node.operation == "atan2":  # which has no other bounds than half a turn to either side
            return "smooth"
        if "" in kinds:
            return ""
        if node.operation in ("add", "sub", "neg"):
            return "angle" if all(kind in ("angle", "fixed") for kind in kinds) else "smooth"
        if node.operation == "mul":
            return "smooth" if node.arguments[0] is not node.arguments[1] else ""
        if node.operation == "div":
            return "smooth" if kinds[1] == "fixed" else ""
        return "smooth" if node.operation in ("sin", "cos") and kinds[0] == "angle" else ""
