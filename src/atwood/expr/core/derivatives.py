"""Derivatives of expressions, as expressions: forward, reverse, sparse Jacobians, and affine parts.

Every operation of one or two arguments is described once, by the product of a number ``t`` with each of its
partial derivatives.  The forward sweep adds these products up over the arguments; the reverse sweep hands them
back to the arguments.  Where a sum can share a division, or a selection, the forward sweep has a rule of its own.
What outgrows all numbers is differentiated by its logarithm, so that a quotient by it has derivatives where it is zero.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Container, Iterator, Mapping, Sequence
from typing import NamedTuple

from atwood.errors import AtwoodError
from atwood.expr.core import algebra
from atwood.expr.core.algebra import component, select, unary
from atwood.expr.core.analysis import dependents, live, substitute, varying
from atwood.expr.core.arithmetic import add, divide, multiply, negate, subtract
from atwood.expr.core.graph import Expression, Graph, graph_of
from atwood.expr.core.operations import LEAVES, PIECEWISE_CONSTANT

_Rule = Callable[[Expression, Expression], Expression]


class SparseMatrix(NamedTuple):
    """The entries of a matrix that are not structurally zero, column after column, rows ascending in each.

    Attributes
    ----------
    rows, columns
        The position of each entry.
    entries
        The entries.
    """

    rows: tuple[int, ...]
    columns: tuple[int, ...]
    entries: tuple[Expression, ...]

    @property
    def triples(self) -> Iterator[tuple[int, int, Expression]]:
        """Row, column and entry of each place, in order."""
        return zip(self.rows, self.columns, self.entries, strict=True)

    @property
    def by_place(self) -> dict[tuple[int, int], Expression]:
        """The entries by row and column."""
        return {(row, column): entry for row, column, entry in self.triples}


def _square(a: Expression) -> Expression:
    return multiply(a, a)


def _one_minus_square(a: Expression) -> Expression:
    return subtract(a.graph.one, _square(a))


_UNARY_RULES: dict[str, _Rule] = {
    "neg": lambda n, t: negate(t),
    "sqrt": lambda n, t: divide(multiply(t.graph.constant(0.5), t), n),
    "sin": lambda n, t: multiply(unary("cos", n.arguments[0]), t),
    "cos": lambda n, t: negate(multiply(unary("sin", n.arguments[0]), t)),
    "tan": lambda n, t: multiply(add(n.graph.one, _square(n)), t),
    "asin": lambda n, t: divide(t, unary("sqrt", _one_minus_square(n.arguments[0]))),
    "acos": lambda n, t: negate(divide(t, unary("sqrt", _one_minus_square(n.arguments[0])))),
    "atan": lambda n, t: divide(t, add(n.graph.one, _square(n.arguments[0]))),
    "exp": lambda n, t: multiply(n, t),
    "log": lambda n, t: divide(t, n.arguments[0]),
    "sinh": lambda n, t: multiply(unary("cosh", n.arguments[0]), t),
    "cosh": lambda n, t: multiply(unary("sinh", n.arguments[0]), t),
    "tanh": lambda n, t: multiply(_one_minus_square(n), t),
    "absolute": lambda n, t: multiply(unary("sign", n.arguments[0]), t),
}


def _base_rule(n: Expression, t: Expression) -> Expression:
    """Return t times the derivative of ``a ** b`` by a."""
    a, b = n.arguments
    lowered = algebra.power(a, subtract(b, n.graph.one))
    return multiply(multiply(b, lowered), t)


def _radius_square(n: Expression) -> Expression:
    y, x = n.arguments
    return add(_square(y), _square(x))


def _if_chosen(operation: str) -> tuple[_Rule, _Rule]:
    """Return the rules for the arguments of a minimum or maximum."""
    return (
        lambda n, t: select(_chooses_first(n, operation), t, n.graph.zero),
        lambda n, t: select(_chooses_first(n, operation), n.graph.zero, t),
    )


def _chooses_first(n: Expression, operation: str) -> Expression:
    a, b = n.arguments
    return algebra.less_equal(a, b) if operation == "minimum" else algebra.less_equal(b, a)


_BINARY_RULES: dict[str, tuple[_Rule, _Rule]] = {
    "add": (lambda n, t: t, lambda n, t: t),
    "sub": (lambda n, t: t, lambda n, t: negate(t)),
    "mul": (lambda n, t: multiply(n.arguments[1], t), lambda n, t: multiply(n.arguments[0], t)),
    "div": (lambda n, t: divide(t, n.arguments[1]), lambda n, t: negate(multiply(divide(t, n.arguments[1]), n))),
    "pow": (_base_rule, lambda n, t: multiply(multiply(n, unary("log", n.arguments[0])), t)),
    "atan2": (
        lambda n, t: divide(multiply(n.arguments[1], t), _radius_square(n)),
        lambda n, t: negate(divide(multiply(n.arguments[0], t), _radius_square(n))),
    ),
    "minimum": _if_chosen("minimum"),
    "maximum": _if_chosen("maximum"),
}


def _partial(n: Expression, position: int, t: Expression) -> Expression:
    """Return t times the partial derivative of a node by one of its arguments."""
    operation = n.operation
    if operation in _UNARY_RULES:
        return _UNARY_RULES[operation](n, t)
    if operation in _BINARY_RULES:
        return _BINARY_RULES[operation][position](n, t)
    if operation in PIECEWISE_CONSTANT:
        return n.graph.zero
    if operation == "select":
        if position == 0:
            return n.graph.zero
        zero = n.graph.zero
        return select(n.arguments[0], t, zero) if position == 1 else select(n.arguments[0], zero, t)
    if operation == "external":
        known = n.payload.derivatives
        derivative = None if known is None else known[position]
        if derivative is None:
            raise AtwoodError(
                f"the derivative of the external function by argument {position + 1} is needed but not known",
                where=n.payload.name,
                advice="Give the ExternalFunction its derivatives.",
            )
        return multiply(algebra.external(derivative, n.arguments), t)
    raise AtwoodError(f"the operation {operation} has no derivative rule")


def _tangent(n: Expression, tangents: Mapping[int, Expression], seeds: Mapping[int, object]) -> Expression | None:
    """Return the derivative of a node from those of its arguments; None for a structural zero."""
    operation = n.operation
    arguments = n.arguments
    if operation in _USUAL:
        return _usual_tangent(operation, *arguments, *[tangents.get(one.index) for one in arguments])
    moving = [(k, tangents[a.index]) for k, a in enumerate(arguments) if a.index in tangents]
    if not moving or operation in PIECEWISE_CONSTANT:
        return None
    if operation == "select":
        zero = n.graph.zero
        a, b = (tangents.get(argument.index, zero) for argument in arguments[1:])
        return select(arguments[0], a, b)
    if operation == "div" and (slopes := logarithmic_slopes(arguments[1], seeds)) is not None:
        return tangent_of_quotient(n, slopes, tangents)
    if len(moving) == 2 and operation == "div":
        return divide(subtract(moving[0][1], multiply(n, moving[1][1])), arguments[1])
    if len(moving) == 2 and operation == "atan2":
        turn = subtract(multiply(arguments[1], moving[0][1]), multiply(arguments[0], moving[1][1]))
        return divide(turn, _radius_square(n))
    if len(moving) == 2 and operation in ("minimum", "maximum"):
        return select(_chooses_first(n, operation), moving[0][1], moving[1][1])
    (position, t), *others = moving
    total = _partial(n, position, t)
    for position, t in others:
        total = add(total, _partial(n, position, t))
    return total


_USUAL = frozenset({"add", "sub", "mul"})


def _usual_tangent(
    operation: str, a: Expression, b: Expression, s: Expression | None, t: Expression | None
) -> Expression | None:
    """Return the derivative of a sum, difference or product from those of both, which are most of all nodes."""
    if operation == "mul":
        if s is None:
            return None if t is None else multiply(a, t)
        if t is None:
            return multiply(b, s)
        if a is b:
            return multiply(a.graph.constant(2.0), multiply(a, s))
        return add(multiply(b, s), multiply(a, t))
    if t is None:
        return s
    if operation == "sub":
        t = negate(t)
    return t if s is None else add(s, t)


def _solve_tangent(n: Expression, tangents: Mapping[int, Expression]) -> list[Expression]:
    """Return the derivatives of the unknowns of ``A x = b``, from ``A dx = db - dA x``."""
    size = n.payload
    zero = n.graph.zero
    right = []
    for i in range(size):
        total = tangents.get(n.arguments[size * size + i].index, zero)
        for j in range(size):
            moved = tangents.get(n.arguments[size * i + j].index)
            if moved is not None:
                total = subtract(total, multiply(moved, component(n, j)))
        right.append(total)
    return algebra.solve(n.arguments[: size * size], right)


def _sweep(nodes: Sequence[Expression], seeds: Mapping[int, Expression]) -> dict[int, Expression]:
    """Return the derivatives of nodes in topological order, by index, without structural zeros."""
    tangents = {index: seed for index, seed in seeds.items() if not seed.is_zero}
    unknowns: dict[int, list[Expression]] = {}
    for node in nodes:
        index = node.index
        operation = node.operation
        if operation in LEAVES or index in seeds:
            continue
        if operation == "component":
            parts = unknowns.get(node.arguments[0].index)
            derivative = None if parts is None else parts[node.payload]
        elif operation == "solve":
            if any(argument.index in tangents for argument in node.arguments):
                unknowns[index] = _solve_tangent(node, tangents)
            continue
        else:
            derivative = _tangent(node, tangents, seeds)
        if derivative is not None and not derivative.is_zero:
            tangents[index] = derivative
    return tangents


def jvp(outputs: Sequence[Expression | float], tangents: Mapping[Expression, Expression | float]) -> list[Expression]:
    """Return the derivatives of expressions along a direction, by one forward sweep.

    Parameters
    ----------
    outputs
        What to differentiate.
    tangents
        The rate of each independent expression, usually a symbol; what is not named stays fixed.  An expression
        that is named is taken as independent, whatever it is made of.

    Returns
    -------
    list of Expression
        One derivative for each output; the constant 0 where the output does not move.
    """
    graph, nodes = _graph_of(*outputs, next(iter(tangents), 0.0)), live(outputs, tangents)
    if len(tangents) > len(nodes):  # one part of a large scene
        tangents = {node: tangents[node] for node in nodes if node in tangents}
    seeds = {key.index: graph.convert(rate) for key, rate in tangents.items()}
    moved = _sweep(nodes, seeds)
    return [moved.get(output.index, graph.zero) if isinstance(output, Expression) else graph.zero for output in outputs]


def vjp(
    outputs: Sequence[Expression | float],
    cotangents: Sequence[Expression | float],
    wrt: Sequence[Expression],
) -> list[Expression]:
    """Return the gradient of ``sum(cotangent * output)``, by one reverse sweep.

    Parameters
    ----------
    outputs
        What to differentiate.
    cotangents
        The weight of each output.
    wrt
        The independent expressions, usually symbols.

    Returns
    -------
    list of Expression
        One derivative for each entry of ``wrt``.
    """
    graph = _graph_of(*outputs, *wrt)
    nodes = live(outputs, wrt)
    active = dependents(nodes, wrt)
    roots = {root.index for root in wrt}
    weights: dict[int, Expression] = {}

    def hand_back(target: Expression, amount: Expression) -> None:
        if target.index in active and not amount.is_zero:
            present = weights.get(target.index)
            weights[target.index] = amount if present is None else add(present, amount)

    for output, cotangent in zip(outputs, cotangents, strict=True):
        if isinstance(output, Expression):
            hand_back(output, graph.convert(cotangent))
    unknowns: dict[int, dict[int, Expression]] = {}
    for node in reversed(nodes):
        if node.index in roots or node.operation in LEAVES:
            continue
        if node.operation == "solve":
            if node.index in unknowns:
                _solve_hand_back(node, unknowns[node.index], active, hand_back)
            continue
        weight = weights.get(node.index)
        if weight is None or weight.is_zero:
            continue
        if node.operation == "component":
            unknowns.setdefault(node.arguments[0].index, {})[node.payload] = weight
            continue
        if node.operation == "mul" and node.arguments[0] is node.arguments[1]:
            # The factor two goes to the weight, where it may meet a constant; the sum of two halves never would.
            hand_back(node.arguments[0], multiply(multiply(graph.constant(2.0), weight), node.arguments[0]))
            continue
        if node.operation == "div" and (slopes := logarithmic_slopes(node.arguments[1], roots)) is not None:
            hand_back_quotient(node, slopes, weight, hand_back)
            continue
        for position, argument in enumerate(node.arguments):
            if argument.index in active:
                hand_back(argument, _partial(node, position, weight))
    return [weights.get(root.index, graph.zero) for root in wrt]


def _solve_hand_back(
    n: Expression,
    weights: Mapping[int, Expression],
    active: set[int],
    hand_back: Callable[[Expression, Expression], None],
) -> None:
    """Hand the weights of the unknowns of ``A x = b`` back: ``A^T z = w``, ``z`` to b and ``-z x^T`` to A."""
    size = n.payload
    matrix = n.arguments[: size * size]
    transposed = [matrix[size * j + i] for i in range(size) for j in range(size)]
    zero = n.graph.zero
    z = algebra.solve(transposed, [weights.get(i, zero) for i in range(size)])
    for i in range(size):
        hand_back(n.arguments[size * size + i], z[i])
        for j in range(size):
            if matrix[size * i + j].index in active:
                hand_back(matrix[size * i + j], negate(multiply(z[i], component(n, j))))


def jacobian(
    outputs: Sequence[Expression | float],
    wrt: Sequence[Expression | Mapping[Expression, Expression | float]],
) -> SparseMatrix:
    """Return the Jacobian without its structural zeros, by one forward sweep a column.

    Each sweep visits only what depends on its column.

    Parameters
    ----------
    outputs
        The rows.
    wrt
        The columns: an expression, usually a symbol, or a direction as for :func:`jvp`, such as
        ``{y: 1.0, y_rate: c}``.

    Returns
    -------
    SparseMatrix
        The entries in the order of compressed columns.
    """
    if not wrt or not any(isinstance(output, Expression) for output in outputs):
        return SparseMatrix((), (), ())
    graph = _graph_of(*outputs)
    nodes = live(outputs, [one for each in wrt for one in ([each] if isinstance(each, Expression) else each)])
    by_index = {node.index: node for node in nodes}
    users = _users(nodes)
    rows_of: dict[int, list[int]] = {}
    for row, output in enumerate(outputs):
        if isinstance(output, Expression):
            rows_of.setdefault(output.index, []).append(row)
    rows: list[int] = []
    columns: list[int] = []
    entries: list[Expression] = []
    for column, one in enumerate(wrt):
        if isinstance(one, Expression):
            if one.index not in by_index:
                continue
            direction: Mapping[Expression, Expression | float] = {one: 1.0}
        else:
            direction = one
        seeds = {key.index: graph.convert(rate) for key, rate in direction.items()}
        reached = _reached(seeds, users)
        moved = _sweep([by_index[index] for index in reached if index in by_index], seeds)
        found = sorted((row, index) for index in reached if index in moved for row in rows_of.get(index, ()))
        for row, index in found:
            rows.append(row)
            columns.append(column)
            entries.append(moved[index])
    return SparseMatrix(tuple(rows), tuple(columns), tuple(entries))


def jacobian_by_rows(outputs: Sequence[Expression], wrt: Sequence[Expression]) -> list[Expression]:
    """Return all entries of the Jacobian, structural zeros included, row by row."""
    n = len(wrt)
    values = [wrt[0].graph.zero] * (len(outputs) * n) if wrt else []
    found = jacobian(outputs, wrt)
    for row, column, entry in found.triples:
        values[row * n + column] = entry
    return values


def sweeps_exceed(
    outputs: Sequence[Expression | float],
    wrt: Sequence[Expression | Mapping[Expression, Expression | float]],
    limit: int,
) -> bool:
    """Return whether the sweeps of a Jacobian visit more than a number of nodes: about as many are then made.

    Parameters
    ----------
    outputs, wrt
        As for `jacobian`.
    limit
        The number of nodes.
    """
    users = _users(live(outputs))
    visited = 0
    for column in wrt:
        seeds = [column] if isinstance(column, Expression) else list(column)
        visited += len(_reached({seed.index: seed for seed in seeds}, users))
        if visited > limit:
            return True
    return False


def _users(nodes: Sequence[Expression]) -> dict[int, list[int]]:
    """Return which nodes use each node."""
    users: dict[int, list[int]] = {}
    for node in nodes:
        for argument in set(node.arguments):
            users.setdefault(argument.index, []).append(node.index)
    return users


def _reached(seeds: Mapping[int, Expression], users: Mapping[int, Sequence[int]]) -> list[int]:
    """Return the sorted indices of everything that uses a seed, directly or not."""
    found = set(seeds)
    stack = list(seeds)
    while stack:
        for user in users.get(stack.pop(), ()):
            if user not in found:
                found.add(user)
                stack.append(user)
    return sorted(found)


def _graph_of(*values: Expression | float) -> Graph:
    graph = graph_of(*values)
    if graph is None:
        raise AtwoodError("there is no expression to differentiate")
    return graph


Slopes = list[tuple[Expression, Expression]]


def logarithmic_slopes(d: Expression, kept: Container[int]) -> Slopes | None:
    """Return expressions and factors with which the sum of ``factor * derivative`` is the derivative of ``log(d)``.

    An exponential, a hyperbolic cosine, their products, and their sums with what depends on parameters alone have
    factors that stay finite where they themselves do not. None for all else.
    """
    if d.index in kept or d.is_parametric:
        return None
    if d.operation == "exp":
        return [(d.arguments[0], d.graph.one)]
    if d.operation == "cosh":
        return [(d.arguments[0], unary("tanh", d.arguments[0]))]
    if d.operation == "mul":
        found: Slopes = []
        for one in d.arguments:
            slopes = [] if one.is_parametric else logarithmic_slopes(one, kept)
            if slopes is None:
                return None
            found += slopes
        return found
    if d.operation == "add" and d.arguments[0].is_parametric != d.arguments[1].is_parametric:
        fixed, moving = d.arguments if d.arguments[0].is_parametric else d.arguments[::-1]
        slopes = logarithmic_slopes(moving, kept)
        share = subtract(d.graph.one, divide(fixed, d))
        return None if slopes is None else [(one, multiply(share, factor)) for one, factor in slopes]
    return None


def tangent_of_quotient(n: Expression, slopes: Slopes, tangents: Mapping[int, Expression]) -> Expression:
    """Return the derivative of a quotient from those slopes of its divisor."""
    a, d = n.arguments
    total = zero = n.graph.zero
    for one, factor in slopes:
        total = add(total, multiply(factor, tangents.get(one.index, zero)))
    return subtract(divide(tangents.get(a.index, zero), d), multiply(n, total))


def hand_back_quotient(
    n: Expression, slopes: Slopes, weight: Expression, hand_back: Callable[[Expression, Expression], None]
) -> None:
    """Hand the weight of a quotient back to what it is made of."""
    hand_back(n.arguments[0], divide(weight, n.arguments[1]))
    for one, factor in slopes:
        hand_back(one, negate(multiply(multiply(factor, weight), n)))


def affine_coefficients(
    expression: Expression, variables: Sequence[Expression], parameters: Collection[Expression]
) -> tuple[list[Expression], Expression] | None:
    """Write an expression as a sum of coefficients times variables, plus a remainder.

    Parameters
    ----------
    expression
        The expression to take apart.
    variables
        The symbols it may be affine in.
    parameters
        Symbols that coefficients may depend on.

    Returns
    -------
    tuple or None
        The coefficients in the order of the variables, which depend on constants and parameters only, and the
        remainder, which depends on none of the variables.  ``None`` if the expression has no such form.
    """
    nodes = live([expression])
    active = dependents(nodes, variables)
    if any(node.operation in PIECEWISE_CONSTANT and node.index in active for node in nodes):
        return None
    coefficients = [expression.graph.zero] * len(variables)
    derivative = jacobian([expression], variables)
    for column, entry in zip(derivative.columns, derivative.entries, strict=True):
        coefficients[column] = entry
    slopes = live(coefficients)
    if not varying(slopes, parameters).isdisjoint(coefficients):
        return None
    [remainder] = substitute([expression], dict.fromkeys(variables, 0.0))
    return coefficients, remainder
