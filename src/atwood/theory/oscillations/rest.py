"""States of rest of a scene in symbols: V' = 0 solved in closed form, with the range of parameters where each exists."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from atwood.errors import UnsupportedError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy
from atwood.theory.equations.equations import EquationsOfMotion, read_equations
from atwood.theory.formulas.printers import Sympy, objects
from atwood.theory.oscillations.conditions import NoClosedFormError, Solution, solve_conditions


@dataclass(frozen=True, eq=False)
class PlainEquations:
    """Equations of motion on symbols that do not depend on time, parameters with the sign of their value.

    Attributes
    ----------
    equations
        Those of the scene.
    coordinates, velocities, accelerations, multipliers
        Their symbols, real.
    rows
        What is zero in every motion; and the constraints on positions.
    constraints
        Functions of the coordinates.
    back
        For each symbol the one that people see.
    values
        Numbers of the parameters.
    """

    equations: EquationsOfMotion
    coordinates: tuple[Sympy, ...]
    velocities: tuple[Sympy, ...]
    accelerations: tuple[Sympy, ...]
    multipliers: tuple[Sympy, ...]
    rows: tuple[Sympy, ...]
    constraints: tuple[Sympy, ...]
    back: Mapping[Sympy, Sympy]
    values: Mapping[Sympy, float]

    @property
    def name(self) -> str:
        """What the scene is called."""
        return self.equations.name

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths of the coordinates."""
        return tuple(one.name for one in self.equations.expressions.names)

    def at_rest(self, values: Sequence[Sympy]) -> list[Sympy]:
        """Return expressions where nothing moves."""
        import sympy

        still = dict.fromkeys((*self.velocities, *self.accelerations), sympy.Integer(0))
        return [one.xreplace(still) for one in values]

    def conditions(self) -> list[Sympy]:
        """Return what is zero at rest: forces, and constraints."""
        return [*self.at_rest(self.rows), *self.constraints]

    def solutions(self) -> list[Solution]:
        """Return the states of rest in closed form.

        Raises
        ------
        UnsupportedError
            If there is no closed form.
        """
        try:
            return solve_conditions(self.conditions(), (*self.coordinates, *self.multipliers))
        except NoClosedFormError:
            raise UnsupportedError(
                "its conditions of rest are not solved one unknown at a time",
                where=self.name,
                advice="Without `symbolic` states of rest are found in numbers.",
            ) from None

    def number(self, value: Sympy) -> complex:
        """Return an expression with the values of the scene."""
        return complex(value.subs(self.values).evalf(30))

    def told(self, value: Sympy) -> Sympy:
        """Return an expression in the symbols that people see."""
        return value.xreplace(self.back) if hasattr(value, "xreplace") else value


def plain_equations(assembly: Assembly) -> PlainEquations:
    """Return the equations of motion on symbols that do not depend on time.

    Raises
    ------
    UnsupportedError
        If they depend on time, are too large to be read, hold constraints on velocities, or velocities that are not
        derivatives of coordinates.
    """
    equations = read_equations(assembly)
    found, t = equations.expressions, sympy.Symbol("t")
    if not equations.is_readable:
        raise _refused(equations, "its equations are too long to be solved by hand", "Leave out `symbolic`.")
    if any(place is None for place in found.moves) or len(found.velocities) != len(found.coordinates):
        advice = "Choose an orientation in Euler angles, such as orientation='euler-zxz'."
        raise _refused(equations, "its velocities are not all derivatives of coordinates", advice)
    if not all(one.holonomic for one in found.constraints):
        raise _refused(equations, "its constraints are on velocities", "Leave out `symbolic`.")
    letters = equations.coordinates
    names = [str(one.func) for one in letters]
    q, u, a = (tuple(sympy.Dummy(f"{one}{dots}", real=True) for one in names) for dots in ("", "'", "''"))
    held = tuple(sympy.Dummy(str(one.func), real=True) for one in equations.multipliers)
    by: dict[Sympy, Sympy] = {}
    for one, *plain in zip(letters, q, u, a, strict=True):
        by |= {one: plain[0], one.diff(t): plain[1], one.diff(t, 2): plain[2]}
    by |= dict(zip(equations.multipliers, held, strict=True))
    values: dict[Sympy, float] = {}
    for symbol in equations.legend:
        if symbol.value is not None:
            assumed = {"positive": True} if symbol.value > 0 else {"negative": True} if symbol.value < 0 else {}
            made = sympy.Symbol(symbol.name, real=True, **assumed)
            by[objects.letter(symbol)], values[made] = made, symbol.value
    order = sorted(by, key=lambda one: -len(one.args) if isinstance(one, sympy.Derivative) else 0)
    derivatives = {one: by[one] for one in order if isinstance(one, sympy.Derivative)}
    others = {one: by[one] for one in order if one not in derivatives}
    rows, constraints = (
        tuple(one.xreplace(derivatives).xreplace(others) for one in every)
        for every in (equations.rows, equations.constraints)
    )
    if any(one.has(t) for one in (*rows, *constraints)):
        raise _refused(
            equations, "its equations depend on time", "Rest belongs to scenes that keep still or turn evenly."
        )
    back = {plain: one for one, plain in by.items() if not isinstance(one, sympy.Derivative)}
    back |= {plain: sympy.Symbol(name) for plain, name in zip(q, names, strict=True)}
    return PlainEquations(equations, q, u, a, held, rows, constraints, back, values)


def _refused(equations: EquationsOfMotion, text: str, advice: str) -> UnsupportedError:
    return UnsupportedError(text, where=equations.name, advice=advice)


def positive_parts(value: Sympy) -> list[Sympy]:
    """Return the factors of an expression whose sign depends on the parameters, a sign in front of the first; [-1] if
    it is negative, [] if it is positive, [0] if it is zero.
    """
    sign, found = 1, []
    whole = sympy.factor(sympy.together(value))
    for factor in sympy.Mul.make_args(whole):
        base, exponent = factor.as_base_exp()
        if factor.is_positive or (exponent.is_even and base.is_nonzero):
            continue
        if factor.is_negative:
            sign = -sign
        elif factor.is_zero:
            return [sympy.Integer(0)]
        else:
            found.append(base if exponent.is_odd else factor)
    if not found:
        return [] if sign > 0 else [sympy.Integer(-1)]
    return [sign * sympy.Mul(*found)] if len(found) > 1 or sign < 0 else found


def as_condition(value: Sympy) -> Any:
    """Return that an expression is positive, as a sympy relation, True or False."""
    parts = positive_parts(value)
    if not parts:
        return sympy.true
    return sympy.And(*(sympy.Gt(_balanced(one), 0) if one.is_number else _balanced(one) for one in parts))


def _balanced(value: Sympy) -> Any:
    """Return ``a - b > 0`` as ``a > b``."""
    if value.is_number:
        return value
    terms = sympy.Add.make_args(sympy.expand(value))
    left = sympy.Add(*(one for one in terms if not one.could_extract_minus_sign()))
    right = sympy.Add(*(-one for one in terms if one.could_extract_minus_sign()))
    return sympy.Gt(left, right)
