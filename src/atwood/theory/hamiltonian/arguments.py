"""What arguments of functions on phase space may be: expressions of sympy, symbols, and phase spaces."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from atwood.arguments import Kind, Refused, each, instance, optional
from atwood.late import replace
from atwood.theory.hamiltonian.hamiltonian import Hamiltonian, read_hamiltonian

__all__ = [
    "BY_SYMBOL",
    "EXPRESSION",
    "EXPRESSIONS",
    "HAMILTONIAN",
    "INVERSE",
    "PHASE_SPACE",
    "SYMBOLS",
    "as_expression",
    "as_symbol",
]

_LETTERS = ("beta", "gamma", "zeta", "C", "N", "O", "Q", "S")
"""Names that sympy takes for functions and classes of its own where text is read; in mechanics they are symbols."""


def as_expression(value: Any) -> Any:
    """Return an expression of sympy from one, a number, or text of one; raise any error if it is none."""
    import sympy

    if value is None or isinstance(value, (bool, bytes, type)):
        raise Refused
    try:
        found = sympy.sympify(value, locals={name: sympy.Symbol(name) for name in _LETTERS})
    except Exception:  # text is read as Python
        raise Refused(f"{value!r} cannot be read." if isinstance(value, str) else "") from None
    if not isinstance(found, sympy.Expr):
        raise Refused
    if found.has(sympy.nan, sympy.zoo, sympy.oo, -sympy.oo):
        raise Refused("It has no finite value.")
    return found


def as_symbol(value: Any) -> Any:
    """Return a symbol of sympy from one or from its name; raise any error if it is none."""
    import sympy

    if isinstance(value, str):
        if not value.isidentifier():
            raise Refused(f"{value!r} is no name.")
        return sympy.Symbol(value)
    if not isinstance(value, sympy.Symbol):
        raise Refused
    return value


def _by_symbol(value: Any) -> dict[Any, Any]:
    if not isinstance(value, Mapping):
        raise Refused
    return {as_symbol(key): as_expression(one) for key, one in value.items()}


def _inverse(value: Any) -> dict[Any, Any]:
    if not isinstance(value, Mapping):
        raise Refused
    return {as_expression(key): as_expression(one) for key, one in value.items()}


def _in_order(kind: Kind, what: str) -> Kind:
    """Return the kind of several values in an order, of which text is none."""
    several = each(kind, what, single=False)

    def read(value: Any) -> Any:
        if isinstance(value, (str, set, frozenset, Mapping)):
            raise Refused
        return several.read(value)

    return replace(several, read=read)


def _phase_space(value: Any) -> Any:
    if isinstance(value, Hamiltonian):
        return value
    if not isinstance(value, (tuple, list)) or len(value) != 2:
        raise Refused
    return tuple(EXPRESSIONS.read(one) for one in value)


EXPRESSION = Kind("an expression of sympy, a number, or text such as 'p**2/2'", as_expression, "EXPRESSION")
EXPRESSIONS = _in_order(EXPRESSION, "a list of expressions of sympy")
SYMBOLS = _in_order(Kind("a symbol", as_symbol, "SYMBOL"), "a list of symbols of sympy, or of their names")
BY_SYMBOL = Kind("a dictionary by symbol, of expressions of sympy", _by_symbol, "SYMBOL=EXPRESSION", is_many=True)
INVERSE = optional(
    Kind(
        "a dictionary of expressions of sympy by old coordinate and momentum",
        _inverse,
        "SYMBOL=EXPRESSION",
        is_many=True,
    )
)
HAMILTONIAN = replace(
    instance("what `atwood.hamiltonian` returns", Hamiltonian),
    of_scene=lambda assembly: read_hamiltonian(assembly, "symbolic"),
)
PHASE_SPACE = replace(
    HAMILTONIAN, what="what `atwood.hamiltonian` returns, or a pair: coordinates and momenta", read=_phase_space
)
