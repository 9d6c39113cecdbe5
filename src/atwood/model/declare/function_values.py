"""Parameters that are functions: of places, of angles, of time; a law calls them like any function.

A function is given as a number, as a formula in text or in sympy, or as a Python function in plain arithmetic. It is
traced once, on a graph of its own, so that it can be differentiated, compared, written to a file and read again. What a
Python function takes by name only, ``lambda x, *, stiffness: stiffness * x``, are parameters of the model around
the part (or of the part, in its own default), which stay letters in formulas.
"""

from __future__ import annotations

import inspect
import math
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from atwood.arguments import show
from atwood.errors import AtwoodError, ParameterError
from atwood.expr.core import algebra
from atwood.expr.core.analysis import evaluate, live
from atwood.expr.core.derivatives import jvp
from atwood.expr.core.functions import Scalar
from atwood.expr.core.graph import Expression, Graph, graph_of
from atwood.model.declare.time_functions import StoredFunction, read_text, steps_of, unknown_name
from atwood.model.values.space import Vector
from atwood.model.values.units import Unit


class Function:
    """A function of named arguments with one value, or with the three components of a vector.

    Attributes
    ----------
    arguments
        The names of its arguments, in the order in which they are given.
    text
        What it was given as, for people to read.
    letters
        Parameters that it takes by name, with their values where they are known.
    """

    def __init__(
        self,
        arguments: Sequence[str],
        results: Sequence[Expression],
        text: str,
        letters: Mapping[str, Scalar] | None = None,
    ) -> None:
        self.arguments, self.text, self.letters = tuple(arguments), text, dict(letters or {})
        self._results = tuple(results)
        self._graph = results[0].graph
        self._nodes = live(self._results)

    def __call__(self, *values: Scalar) -> Any:
        """Return the value, a scalar or a `Vector`; on numbers, on expressions and on sympy terms alike."""
        if len(values) != len(self.arguments):
            names = ", ".join(self.arguments)
            raise AtwoodError(f"the function {self.text} takes {names}, which are not {len(values)} values")
        values = (*values, *self.letters.values())
        graph = graph_of(*values)
        if graph is not None:
            found: list[Any] = list(self._rebuilt(graph, values))
        elif all(isinstance(value, (int, float)) for value in values):
            known = {self._symbol(name): float(value) for name, value in zip(self._names, values, strict=True)}
            found = evaluate(self._results, known)
        else:
            found = [one(*values) for one in self._stored("")]
        return found[0] if len(found) == 1 else Vector(*found)

    def __eq__(self, other: object) -> bool:
        return self is other or (isinstance(other, Function) and self._key() == other._key())

    def __hash__(self) -> int:
        return hash(self.arguments)

    def __repr__(self) -> str:
        return self.text

    def __reduce__(self) -> tuple[Any, ...]:
        return read_function, (self.steps(""), self.arguments, self.text, "", self.letters)

    @property
    def _names(self) -> tuple[str, ...]:
        return *self.arguments, *self.letters

    def with_letters(self, letters: Mapping[str, Scalar]) -> Function:
        """Return it with values of the parameters that it takes by name."""
        return Function(self.arguments, self._results, self.text, letters)

    @property
    def is_zero(self) -> bool:
        """Whether it is zero everywhere."""
        return all(one.is_zero for one in self._results)

    def depends_on(self, name: str) -> bool:
        """Return whether an argument is read."""
        return self._symbol(name) in self._nodes

    def derivative(self, name: str) -> Function:
        """Return the partial derivative by an argument."""
        slopes = jvp(self._results, {self._symbol(name): 1.0})
        return Function(self.arguments, slopes, f"d({self.text})/d{name}", self.letters)

    def scaled(self, arguments: Sequence[float], result: float) -> Function:
        """Return the same function where its arguments, and its value, are counted in other units."""
        symbols = [self._symbol(name) / size for name, size in zip(self.arguments, arguments, strict=True)]
        made = [one * result for one in self._rebuilt(self._graph, (*symbols, *map(self._symbol, self.letters)))]
        return Function(self.arguments, made, self.text, self.letters)

    def steps(self, where: str) -> list[Any]:
        """Return it as plain data: a list of steps for each result."""
        return [steps_of(one, where) for one in self._results]

    def corners(self) -> list[Function]:
        """Return functions with zeros wherever it, or a derivative of it, may jump: what its choices compare."""
        found = []
        for node in self._nodes:
            if node.operation in ("absolute", "sign"):
                found.append(node.arguments[0])
            elif node.operation in ("minimum", "maximum", "less", "less_equal"):
                found.append(algebra.subtract(*node.arguments))
        return [Function(self.arguments, [one], self.text, self.letters) for one in dict.fromkeys(found)]

    def _symbol(self, name: str) -> Expression:
        return self._graph.symbol(name)

    def _rebuilt(self, graph: Graph, values: Sequence[Scalar]) -> Sequence[Expression]:
        given = zip(self._names, values, strict=True)
        made = {self._symbol(name): graph.convert(value) for name, value in given}
        algebra.rebuild(graph, self._nodes, made)
        return [made[one] for one in self._results]

    def _stored(self, where: str) -> list[StoredFunction]:
        return [StoredFunction(steps, where, self._names) for steps in self.steps(where)]

    def _key(self) -> Any:
        try:
            return self._names, self.steps("")
        except ParameterError:  # it calls an external function, and is like no other
            return id(self)


def read_function(written: Any, arguments: Any, text: Any, where: str, letters: Any = ()) -> Function:
    """Return the function that `Function.steps` wrote."""
    given = dict(letters) if isinstance(letters, Mapping) else dict.fromkeys(letters, None)
    names_are_right = isinstance(arguments, (list, tuple)) and all(isinstance(name, str) for name in arguments)
    if not isinstance(written, list) or len(written) not in (1, 3) or not names_are_right:
        raise ParameterError("the stored function cannot be read", where=where, advice="Save the scene again.")
    stored = [StoredFunction(steps, where, (*arguments, *given)) for steps in written]
    graph = Graph()
    symbols = [graph.symbol(name) for name in (*arguments, *given)]
    return Function(arguments, [graph.convert(one(*symbols)) for one in stored], str(text), given)


def make_function(value: Any, arguments: Sequence[str], size: int, unit: Unit, where: str) -> Function:
    """Return what is given for a parameter as a function."""
    if isinstance(value, Function) and value.arguments == tuple(arguments) and len(value._results) == size:
        return value
    graph = Graph()
    letters = [name for one in (value if isinstance(value, (list, tuple)) else [value]) for name in by_name_only(one)]
    letters = [name for name in dict.fromkeys(letters) if name not in arguments]
    symbols = {name: graph.symbol(name) for name in (*arguments, *letters)}
    if size > 1 and not callable(value):
        if isinstance(value, str) or not isinstance(value, Sequence) or len(value) != size:
            raise ParameterError(
                f"{show(value)} is not {size} functions",
                where=where,
                advice=f"Give {size} formulas of {', '.join(arguments)} in brackets, or a function that returns them.",
            )
        found = [_traced(one, symbols, unit, where) for one in value]
        text = f"({', '.join(_said(one) for one in value)})"
    else:
        whole = _traced(value, symbols, unit, where)
        found = list(whole) if isinstance(whole, (Vector, Sequence)) else [whole]
        text = _said(value)
    if len(found) != size:
        raise ParameterError(f"it gives {len(found)} numbers and not {size}", where=where)
    try:
        results = [graph.convert(one) for one in found]
    except AtwoodError:
        raise ParameterError(f"{show(value)} does not give numbers", where=where, advice=_PLAIN) from None
    return Function(arguments, results, text, dict.fromkeys(letters, None))


_PLAIN = "Write it in plain arithmetic with Atwood's own functions (atwood.sin, atwood.select, ...)."


def _said(value: Any) -> str:
    name = getattr(value, "__name__", "")
    return name if callable(value) and name else str(value)


def _traced(value: Any, symbols: Mapping[str, Expression], unit: Unit, where: str) -> Any:
    """Return what a function gives for symbols."""
    try:
        if isinstance(value, str):
            return read_text(value, symbols, unit, where)
        if is_sympy(value):
            return _from_sympy(value, symbols, where)
        if callable(value):
            return _called(value, symbols, where)
        if isinstance(value, bool) or not math.isfinite(float(value)):
            raise TypeError
        return float(value)
    except ParameterError:
        raise
    except RecursionError:
        reason = "it calls itself without end"
    except Exception as error:  # what a user's function raises is anything
        reason = error.message if isinstance(error, AtwoodError) else f"{type(error).__name__}: {error}"
        reason = reason if callable(value) or isinstance(value, str) else "it is no number and no function"
    raise ParameterError(
        f"{show(value)} cannot be evaluated as a function of {', '.join(symbols)} ({reason})",
        where=where,
        advice=_PLAIN,
    )


def by_name_only(value: Any) -> list[str]:
    """Return what a Python function takes by name only."""
    try:
        given = inspect.signature(value).parameters.values() if callable(value) else ()
    except Exception:  # whatever somebody's own object can raise; as a function it is refused by name
        return []
    empty = inspect.Parameter.empty
    return [one.name for one in given if one.kind is one.KEYWORD_ONLY and one.default is empty]


def _called(value: Callable[..., Any], symbols: Mapping[str, Expression], where: str) -> Any:
    """Call a Python function: with the arguments that it names, or with all of them in order."""
    try:
        kinds = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
        given = inspect.signature(value).parameters.values()
        names = [one.name for one in given if one.kind in kinds and one.default is inspect.Parameter.empty]
    except (TypeError, ValueError):
        names = []
    if names and set(names) <= set(symbols):
        return value(**{name: symbols[name] for name in names})
    if names and len(names) != len(symbols):
        raise ParameterError(
            f"the function takes {', '.join(names)}",
            where=where,
            advice=f"Its arguments are {', '.join(symbols)}: name those that it needs.",
        )
    return value(*symbols.values())


def is_sympy(value: Any) -> bool:
    """Return whether a value is a term of sympy."""
    sympy = sys.modules.get("sympy")
    return sympy is not None and isinstance(value, sympy.Basic)


def _from_sympy(value: Any, symbols: Mapping[str, Expression], where: str) -> Expression:
    from atwood.expr.sympy_bridge import from_sympy

    for one in value.free_symbols:
        if one.name not in symbols:
            raise unknown_name(one.name, symbols, where)
    graph = next(iter(symbols.values())).graph
    return graph.convert(from_sympy(value, graph, {one: symbols[one.name] for one in value.free_symbols}))
