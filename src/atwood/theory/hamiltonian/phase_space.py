"""Functions on phase space in sympy: read from arguments, brought to one form, and tested for being zero."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from atwood.arguments import Kind, Refused, each, instance, optional
from atwood.errors import AtwoodError, UsageError, suggestion
from atwood.expr import Expression, Graph, sqrt
from atwood.expr.simplify.polynomial import TooLargeError
from atwood.expr.sympy_bridge import from_sympy
from atwood.lazy_dataclasses import dataclass, replace
from atwood.lazy_modules import mpmath, sympy
from atwood.theory.formulas.book import Book
from atwood.theory.formulas.printers import Sympy, objects
from atwood.theory.formulas.tree import Name, Symbol
from atwood.theory.hamiltonian.hamiltonian import Hamiltonian, read_hamiltonian
from atwood.theory.hamiltonian.tidied import length
from atwood.theory.symmetry.proof import is_proven_zero

_POINTS, _DIGITS = 8, 50
"""Where there is no proof: at so many random points, with so many digits."""

_BOUND = 1e-30
"""Relative to the largest of its terms: what is less is zero at these points, to those digits."""


@dataclass(frozen=True, eq=False)
class PhaseSpace:
    """Coordinates and momenta as plain symbols, so that functions of them can be differentiated by time as well.

    Attributes
    ----------
    coordinates, momenta
        The symbols that stand for them.
    given
        What they were: functions of t, or symbols.
    parameters
        The symbols of a scene's parameters; None where any symbol may be one.
    """

    coordinates: tuple[Sympy, ...]
    momenta: tuple[Sympy, ...]
    given: tuple[Sympy, ...]
    parameters: tuple[Sympy, ...] | None = None

    def read(self, value: Sympy, new: Sequence[Sympy] = ()) -> Sympy:
        """Return an expression on the plain symbols; a symbol with the name of one of the given stands for it."""
        found = value.xreplace(dict(zip(self.given, self.own, strict=True)))
        named = {sympy.Symbol(_plain(given)): own for given, own in zip(self.given, self.own, strict=True)}
        found = spelled(found, (*named, *(self.parameters or ())), new)
        found = found.xreplace({name: own for name, own in named.items() if name not in new})
        stray = found.atoms(sympy.Derivative) | found.atoms(sympy.core.function.AppliedUndef)
        if stray:
            names = ", ".join(map(str, self.given))
            raise UsageError(
                f"{sorted(map(str, stray))[0]} is neither a coordinate nor a momentum",
                where=str(value)[:80],
                advice=f"Write it in {names}, parameters and t.",
            )
        return found

    def declared(self, value: Sympy, constants: Sequence[Sympy] = ()) -> Sympy:
        """Return an expression on the plain symbols; refuse a symbol that is no parameter and was not declared."""
        found = self.read(value)
        if self.parameters is None:
            return found
        known = {*self.own, *self.parameters, *constants, sympy.Symbol("t")}
        for name in sorted(map(str, found.free_symbols - known)):
            near = suggestion(name, [_plain(one) for one in (*self.given, *self.parameters)])
            raise UsageError(
                f"{name} is neither a coordinate nor a momentum nor a parameter of the scene",
                where=str(value)[:80],
                advice=near or f"Take {', '.join(map(_plain, self.given))}, or declare it: constants=[{name!r}].",
            )
        return found

    def shown(self, value: Sympy) -> Sympy:
        """Return an expression in what coordinates and momenta were."""
        return value.xreplace(dict(zip(self.own, self.given, strict=True)))

    @property
    def own(self) -> tuple[Sympy, ...]:
        """Coordinates, then momenta."""
        return (*self.coordinates, *self.momenta)


def phase_space_of(given: Hamiltonian | tuple[Sequence[Sympy], Sequence[Sympy]]) -> PhaseSpace:
    """Return the phase space of a Hamiltonian, or of a pair: coordinates and momenta."""
    q, p = given if isinstance(given, (tuple, list)) else (given.coordinates, given.momenta)
    q, p = tuple(q), tuple(p)
    if len(q) != len(p) or not q or len({*q, *p}) != 2 * len(q):
        advice = "Give as many momenta as coordinates, all different."
        raise UsageError(
            f"{len(q)} coordinates and {len(p)} momenta are no phase space", where=f"{q}, {p}"[:80], advice=advice
        )
    for one in (*q, *p):
        if not one.is_Symbol and not isinstance(one, sympy.core.function.AppliedUndef):
            advice = "Give symbols of sympy, or functions of t."
            raise UsageError(f"{one} is no coordinate and no momentum", where="phase space", advice=advice)
    own = [sympy.Symbol(_plain(one)) if one.is_Symbol else sympy.Dummy(_plain(one)) for one in (*q, *p)]
    n = len(q)
    parameters = None if isinstance(given, (tuple, list)) else tuple(map(objects.letter, given.formulas.legend))
    return PhaseSpace(tuple(own[:n]), tuple(own[n:]), (*q, *p), parameters)


def _plain(one: Sympy) -> str:
    return str(one.func) if one.args else str(one)


# -- one form, and whether it is zero ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class Verdict:
    """Whether expressions are zero, and how that is known.

    Attributes
    ----------
    holds
        Whether they are.
    proven
        Whether that is proven for all values.
    bound
        Where it is not: the largest value at random points, relative to the largest of the terms.
    """

    holds: bool
    proven: bool
    bound: float

    @property
    def sentence(self) -> str:
        """The same in words."""
        if self.proven:
            return "proven for all values"
        told = f"{self.bound:.1e} of its terms at {_POINTS} random points"
        return f"not proven: at most {told}" if self.holds else f"off by {told}"


_LONG = 600
"""Signs beyond which fractions are left as they are."""


_FACTORED = 150
"""Signs beyond which coefficients are not factored."""


def vanishes(values: Iterable[Sympy]) -> Verdict:
    """Return whether expressions are all zero: by their normal form, or else at random points in many digits."""
    rest = [one for one in values if one != 0 and not _is_proven(one)]
    if not rest:
        return Verdict(True, True, 0.0)
    worst = max(_relative_size(one) for one in rest)
    return Verdict(worst <= _BOUND, False, worst)


def _is_proven(value: Sympy) -> bool:
    symbols = sorted(value.free_symbols, key=str)  # two of them may have one name
    value = value.xreplace({one: sympy.Symbol(f"s{k}") for k, one in enumerate(symbols)})
    plain, roots = _with_roots(value)
    try:
        graph, known = Graph(), dict[Sympy, Expression]()
        for one, base in roots.items():
            known[one] = graph.convert(sqrt(from_sympy(base, graph, known)))
        made = from_sympy(plain, graph, known)
    except (AtwoodError, TypeError):  # a function that programs have not, or a number that is not real
        return False
    return is_proven_zero(made, [graph.symbol(one.name) for one in _in_waves(value)])


def _with_roots(value: Sympy) -> tuple[Sympy, dict[Sympy, Sympy]]:
    """Return an expression with symbols in place of square roots, and what is under each, of earlier ones."""
    roots: dict[Sympy, Sympy] = {}
    known: dict[Sympy, Sympy] = {}

    def taken(power: Sympy) -> Sympy:
        if power.base not in known:
            known[power.base] = sympy.Dummy(f"root{len(known)}", positive=True)
            roots[known[power.base]] = min(_as_written(power.base), _cancelled(power.base), key=length)
        return known[power.base] ** (2 * power.exp)

    plain = value.replace(lambda one: one.is_Pow and one.exp.is_Rational and one.exp.q == 2, taken)
    return plain, roots


def _cancelled(value: Sympy) -> Sympy:
    """Return a rational function in lowest terms; other things as they are."""
    try:
        return sympy.cancel(value) if value.count_ops() <= _LONG else value
    except sympy.PolynomialError:
        return value


def collected(value: Sympy, variables: Sequence[Sympy]) -> Sympy:
    """Return what is a polynomial in some symbols with each of its coefficients as short as it comes."""
    plain, roots = _with_roots(value)
    if not plain.is_polynomial(*variables) or any(one.has(*variables) for one in roots.values()):
        return short(value)
    back = {root: sympy.sqrt(base) for root, base in roots.items()}
    terms = sympy.Poly(plain, *variables).terms()
    found = []
    for powers, coefficient in terms:
        factor = sympy.Mul(*(one**power for one, power in zip(variables, powers, strict=True)))
        made = min(short(coefficient), short(_cancelled(coefficient)), key=length)
        if length(made) <= _FACTORED and not made.atoms(sympy.Float):
            made = min(made, sympy.factor(made), key=length)
        found.append(made.xreplace(back) * factor)
    return sympy.Add(*found)


def _in_waves(value: Sympy) -> list[Sympy]:
    """Return the symbols in arguments of sines and cosines."""
    inside = [one.free_symbols for one in value.atoms(sympy.sin, sympy.cos)]
    return sorted(set().union(*inside), key=str)


def _relative_size(value: Sympy) -> float:
    """Return the largest value at random points, relative to the terms that it is the sum of."""
    import random

    numbers = random.Random(19)
    terms = sympy.Add.make_args(sympy.expand(value))
    symbols = sorted(value.free_symbols, key=str)
    integrals = set().union(*(one.atoms(sympy.Integral) for one in terms))
    integrated = {one: sympy.lambdify(symbols, one, "mpmath") for one in integrals}
    worst = 0.0
    for _ in range(_POINTS):
        point = {one: sympy.Rational(numbers.randint(3000, 19000), 10000) for one in symbols}
        with mpmath.workdps(_DIGITS):
            numbers_there = [mpmath.mpf(one.p) / one.q for one in point.values()]
            point |= {one: sympy.sympify(known(*numbers_there)) for one, known in integrated.items()}
        found = [one.xreplace(point).evalf(_DIGITS) for one in terms]
        size = max(map(abs, found), default=0)
        if size:
            ratio = sympy.N(abs(sum(found)) / size)
            worst = max(worst, float(ratio) if ratio.is_Float or ratio.is_Rational else float("inf"))  # nan, zoo
    return worst


def on_branch(value: Sympy, sign: int = 1, arcs: bool = True) -> Sympy:
    """Return an expression on the branch where all its symbols are positive, as a formula that goes on from there.

    Roots are those of factors, arcs of sines and cosines become arcs of tangents, which hold in all quadrants that a
    path leads to (unless `arcs` is false), and a root of the square of a sine or cosine is this times the sign.
    """
    if value.has(sympy.Integral):
        return value
    positive = {one: sympy.Dummy(one.name, positive=True) for one in value.free_symbols}
    back = {own: one for one, own in positive.items()}
    all_round = sympy.Function("all_round")  # which is no arc of a tangent where signs are not known
    made = value.replace(sympy.atan2, all_round).xreplace(positive)
    if arcs:
        made = made.replace(sympy.asin, lambda x: sympy.atan(x / sympy.sqrt(1 - x**2)))
        made = made.replace(sympy.acos, lambda x: sympy.atan(sympy.sqrt(1 - x**2) / x))
        made = made.replace(sympy.acot, lambda x: sympy.atan(1 / x))
        made = made.replace(sympy.cot, lambda x: sympy.cos(x) / sympy.sin(x))
    for _ in range(_ROUNDS):
        before, made = made, made.replace(_is_root, _split_root).replace(sympy.Abs, lambda x: sign * x)
        made = made.replace(
            lambda one: one.func is sympy.atan, lambda one: sympy.atan(_with_roots_cancelled(one.args[0]))
        )
        if made == before:
            break
    # Roots of single symbols are symbols, so that at most one root is left in most formulas.
    single = [one.base for one in made.atoms(sympy.Pow) if _is_root(one) and one.base.is_Symbol]
    roots = {one: sympy.Dummy(one.name, positive=True) for one in single}
    made = _with_roots_cancelled(made.xreplace({one: root**2 for one, root in roots.items()}))
    made = made.xreplace({root: sympy.sqrt(one) for one, root in roots.items()}).xreplace(back)
    return short(made.replace(all_round, sympy.atan2))


_ROUNDS = 4
"""So often roots that stand inside each other are looked into."""


def _is_root(one: Sympy) -> bool:
    return bool(one.is_Pow and one.exp.is_Rational and one.exp.q == 2)


def _split_root(power: Sympy) -> Sympy:
    """Return a root as the product of the roots of its factors."""
    above, below = (sympy.factor(_squares(one)) for one in sympy.fraction(sympy.together(power.base)))
    return above**power.exp / below**power.exp


def _squares(value: Sympy) -> Sympy:
    """Return a sum in which one less the square of a sine or cosine is that of the other."""
    for wave in value.atoms(sympy.sin, sympy.cos):
        [x] = wave.args
        other = sympy.cos(x) if wave.func is sympy.sin else sympy.sin(x)
        if value.has(other):
            value = sympy.expand(sympy.expand(value).subs(sympy.sin(x) ** 2, 1 - sympy.cos(x) ** 2))
        elif value.is_polynomial(wave) and sympy.rem(value, 1 - wave**2, wave) == 0:
            value = sympy.quo(value, 1 - wave**2, wave) * other**2
    return value


def short(value: Sympy) -> Sympy:
    """Return an expression in the shortest of some forms, as equations are written; as it is where it is long."""
    if not value.free_symbols:
        return value
    value = value.replace(sympy.tan, lambda x: sympy.sin(x) / sympy.cos(x))
    return min((_as_written(value), _with_roots_cancelled(value)), key=length)


def _with_roots_cancelled(value: Sympy) -> Sympy:
    """Return a fraction of symbols, functions and square roots without what is above and below.

    What is under a root is put in place of its like.
    """
    if value.count_ops() > _LONG or not value.has(sympy.Pow):
        return value
    plain, roots = _with_roots(value)
    functions = sorted(plain.atoms(sympy.Function), key=lambda one: -one.count_ops())
    stand_ins = {one: sympy.Dummy(f"f{k}") for k, one in enumerate(functions)}
    plain = plain.xreplace(stand_ins)
    try:
        above, below = sympy.fraction(sympy.together(plain))
        if len(roots) == 1:
            [(root, base)] = roots.items()
            relation = sympy.fraction(sympy.together(base.xreplace(stand_ins) - root**2))[0]
            for by in sorted(base.free_symbols, key=str):
                if sympy.degree(relation, by) in (1, 2):
                    above = sympy.rem(sympy.expand(above), relation, by)
                    break
        found = sympy.cancel(above / below)
    except sympy.PolynomialError:
        return value
    back = {own: one for one, own in stand_ins.items()}
    return _as_written(found.xreplace(back)).xreplace({root: sympy.sqrt(base) for root, base in roots.items()})


def _as_written(value: Sympy) -> Sympy:
    """Return an expression as equations are written."""
    if any(one.base.is_number for one in value.atoms(sympy.Pow) if not one.exp.is_Integer):
        return value  # an irrational number would become a decimal
    symbols = sorted(value.free_symbols, key=str)
    stand_ins = [sympy.Symbol(f"s{k}") for k in range(len(symbols))]
    graph = Graph()
    try:
        made = from_sympy(value.xreplace(dict(zip(symbols, stand_ins, strict=True))), graph)
        names = {graph.symbol(one.name): Name(Symbol(one.name)) for one in stand_ins}
        waves = {str(one) for one in _in_waves(value)}
        angles = tuple(graph.symbol(s.name) for one, s in zip(symbols, stand_ins, strict=True) if str(one) in waves)
        written = Book(names, angles, ()).write(made, grouped=True)
    except (AtwoodError, TooLargeError, TypeError):
        return value
    return objects.formula(written).xreplace(dict(zip(stand_ins, symbols, strict=True)))


_LETTERS = ("beta", "gamma", "zeta", "C", "N", "O", "Q", "S")
"""Names that sympy takes for functions and classes of its own where text is read; in mechanics they are symbols."""


def as_expression(value: Any) -> Any:
    """Return an expression of sympy from one, a number, or text of one; raise any error if it is none."""
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
    if isinstance(value, str):
        if not value.isidentifier():
            raise Refused(f"{value!r} is no name.")
        return sympy.Symbol(value)
    if not isinstance(value, sympy.Symbol):
        raise Refused
    return value


def _expressions_by(key: Callable[[Any], Any]) -> Callable[[Any], dict[Any, Any]]:
    def read(value: Any) -> dict[Any, Any]:
        if not isinstance(value, Mapping):
            raise Refused
        return {key(name): as_expression(one) for name, one in value.items()}

    return read


def spelled(value: Sympy, known: Iterable[Sympy], new: Sequence[Sympy] = ()) -> Sympy:
    """Return an expression in which ``m1`` is ``m_1`` where that is known and ``m1`` is not, as it is printed."""
    names = {str(one): one for one in known}
    stray = (one for one in value.free_symbols if str(one) not in names and one not in new)
    figures = re.compile(r"(?<=[A-Za-z])(?=\d)")
    meant = {one: names.get(figures.sub("_", str(one)), one) for one in stray}
    return value.xreplace(meant)


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
BY_SYMBOL = Kind(
    "a dictionary by symbol, of expressions of sympy", _expressions_by(as_symbol), "SYMBOL=EXPRESSION", is_many=True
)
INVERSE = optional(
    Kind(
        "a dictionary of expressions of sympy by old coordinate and momentum",
        _expressions_by(as_expression),
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
