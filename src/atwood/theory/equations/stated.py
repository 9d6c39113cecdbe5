"""What a person states of a scene in sympy: expressions in the letters of its equations, and functions added to L."""

from __future__ import annotations

from typing import Any

from atwood.arguments import Kind, Refused, optional
from atwood.errors import UsageError, suggestion
from atwood.expr import Expression, depends_on, jvp
from atwood.expr.sympy_bridge import from_sympy
from atwood.forms.assembly import Assembly
from atwood.forms.lagrangian import Contribution, Lagrangian
from atwood.lazy_dataclasses import replace
from atwood.lazy_modules import sympy
from atwood.theory.equations.formulas import EquationFormulas
from atwood.theory.formulas.notation import Notation
from atwood.theory.formulas.printers import objects


def _readable(value: Any) -> Any:
    if value is None or isinstance(value, (bool, bytes, type)) or not (value == value):
        raise Refused
    if not isinstance(sympy.sympify(value), sympy.Expr):
        raise Refused
    return value


FUNCTION = Kind("a sympy expression or a number", _readable)
GAUGE = optional(Kind("a function of coordinates and time, such as 'm*x*t'", _readable, "FUNCTION"))


def with_gauge(assembly: Assembly, found: Lagrangian, notation: Notation, gauge: Any) -> Lagrangian:
    """Return the Lagrangian with the rate of a function of coordinates and time added, which leaves the equations.

    Momenta change by the derivatives of the function by the coordinates, H by less its derivative by time (Goldstein,
    section 2.4 and derivation 8 of chapter 1).
    """
    if gauge is None:
        return found
    f = ExpressionReader(EquationFormulas(assembly, found, notation)).read(gauge, "gauge")
    if depends_on(f, (*found.velocities, *found.accelerations)) or found.has_angular_velocities:
        raise UsageError(
            "L changes by the rate of a function of coordinates and time, and this depends on velocities, or these are "
            "no derivatives of coordinates",
            where=f"{assembly.flat.name}: gauge",
            advice="Take a function of coordinates and t; with orientations in space, in Euler angles.",
        )
    along: dict[Expression, Expression | float] = dict(zip(found.coordinates, found.rates, strict=True))
    zero, rate = found.graph.zero, jvp([f], {**along, found.time: 1.0})[0]
    added = Contribution("gauge", zero, zero, rate, zero, (zero,) * len(found.velocities))
    return replace(found, parts=(*found.parts, added))


class ExpressionReader:
    """Reads sympy expressions in the symbols of a scene's equations."""

    def __init__(self, formulas: EquationFormulas) -> None:
        notation, self._graph = formulas.notation, formulas.expressions.graph
        self._known: dict[Any, Expression] = {}
        for expression, symbol in notation.symbols.items():
            self._known[objects.letter(symbol, 0)] = expression
        for expression, (symbol, dots) in notation.velocities.items():
            self._known[objects.letter(symbol, dots)] = expression
        moving = [symbol for symbol in notation.symbols.values() if symbol.moves]
        self._names = {one.name: objects.letter(one) for one in moving} | {
            str(one): one for one in self._known if one.is_Symbol
        }
        self._scene = formulas.name

    def read(self, value: Any, what: str) -> Expression:
        """Return an expression of the graph."""
        try:
            whole = sympy.sympify(value, self._names).doit()
        except (sympy.SympifyError, TypeError, AttributeError):
            raise UsageError(
                f"{value!r} is no sympy expression", where=f"{self._scene}: {what}", advice="Give one, or a number."
            ) from None
        names = {str(one): one for one in self._known}
        stand_ins = {one: sympy.Dummy(f"s{k}") for k, one in enumerate(self._known)}
        # Derivatives hold functions, and these time: the outer ones first.
        for one in sorted(stand_ins, key=lambda one: (one.is_Symbol, -one.count_ops(), not one.is_Derivative)):
            whole = whole.xreplace({one: stand_ins[one]})
        known = set(stand_ins.values())
        stray = [
            one for one in (*whole.free_symbols, *whole.atoms(sympy.core.function.AppliedUndef)) if one not in known
        ]
        if stray:
            name = str(stray[0])
            raise UsageError(
                f"{name} is no symbol of the scene",
                where=f"{self._scene}: {what}",
                advice=suggestion(name, list(names)) or "Take the symbols from `atwood.equations(scene)`.",
            )
        return from_sympy(whole, self._graph, {stand_ins[one]: value for one, value in self._known.items()})
