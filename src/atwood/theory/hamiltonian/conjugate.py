"""Legendre transforms of given functions: ``F(p) = p x - f(x)`` with ``p = df/dx``, and where they are.

Slopes p determine x where the second derivatives keep their sign; the transform of the transform is then f again
(Arnold, Mathematical Methods of Classical Mechanics, section 14; Goldstein, section 8.1). Letters other than the
variables are positive.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

from atwood.arguments import Kind, Refused, optional, takes
from atwood.errors import UnsupportedError, UsageError
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy
from atwood.theory.formulas.described import Described
from atwood.theory.formulas.printers import Sympy
from atwood.theory.formulas.reading import text_of
from atwood.theory.hamiltonian.phase_space import EXPRESSION, SYMBOLS, as_expression, as_symbol, short, vanishes
from atwood.theory.hamiltonian.tidied import length
from atwood.theory.hamiltonian.transformations import UNSOLVED


@dataclass(frozen=True, eq=False)
class Conjugate(Described):
    """The Legendre transform of a function.

    Attributes
    ----------
    variables, slopes
        Symbols of x and of p.
    expression
        ``F(p) = p x - f(x)``.
    solved
        x in terms of p, ``dF/dp``.
    ranges
        From where to where each p goes, in words, where that follows from its own variable.
    hessian
        The determinant of the second derivatives of f; beyond where it is zero, slopes belong to other places, too.
    verdict
        Whether ``dF/dp = x`` and ``df/dx = p``, in words.
    """

    variables: tuple[Sympy, ...]
    slopes: tuple[Sympy, ...]
    expression: Sympy
    solved: dict[Sympy, Sympy]
    ranges: dict[str, str]
    hessian: Sympy
    verdict: str


def _between(value: Any) -> dict[Any, Any]:
    if not isinstance(value, Mapping):
        raise Refused
    made = {
        as_symbol(key): tuple(one if one is None else as_expression(one) for one in ends) for key, ends in value.items()
    }
    if any(len(ends) != 2 for ends in made.values()):
        raise Refused
    return made


@takes(
    function=EXPRESSION,
    variables=SYMBOLS,
    slopes=SYMBOLS,
    between=optional(Kind("a dictionary of two ends by variable", _between)),
)
def legendre_transform(
    function: Any,
    variables: Sequence[Any],
    slopes: Sequence[Any] = (),
    *,
    between: Mapping[Any, Sequence[Any]] | None = None,
) -> Conjugate:
    """Return the Legendre transform of a function of one or several variables, and where it is.

    Parameters
    ----------
    function
        f, such as ``"-m*c**2*sqrt(1 - v**2/c**2)"``.
    variables
        Those that are replaced by slopes; others stay as they are.
    slopes
        Symbols of these; ``p_x`` for x if not given.
    between
        Open ranges of variables, such as ``{"v": ("-c", "c")}``, with None for infinity; all real numbers if not given.

    Raises
    ------
    UsageError
        If there are not as many slopes as variables, or second derivatives change their sign: then a slope belongs to
        several places.
    UnsupportedError
        If slopes are not solved for the variables.
    """
    x, given = tuple(variables), between or {}
    p = tuple(slopes) or tuple(sympy.Symbol(f"p_{one.name}") for one in x)
    if not x or len({*x, *p}) != 2 * len(x):
        raise UsageError(f"{len(p)} slopes for {len(x)} variables", where=str(function)[:80])
    stray = [one for one in given if one not in x]
    if stray:
        raise UsageError("it is none of the variables", where=str(stray[0]), advice=f"There are {x}.")
    bounds = {one for pair in given.values() for end in pair if end is not None for one in end.free_symbols}
    others = sorted((function.free_symbols | bounds) - {*x, *p}, key=str)
    positive = {one: sympy.Symbol(one.name, positive=True) for one in others}
    real = {one: sympy.Symbol(one.name, real=True) for one in (*x, *p)}
    back = {own: one for one, own in (*positive.items(), *real.items())}
    f, own, to = function.xreplace({**positive, **real}), [real[one] for one in x], [real[one] for one in p]
    second = sympy.hessian(f, own)
    hessian = short(second.det(method="berkowitz"))
    if hessian == 0:
        raise UsageError(
            "its slopes do not determine its variables: the determinant of second derivatives is zero",
            where=str(function)[:80],
            advice="Take fewer variables: of those in which it is linear there is no transform.",
        )
    ends: dict[Sympy, tuple[Sympy, Sympy]] = {}
    for one, v in zip(x, own, strict=True):
        low, high = given.get(one, (None, None))
        ends[v] = (
            -sympy.oo if low is None else low.xreplace(positive),
            sympy.oo if high is None else high.xreplace(positive),
        )
    at = {one: sympy.Rational(7 + 2 * k, 5 + k) for k, one in enumerate(positive.values())}
    pairs = list(zip(own, to, strict=True))
    told = {text_of(q): _range(f.diff(v), v, ends[v], at) for v, q in pairs} if second.is_diagonal() else {}
    solved = _solved(f, dict(pairs), [{v: _inside(*ends[v], side).xreplace(at) for v in own} for side in (1, 2)], at)
    whole = short(sympy.Add(*(q * solved[v] for v, q in pairs), -f.xreplace(solved)))
    whole = min(whole, sympy.factor(whole), sympy.powsimp(whole), key=length)
    off = [one for v, q in pairs for one in (whole.diff(q) - solved[v], f.diff(v).xreplace(solved) - q)]
    verdict = vanishes(off)
    if not verdict.holds:
        raise UnsupportedError(f"no branch of its slopes is found: {verdict.sentence}", where=str(function)[:80])
    made = {one: solved[real[one]].xreplace(back) for one in x}
    return Conjugate(x, p, whole.xreplace(back), made, told, hessian.xreplace(back), verdict.sentence)


def _solved(
    f: Sympy, slopes: Mapping[Sympy, Sympy], places: Sequence[Mapping[Sympy, Sympy]], at: Mapping[Sympy, Sympy]
) -> dict[Sympy, Sympy]:
    """Return variables in terms of slopes, as they are at some places."""
    try:
        found = sympy.solve([f.diff(v) - q for v, q in slopes.items()], [*slopes], dict=True)
    except UNSOLVED:
        found = []
    known = {q: f.diff(v).xreplace(at) for v, q in slopes.items()}
    every = [one for one in found if set(one) == set(slopes)]
    for one in every:
        if all(_leads_back({v: y.xreplace(at) for v, y in one.items()}, known, place) for place in places):
            return {v: short(y) for v, y in one.items()}
    wanted = ", ".join(f"{text_of(q)} = {text_of(f.diff(v))}" for v, q in slopes.items())
    raise UnsupportedError(
        f"no formula solves these for {', '.join(map(str, slopes))} everywhere: {wanted}",
        where=str(f)[:80],
        advice="Give a smaller range, as between={'x': (0, None)}." if every else "",
    )


def _leads_back(solved: Mapping[Sympy, Sympy], slopes: Mapping[Sympy, Sympy], start: Mapping[Sympy, Sympy]) -> bool:
    """Return whether the slopes at a place lead back to it."""
    known = {q: one.subs(start) for q, one in slopes.items()}
    return all(abs(sympy.N(one.subs(known) - start[v], 30)) < 1e-20 for v, one in solved.items())


def _inside(low: Sympy, high: Sympy, side: int = 1) -> Sympy:
    """Return one of two places between two ends, which may be infinite."""
    third = sympy.Rational(2 * side - 3, 3)
    if low.is_infinite and high.is_infinite:
        return third
    return high - side if low.is_infinite else low + side if high.is_infinite else low + (high - low) * (third + 1) / 2


def _range(slope: Sympy, v: Sympy, ends: tuple[Sympy, Sympy], at: Mapping[Sympy, Sympy]) -> str:
    """Return the range of a slope in words; refuse where it is not monotonic."""
    zeros = sympy.solveset(slope.diff(v), v, sympy.Interval.open(*ends))
    if isinstance(zeros, sympy.FiniteSet):
        places = [ends[0], *sorted(zeros, key=lambda one: float(sympy.N(one.xreplace(at)))), ends[1]]
        middles = (_inside(a, b) for a, b in pairwise(places))
        if len({sympy.sign(slope.diff(v).subs(v, one).xreplace(at)) for one in middles}) > 1:
            told = ", ".join(text_of(one) for one in places[1:-1])
            raise UsageError(
                f"its second derivative by {v} changes its sign at {told}: slopes belong to several places",
                where=str(v),
                advice=f"Give a range on one side: between={{{str(v)!r}: (low, high)}}.",
            )
    try:
        found = [sympy.limit(slope, v, end, way) for end, way in zip(ends, "+-", strict=True)]
    except UNSOLVED:
        return "not known"
    numbers = [sympy.N(one.xreplace(at)) for one in found]
    if not all(one.is_extended_real for one in numbers):
        return "not known"
    known = [number if number.is_infinite else one for one, number in zip(found, numbers, strict=True)]
    return " to ".join(map(text_of, known if numbers[0] <= numbers[1] else known[::-1]))
