"""Complete integrals of the equation of Hamilton and Jacobi: W as a sum of functions of one coordinate each.

H = E, times a function of the coordinates, is brought to a sum of terms of one coordinate and its momentum each, or of
groups that separate further (Landau and Lifshitz, Mechanics, section 48). Each group but one is a constant of the
motion.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

from atwood.errors import UnsupportedError
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy
from atwood.theory.formulas.printers import Sympy
from atwood.theory.hamiltonian.closed_forms import Quadrature
from atwood.theory.hamiltonian.tidied import length, tidied, written_by

Pairs = Sequence[tuple[Sympy, Sympy]]


@dataclass(frozen=True, eq=False)
class SeparatedPart:
    """The function ``W_i`` of one coordinate: ``p_i = dW_i/dq_i = shift +- sqrt(R)``.

    Attributes
    ----------
    coordinate
        Its symbol.
    shift
        What the momentum is at turning points.
    quadrature
        The root.
    energy
        The constant that is the energy of this coordinate alone, if it has one.
    """

    coordinate: Sympy
    shift: Sympy
    quadrature: Quadrature
    energy: Sympy | None

    def function(self, constant: Sympy | None = None) -> Sympy:
        """Return ``W_i``, or its derivative by a constant."""
        by = self.shift if constant is None else self.shift.diff(constant)
        moved = sympy.integrate(by, self.coordinate) if by.is_polynomial(self.coordinate) else None
        moved = sympy.Integral(by, self.coordinate) if moved is None else moved
        return moved + self.quadrature.integral(constant)

    def __repr__(self) -> str:
        return f"<SeparatedPart of {self.coordinate}>"


@dataclass(frozen=True, eq=False)
class CompleteIntegral:
    """A complete integral of ``H(q, dW/dq) = E``, where momenta rise with coordinates; roots have the signs of momenta.

    Attributes
    ----------
    energy
        E in terms of the constants.
    ignorable
        Ignorable coordinates with their momenta, which are constants.
    parts
        The functions of the others.
    constants
        What each constant is in terms of coordinates, momenta, and constants before it.
    """

    energy: Sympy
    ignorable: Pairs
    parts: tuple[SeparatedPart, ...]
    constants: Mapping[Sympy, Sympy]

    @cached_property
    def characteristic(self) -> Sympy:
        """W, as a sum."""
        return sympy.Add(*(p * q for q, p in self.ignorable), *(one.function() for one in self.parts))

    @property
    def principal(self) -> Sympy:
        """``S = W - E t``."""
        return self.characteristic - self.energy * sympy.Symbol("t")

    @cached_property
    def betas(self) -> dict[Sympy, Sympy]:
        """What stays the same on a motion, besides the constants: ``beta = dS/dalpha``, by constant."""
        found = {}
        for constant in self.constants:
            own = sympy.Add(*(q for q, p in self.ignorable if p == constant))
            own -= self.energy.diff(constant) * sympy.Symbol("t")
            found[constant] = own + sympy.Add(*(one.function(constant) for one in self.parts))
        return found

    @cached_property
    def motion(self) -> dict[Sympy, Sympy]:
        """Coordinates as functions of time, counted from a turning point: those that have an energy of their own."""
        t, found = sympy.Symbol("t"), {}
        for one in self.parts:
            since = t - sympy.Symbol(f"t_{one.coordinate}")
            made = None if one.energy is None else one.quadrature.inverse(one.energy, since)
            if made is not None and one.shift == 0:
                found[one.coordinate] = made
        return found

    @cached_property
    def actions(self) -> dict[Sympy, Sympy]:
        """Action variables ``J_i``, integrals of p_i over a libration, of coordinates whose integrals are residues."""
        made = ((one.coordinate, one.quadrature.turn()) for one in self.parts if one.shift == 0)
        return {q: one for q, one in made if one is not None}

    def __repr__(self) -> str:
        return f"<CompleteIntegral with constants {', '.join(map(str, self.constants))}>"


def complete_integral(
    h: Sympy, pairs: Pairs, values: Mapping[Sympy, float], state: Mapping[Sympy, float], name: str
) -> CompleteIntegral:
    """Return a complete integral; refuse what does not separate with what is left over."""
    ignorable = [(q, p) for q, p in pairs if not h.has(q)]
    constants = {p: p for _, p in ignorable}
    made: dict[Sympy, tuple[Sympy, Sympy | None]] = {}
    group = [(q, p) for q, p in pairs if h.has(q)]
    ways = [sympy.Add.make_args(one) for one in (h, sympy.expand(h))]
    terms = max(ways, key=lambda one: (len(_groups(one, group)), not all(_in(term, group) for term in one), -len(one)))
    groups = _groups(terms, group)
    total = sympy.Add(*(one for one in terms if not _in(one, group)))
    for part in groups:
        named = [] if len(groups) == 1 and total == 0 else [str(q) for q, _ in part]
        own = sympy.Symbol("_".join(["E" if sympy.Symbol("E") not in h.free_symbols else "h", *named]))
        constants[own] = sympy.Add(*(one for one in terms if _in(one, group) & {q for q, _ in part}))
        total += own
        _separate(constants[own] - own, part, own, constants, made, own, name)
    known = {one: float(value) for one, value in {**values, **state}.items()}
    for one, whole in constants.items():
        known[one] = float(whole.xreplace(known))
    parts = []
    for q, p in group:
        whole, energy = made[q]
        a, b = whole.diff(p, 2) / 2, whole.diff(p).xreplace({p: sympy.Integer(0)})
        if a.has(p) or a == 0:
            raise UnsupportedError(f"H is not quadratic in {p}", where=name, advice="Use `motion`, in numbers.")
        rest = whole.xreplace({p: sympy.Integer(0)})
        pieces = [(b / (2 * a)) ** 2, *(-one / a for one in sympy.Add.make_args(rest))]
        square = sympy.Add(*pieces)
        others = sympy.Add(*map(tidied, pieces)), sympy.collect(sympy.expand(square), q, tidied)
        root = min((sympy.expand(tidied(square)), *others), key=length)
        parts.append(SeparatedPart(q, tidied(-b / (2 * a)), Quadrature(root, q, known), energy))
    return CompleteIntegral(total, tuple(ignorable), tuple(parts), constants)


def _separate(
    whole: Sympy,
    group: Pairs,
    energy: Sympy | None,
    constants: dict[Sympy, Sympy],
    made: dict[Sympy, tuple[Sympy, Sympy | None]],
    total: Sympy,
    name: str,
) -> None:
    """Write an equation, zero, as one for each coordinate, with a new constant for each but one."""
    if len(group) == 1:
        made[group[0][0]] = whole, energy
        return
    least: list[Sympy] = []
    slopes = [whole.diff(p, 2) for _, p in group]
    factors = [2 / one for one in slopes if one != 0 and not one.has(*(p for _, p in group))]
    for factor in dict.fromkeys(factors):
        every = (one for term in sympy.Add.make_args(sympy.expand(whole)) for one in _expanded(term * factor, group))
        terms = sympy.Add.make_args(sympy.Add(*every))
        parts = _groups(terms, group)
        if len(parts) > 1:
            break
        mixed = [one for one in terms if len(_in(one, group)) > 1]
        least = mixed if not least or len(mixed) < len(least) else least
    else:
        told = ", ".join(map(str, sorted(least, key=length)[:3]))
        raise UnsupportedError(
            f"the equation of Hamilton and Jacobi does not separate: {told} is left over",
            where=name,
            advice="Try other coordinates.",
        )
    sums = [sympy.Add(*(one for one in terms if _in(one, group) & {q for q, _ in part})) for part in parts]
    last = max(range(len(parts)), key=lambda k: (sums[k].has(total), k))
    rest = sympy.Add(*(one for one in terms if not _in(one, group))) + sums[last]
    for k, part in enumerate(parts):
        if k != last:
            constant = sympy.Symbol("_".join(["alpha", *(str(q) for q, _ in part)]))
            sums[k] = sympy.collect(sums[k], [*constants, *(p for _, p in group)], tidied)
            constants[constant] = sums[k]
            rest += constant
            _separate(sums[k] - constant, part, None, constants, made, total, name)
    _separate(rest, parts[last], None, constants, made, total, name)


def _in(term: Sympy, group: Pairs) -> set[Sympy]:
    return {q for q, p in group if term.has(q) or term.has(p)}


def _expanded(term: Sympy, group: Pairs) -> list[Sympy]:
    """Return the terms of a term, written so that fewest have more than one coordinate."""
    ways = [[*sympy.Add.make_args(sympy.expand(written_by(term, way)[0]))] for way in (True, False)]
    return min(ways, key=lambda terms: (sum(len(_in(one, group)) > 1 for one in terms), len(terms)))


def _groups(terms: Sequence[Sympy], group: Pairs) -> list[list[tuple[Sympy, Sympy]]]:
    """Return coordinates in groups that no term joins."""
    joined = [_in(one, group) for one in terms]
    edges = [(a, b) for one in joined for a in one for b in one if a != b]
    found = sympy.utilities.iterables.connected_components(([q for q, _ in group], edges))
    return [[(q, p) for q, p in group if q in one] for one in found]
