"""What a function on phase space generates: its flow, and the algebra of several such functions.

With ``D_f g = {f, g}`` the flow of f by s is ``g -> e^(-s D_f) g`` (Goldstein, section 9.6): it moves coordinates and
momenta as Hamilton's equations with f in the place of H do, in a time s.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from itertools import combinations, combinations_with_replacement
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from atwood.arguments import optional, takes, whole
from atwood.errors import SolveError, UnsupportedError, UsageError
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy
from atwood.table import Shown, Table, table
from atwood.theory.formulas.page import aligned
from atwood.theory.formulas.printers import Sympy
from atwood.theory.formulas.reading import latex_of, text_of
from atwood.theory.hamiltonian.hamiltonian import Hamiltonian
from atwood.theory.hamiltonian.phase_space import (
    EXPRESSION,
    EXPRESSIONS,
    PHASE_SPACE,
    SYMBOLS,
    PhaseSpace,
    phase_space_of,
    short,
    vanishes,
)
from atwood.theory.hamiltonian.transformations import CanonicalTransformation, Space, bracket
from atwood.theory.symmetry.conserved import conserved

_CLOSED = 16
"""Functions that a flow turns into each other, beyond which no closed form is looked for."""


@dataclass(frozen=True, eq=False)
class Flow(Shown):
    """The flow of a function on phase space: a canonical transformation for each s.

    Attributes
    ----------
    space
        The phase space.
    function
        What generates it, on the plain symbols of `space`.
    parameter
        How far it goes, s.
    order
        The highest power of s in a series; None where it is exact.
    values
        Where coordinates and momenta go, on the plain symbols.
    """

    space: PhaseSpace
    function: Sympy
    parameter: Sympy
    order: int | None
    values: tuple[Sympy, ...]

    def tables(self) -> tuple[Table, ...]:
        """Return where coordinates and momenta go."""
        rows = [(text_of(old), f"→ {text_of(new)}") for old, new in self._leads_to]
        return (table(("", "~"), rows, repr(self)[1:-1]),)

    def latex(self) -> str:
        """Return where coordinates and momenta go as an aligned block of LaTeX."""
        return aligned(rf"{latex_of(old)} &\to {latex_of(new)}" for old, new in self._leads_to)

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {"order": self.order, "leads_to": {str(old): str(new) for old, new in self._leads_to}}

    @property
    def _leads_to(self) -> list[tuple[Sympy, Sympy]]:
        return list(zip(self.space.given, (*self.coordinates, *self.momenta), strict=True))

    @property
    def coordinates(self) -> tuple[Sympy, ...]:
        """Where the coordinates go."""
        return tuple(self.space.shown(one) for one in self.values[: len(self.space.coordinates)])

    @property
    def momenta(self) -> tuple[Sympy, ...]:
        """Where the momenta go."""
        return tuple(self.space.shown(one) for one in self.values[len(self.space.coordinates) :])

    def of(self, function: Any) -> Sympy:
        """Return ``e^(-s D_f) g``: a function where the flow leads, to the same order.

        Parameters
        ----------
        function
            g, a function of coordinates and momenta.
        """
        g = self.space.read(EXPRESSION.read(function))
        if self.order is not None:
            return self.space.shown(_series(self.function, g, self.space, self.parameter, self.order))
        return self.space.shown(short(g.xreplace(dict(zip(self.space.own, self.values, strict=True)))))

    def transformation(self, coordinates: Sequence[Any], momenta: Sequence[Any]) -> CanonicalTransformation:
        """Return it as a canonical transformation to new symbols, with its inverse, the flow by -s.

        Parameters
        ----------
        coordinates, momenta
            Symbols of the new coordinates and momenta.

        Raises
        ------
        UsageError
            If the flow is a series, which is canonical to its order alone.
        """
        if self.order is not None:
            raise UsageError(f"a series to order {self.order} is canonical to that order alone", where="flow_of")
        new = (*SYMBOLS.read(coordinates), *SYMBOLS.read(momenta))
        if len(new) != len(self.space.own):
            raise UsageError(f"{len(self.space.own)} new symbols are needed", where="flow_of")
        back = {self.parameter: -self.parameter, **dict(zip(self.space.own, new, strict=True))}
        solved = {old: one.xreplace(back) for old, one in zip(self.space.own, self.values, strict=True)}
        n, zero = len(self.coordinates), sympy.Integer(0)
        return CanonicalTransformation(self.space, new[:n], new[n:], self.coordinates, self.momenta, solved, None, zero)

    def integrated(self, start: Mapping[Any, float], s: float) -> dict[Sympy, float]:
        """Return where the flow leads in numbers, by integration of its differential equations.

        Parameters
        ----------
        start
            A number for each coordinate, momentum and other symbol of the function.
        s
            How far to go.

        Raises
        ------
        UsageError
            If a symbol has no number.
        SolveError
            If the flow ends before s.
        """
        given = {self.space.read(sympy.sympify(one)): float(value) for one, value in start.items()}
        missing = [one for one in {*self.space.own, *self.function.free_symbols} if one not in given]
        if missing:
            raise UsageError(f"{sorted(map(str, missing))[0]} has no number", where="Flow.integrated")
        fixed = {one: value for one, value in given.items() if one not in self.space.own}
        rates = sympy.lambdify(self.space.own, [one.xreplace(fixed) for one in self._rates], "numpy")
        begun = [given[one] for one in self.space.own]
        found = solve_ivp(lambda _, y: rates(*y), (0.0, s), begun, "DOP853", rtol=1e-12, atol=1e-13)
        if not found.success or not np.all(np.isfinite(found.y[:, -1])):
            raise SolveError(f"the flow ends at {found.t[-1]:.6g}", where="Flow.integrated")
        return {self.space.shown(one): float(value) for one, value in zip(self.space.own, found.y[:, -1], strict=True)}

    @cached_property
    def _rates(self) -> list[Sympy]:
        return [-bracket(self.function, one, self.space) for one in self.space.own]

    def __repr__(self) -> str:
        told = "exact" if self.order is None else f"to order {self.order}"
        return f"<Flow of {text_of(self.space.shown(self.function))} by {self.parameter}, {told}>"


@takes(
    f=EXPRESSION,
    space=PHASE_SPACE,
    s=EXPRESSION,
    order=optional(whole("an order of 1 or more", 1)),
    constants=SYMBOLS,
)
def flow_of(f: Any, space: Space, s: Any, order: int | None = None, *, constants: Sequence[Any] = ()) -> Flow:
    """Return the flow that a function generates: ``e^(-s D_f)`` with ``D_f g = {f, g}``.

    Of order 1 it is the infinitesimal canonical transformation ``delta q = s df/dp``, ``delta p = -s df/dq``
    (Goldstein, equation 9.100).

    Parameters
    ----------
    f
        What generates it: a momentum shifts, an angular momentum turns, H leads along motions.
    space
        What `atwood.hamiltonian` returns, or a pair: coordinates and momenta.
    s
        How far: a symbol, or an expression of parameters.
    order
        The highest power of s; if it is not given the flow is exact.
    constants
        See `poisson_bracket`.

    Raises
    ------
    UsageError
        If f holds what is neither coordinate nor momentum, parameter nor time.
    UnsupportedError
        If no closed form is found: where repeated brackets lead to ever new functions.
    """
    found = phase_space_of(space)
    read = found.declared(f, (*constants, *s.free_symbols))
    if s.has(*found.own):
        raise UsageError(f"{s} depends on coordinates or momenta", where="flow_of", advice="Give a symbol, such as s.")
    if order is not None:
        values = tuple(_series(read, one, found, s, order) for one in found.own)
    else:
        values = _closed(read, found, s)
    return Flow(found, read, s, order, values)


def _series(f: Sympy, g: Sympy, space: PhaseSpace, s: Sympy, order: int) -> Sympy:
    """Return the sum of ``(-s D_f)^k g / k!``."""
    total, term = g, g
    for k in range(1, order + 1):
        term = short(-bracket(f, term, space) / k)
        total += s**k * term
    return total


def _closed(f: Sympy, space: PhaseSpace, s: Sympy) -> tuple[Sympy, ...]:
    """Return where a flow leads all coordinates and momenta, as linear equations among finitely many functions."""
    own = space.own
    if f.xreplace({one: sympy.Dummy(real=True) for one in f.free_symbols}).has(sympy.Abs, sympy.sign):
        raise UnsupportedError(
            f"{space.shown(f)} has a magnitude, so that its flow is another formula on each side",
            where="flow_of",
            advice="Integrate in numbers: flow_of(..., order=1).integrated(...).",
        )
    functions: list[Sympy] = list(own)
    rows: list[dict[Sympy, Sympy]] = []
    while len(rows) < len(functions):
        row: dict[Sympy, Sympy] = {}
        for term in sympy.Add.make_args(sympy.expand(-bracket(f, functions[len(rows)], space))):
            factor, part = term.as_independent(*own, as_Add=False)
            row[part] = row.get(part, 0) + factor
        rows.append({part: factor for part, factor in row.items() if factor != 0})
        functions += [part for part in rows[-1] if part not in functions]
        if len(functions) > _CLOSED:
            raise UnsupportedError(
                f"repeated brackets with {space.shown(f)} lead to ever new functions, so that no closed form is found",
                where="flow_of",
                advice="Give an order for the series, or integrate in numbers: flow_of(..., order=1).integrated(...).",
            )
    matrix = sympy.Matrix([[row.get(one, 0) for one in functions] for row in rows])
    start = sympy.Matrix(functions)
    return tuple(short(_moved(matrix, start, k, s)) for k in range(len(own)))


def _moved(matrix: Sympy, start: Sympy, number: int, s: Sympy) -> Sympy:
    """Return an entry of ``e^(s A) z``, by the roots of the smallest polynomial that takes its row to zero."""
    row = sympy.zeros(1, matrix.rows)
    row[0, number] = 1
    powers, x = [row], sympy.Dummy("x")
    while True:
        following = powers[-1] * matrix
        weights = sympy.symbols(f"w0:{len(powers)}")
        total = sum((w * one for w, one in zip(weights, powers, strict=True)), sympy.zeros(1, matrix.rows))
        found = list(sympy.linsolve(list(following - total), weights))
        if found:
            break
        powers.append(following)
    free = dict.fromkeys(weights, 0)
    polynomial = sympy.Poly(x ** len(powers) - sum(w.subs(free) * x**k for k, w in enumerate(found[0])), x)
    letters = sorted({*polynomial.free_symbols_in_domain, *s.free_symbols}, key=str)
    positive = {one: sympy.Dummy(one.name, positive=True) for one in letters}
    back = {own: one for one, own in positive.items()}
    roots = sympy.roots(polynomial.xreplace(positive), x)
    if sum(roots.values()) != len(powers) or any(map(_is_nested, roots)):
        raise UnsupportedError("the rates of its linear equations have no closed form", where="flow_of")
    # Roots and waves are letters until the end: nothing with a root under a root, or a wave, comes below a line.
    equations, right, way = [], [], s.xreplace(positive)
    letter, waves = dict[Sympy, Sympy](), dict[Sympy, Sympy]()
    for root, times in roots.items():
        own = -letter[-root] if -root in letter else sympy.Dummy() if root != 0 else root
        letter[root] = own
        wave = _wave(root, -root in roots, -root in letter, way, waves)
        for k in range(times):
            equations.append([sympy.diff(x**i, x, k).subs(x, own) for i in range(len(powers))])
            right.append(way**k * wave)
    shares = sympy.Matrix(equations).LUsolve(sympy.Matrix(right))
    root_of = {own: root for root, own in letter.items() if own.is_Symbol}
    bare = dict.fromkeys(waves, sympy.Integer(0))
    places = [(one * start)[0, 0].xreplace(positive) for one in powers]
    total = sympy.Integer(0)
    for wave, value in (None, sympy.Integer(1)), *waves.items():
        parts = [one.xreplace(bare) if wave is None else one.diff(wave) for one in shares]
        found = sum(sympy.cancel(part).xreplace(root_of) * one for part, one in zip(parts, places, strict=True))
        made = sympy.factor(found * value)
        total += sympy.expand(made) if value.has(sympy.I) else made
    return total.xreplace(back)


def _wave(root: Sympy, is_paired: bool, is_second: bool, way: Sympy, waves: dict[Sympy, Sympy]) -> Sympy:
    """Return ``e^(root s)`` in letters for what it is made of, which are added to those that are known."""
    if root == 0:
        return sympy.Integer(1)
    if not is_paired:
        own = sympy.Dummy()
        value = sympy.exp(root * way)
        waves[own] = value.rewrite(sympy.cos) if root.has(sympy.I) else value
        return own
    values = sympy.cosh(root * way), sympy.sinh(root * way)
    if is_second:
        known = {value: one for one, value in waves.items()}
        return known[values[0]] - known[-values[1]]
    both = sympy.Dummy(), sympy.Dummy()
    waves |= dict(zip(both, values, strict=True))
    return sum(both)


def _is_nested(root: Sympy) -> bool:
    """Return whether roots stand under roots, so that what follows would fill pages."""
    powers = [one for one in root.atoms(sympy.Pow) if not one.exp.is_Integer]
    return any(inner != one and one.base.has(inner) for one in powers for inner in powers)


# -- the algebra of several functions ----------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Algebra(Shown):
    """The brackets of several functions with each other, in terms of these functions.

    Attributes
    ----------
    names
        A symbol for each function.
    functions
        The functions.
    brackets
        ``{f_i, f_j}``, in terms of the names where it is a polynomial of second degree in the functions, else in
        coordinates and momenta; shape (functions, functions).
    closes
        Whether every bracket is a combination of the functions and a number.
    left_over
        The pairs of which the bracket is no polynomial of second degree in the functions.
    """

    names: tuple[Sympy, ...]
    functions: tuple[Sympy, ...]
    brackets: Sympy
    closes: bool
    left_over: tuple[tuple[str, str], ...]

    def latex(self) -> str:
        """Return the table of brackets in LaTeX."""
        head = " & ".join(["", *map(latex_of, self.names)])
        rows = [" & ".join([latex_of(name), *map(latex_of, self.brackets.row(k))]) for k, name in enumerate(self.names)]
        ruled = " \\\\\n".join(rows)
        return f"\\begin{{array}}{{c|{'c' * len(rows)}}}\n{head} \\\\ \\hline\n{ruled}\n\\end{{array}}"

    def tables(self) -> tuple[Table, ...]:
        """Return the table of brackets, and what the functions are."""
        rows = [(text_of(name), *map(text_of, self.brackets.row(k))) for k, name in enumerate(self.names)]
        said = "they close: an algebra" if self.closes else "they do not close linearly"
        known = [(text_of(name), text_of(one)) for name, one in zip(self.names, self.functions, strict=True)]
        below = [said, *(f"{{{a}, {b}}} is none of these" for a, b in self.left_over)]
        return (
            table(("", "~"), known, "functions"),
            table(("{row, column}", *map(text_of, self.names)), rows, "brackets", ["; ".join(below)]),
        )

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        rows = [[str(one) for one in self.brackets.row(k)] for k in range(len(self.names))]
        functions = {str(name): str(one) for name, one in zip(self.names, self.functions, strict=True)}
        return {"functions": functions, "brackets": rows, "closes": self.closes, "left_over": list(self.left_over)}

    def __repr__(self) -> str:
        return f"<Algebra of {', '.join(map(str, self.names))}: {'closes' if self.closes else 'does not close'}>"


@takes(hamiltonian=PHASE_SPACE, names=SYMBOLS, functions=EXPRESSIONS, constants=SYMBOLS)
def bracket_algebra(
    hamiltonian: Space, names: Sequence[Any] = (), functions: Sequence[Any] = (), *, constants: Sequence[Any] = ()
) -> Algebra:
    """Return the brackets of functions with each other in terms of these functions: whether they are an algebra.

    Of conserved quantities, all brackets are conserved (Poisson's theorem; Goldstein, section 9.7), and what is left
    over is a further constant of the motion.

    Parameters
    ----------
    hamiltonian, constants
        See `poisson_bracket`.
    names
        A symbol for each function.
    functions
        The functions, such as the three components of an angular momentum; all that a scene conserves if there are no
        names and no functions.

    Raises
    ------
    UsageError
        If there are not as many names as functions.
    """
    if isinstance(hamiltonian, Hamiltonian) and not names and not functions:
        names, functions = _conserved(hamiltonian)
    if len(names) != len(functions) or not names:
        raise UsageError(f"{len(names)} names for {len(functions)} functions", where="bracket_algebra")
    space = phase_space_of(hamiltonian)
    read = [space.declared(one, constants) for one in functions]
    terms = dict(zip(names, read, strict=True))
    linear = [sympy.Integer(1), *names]
    products = [a * b for a, b in combinations_with_replacement(names, 2)]
    n = len(read)
    found, left, closes = sympy.zeros(n, n), [], True
    for i, j in combinations(range(n), 2):
        value = bracket(read[i], read[j], space)
        if vanishes([value]).proven:
            continue
        told = _multiple(value, {one: one.xreplace(terms) for one in (*linear, *products)}, space)
        for basis in (linear, [*linear, *products]):
            told = told or _combination(value, {one: one.xreplace(terms) for one in basis}, space)
        closes = closes and told is not None and sympy.Poly(told, *names).total_degree() < 2
        if told is None:
            told = short(value)
            left.append((str(names[i]), str(names[j])))
            told = space.shown(told)
        found[i, j], found[j, i] = told, -told
    shown = tuple(space.shown(one) for one in read)
    return Algebra(tuple(names), shown, sympy.ImmutableMatrix(found), closes, tuple(left))


def _conserved(h: Hamiltonian) -> tuple[list[Sympy], list[Sympy]]:
    """Return names of all that a scene conserves, and what it is in terms of coordinates and momenta."""
    t = sympy.Symbol("t")
    velocities = {q.diff(t): rate for q, rate in zip(h.coordinates, h.equations[0], strict=True)}
    found, h_space = conserved(h.assembly), phase_space_of(h)
    names = [
        sympy.Symbol(one.name.partition(":")[0].replace(".", "_") + f"_{k}" * (":" in one.name))
        for k, one in enumerate(found)
    ]
    return names, [h_space.shown(short(h_space.read(one.expression.xreplace(velocities)))) for one in found]


def _multiple(value: Sympy, basis: Mapping[Sympy, Sympy], space: PhaseSpace) -> Sympy | None:
    """Return a value as a multiple of one function, by its name; None if it is none."""
    own = space.own
    others = sorted(value.free_symbols.union(*(one.free_symbols for one in basis.values())) - set(own), key=str)
    numbers = {x: sympy.Rational(5 + 2 * k, 3 + k) for k, x in enumerate(others)}
    points = [{x: sympy.Rational(n + 3 * k * k + 5, 7 + 2 * k + 3 * n) for k, x in enumerate(own)} for n in range(3)]
    aims = [value.xreplace(point) for point in points]
    for name, one in basis.items():
        own_values = [one.xreplace(point) for point in points]
        ratios = [
            (aim.xreplace(numbers) / below.xreplace(numbers)).evalf(20) if below != 0 else sympy.nan
            for aim, below in zip(aims, own_values, strict=True)
        ]
        if all(abs(ratio - ratios[0]) < 1e-15 * abs(ratios[0]) for ratio in ratios[1:] if ratio.is_number) and not any(
            ratio.has(sympy.nan) for ratio in ratios
        ):
            share = sympy.cancel(sympy.expand(sympy.together(aims[0] / own_values[0])))
            if vanishes([value - share * one]).proven:
                return share * name
    return None


def _combination(value: Sympy, basis: Mapping[Sympy, Sympy], space: PhaseSpace) -> Sympy | None:
    """Return a value as a sum of functions with coefficients of parameters, by their names; None if it is none."""
    own = space.own
    weights = [sympy.Dummy(f"w{k}") for k in range(len(basis))]
    equations: dict[Sympy, Sympy] = {}
    whole = value - sum(w * one for w, one in zip(weights, basis.values(), strict=True))
    for term in sympy.Add.make_args(sympy.expand(sympy.fraction(sympy.together(whole))[0])):
        factor, part = term.as_independent(*own, as_Add=False)
        equations[part] = equations.get(part, 0) + factor
    found = list(sympy.linsolve(list(equations.values()), weights))
    if not found:
        return None
    made = [one.xreplace(dict.fromkeys(weights, sympy.Integer(0))) for one in found[0]]
    off = value - sum(c * one for c, one in zip(made, basis.values(), strict=True))
    return sympy.Add(*(c * name for c, name in zip(made, basis, strict=True))) if vanishes([off]).proven else None
