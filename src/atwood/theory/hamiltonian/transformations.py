"""Canonical and point transformations, made from generating functions or new coordinates, and Poisson brackets.

They are canonical where ``J Omega J^T = Omega`` with J the derivatives of new coordinates and momenta by the old
(Goldstein, equation 9.55). Where they depend on time, the new Hamiltonian is ``K = H + dF/dt`` (Goldstein, equation
9.12 and table 9.1).

Brackets are those of Goldstein, section 9.5, with his sign: ``{q, p} = 1``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

from atwood.arguments import check, command, takes, whole
from atwood.errors import UnsupportedError, UsageError
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy
from atwood.theory.formulas.described import Described
from atwood.theory.formulas.printers import Sympy
from atwood.theory.hamiltonian.hamiltonian import Hamiltonian
from atwood.theory.hamiltonian.phase_space import (
    BY_SYMBOL,
    EXPRESSION,
    EXPRESSIONS,
    HAMILTONIAN,
    INVERSE,
    PHASE_SPACE,
    SYMBOLS,
    PhaseSpace,
    Verdict,
    on_branch,
    phase_space_of,
    short,
    vanishes,
)

Space = Hamiltonian | tuple[Sequence[Sympy], Sequence[Sympy]]
_KINDS = {1: ("q", "Q"), 2: ("q", "P"), 3: ("p", "Q"), 4: ("p", "P")}


@dataclass(frozen=True, eq=False)
class CanonicalTransformation(Described):
    """New coordinates and momenta in terms of the old ones, and whether they are canonical.

    Attributes
    ----------
    space
        The old coordinates and momenta.
    coordinates, momenta
        Symbols of the new ones.
    new_coordinates, new_momenta
        What they are in terms of the old and of time.
    solved
        What the old ones, on the plain symbols of `space`, are in terms of the new; empty where that is not known.
    old_hamiltonian
        H on the plain symbols of `space`; None where only coordinates and momenta were given.
    added
        ``dF/dt`` in terms of the new ones; None where it is not known.
    """

    space: PhaseSpace
    coordinates: tuple[Sympy, ...]
    momenta: tuple[Sympy, ...]
    new_coordinates: tuple[Sympy, ...]
    new_momenta: tuple[Sympy, ...]
    solved: Mapping[Sympy, Sympy]
    old_hamiltonian: Sympy | None
    added: Sympy | None

    @property
    def inverse(self) -> dict[Sympy, Sympy]:
        """What the old coordinates and momenta are in terms of the new; empty where that is not known."""
        return {self.space.shown(one): value for one, value in self.solved.items()}

    def inverted(self) -> CanonicalTransformation:
        """Return the transformation from the new coordinates and momenta to the old ones.

        Raises
        ------
        UnsupportedError
            If the old coordinates and momenta are not known in terms of the new ones.
        """
        self._refuse_without_inverse()
        n, own = len(self.coordinates), self.space.own
        names = {one: sympy.Symbol(one.name) for one in own}
        values = [self.solved[one].xreplace(names) for one in own]
        new = [self.space.read(one).xreplace(names) for one in (*self.new_coordinates, *self.new_momenta)]
        back = dict(zip((*self.coordinates, *self.momenta), new, strict=True))
        letters = tuple(names[one] for one in own)
        space = PhaseSpace(self.coordinates, self.momenta, (*self.coordinates, *self.momenta))
        added = None if self.added is None else short(-self.added.xreplace(back))
        old = None if self.old_hamiltonian is None else self.hamiltonian
        return CanonicalTransformation(
            space, letters[:n], letters[n:], tuple(values[:n]), tuple(values[n:]), back, old, added
        )

    def then(self, other: CanonicalTransformation) -> CanonicalTransformation:
        """Return this transformation and after it another, which begins with the new coordinates and momenta of this.

        Parameters
        ----------
        other
            The transformation that follows.

        Raises
        ------
        UsageError
            If the other does not begin where this ends.
        """
        names = tuple(map(str, (*self.coordinates, *self.momenta)))
        begun = other.space.own
        if tuple(map(str, begun)) != names:
            raise UsageError(
                f"the second transformation begins with {', '.join(map(str, begun))}",
                where="canonical transformation",
                advice=f"Give one that begins with {', '.join(names)}, in this order.",
            )
        middle = [self.space.read(one) for one in (*self.new_coordinates, *self.new_momenta)]
        where = dict(zip(begun, middle, strict=True))
        values = [
            self.space.shown(short(other.space.read(one).xreplace(where)))
            for one in (*other.new_coordinates, *other.new_momenta)
        ]
        n, solved, added = len(self.coordinates), {}, None
        if self.solved and other.solved:
            on = dict(zip((*self.coordinates, *self.momenta), (other.solved[one] for one in begun), strict=True))
            solved = {one: short(value.xreplace(on)) for one, value in self.solved.items()}
            if self.added is not None and other.added is not None:
                added = short(self.added.xreplace(on) + other.added)
        return CanonicalTransformation(
            self.space,
            other.coordinates,
            other.momenta,
            tuple(values[:n]),
            tuple(values[n:]),
            solved,
            self.old_hamiltonian,
            added,
        )

    def _refuse_without_inverse(self) -> None:
        if not self.solved:
            raise UnsupportedError(
                "the old coordinates and momenta are not known in terms of the new ones",
                where="canonical transformation",
                advice="Give `inverse`.",
            )

    @cached_property
    def matrix(self) -> Sympy:
        """J: derivatives of new coordinates and momenta by the old, shape (2n, 2n)."""
        new = [self.space.read(one) for one in (*self.new_coordinates, *self.new_momenta)]
        old = self.space.own
        return sympy.ImmutableMatrix([[self.space.shown(one.diff(x)) for x in old] for one in new])

    @cached_property
    def verdict(self) -> Verdict:
        """Whether ``J Omega J^T = Omega``, and how that is known."""
        n = len(self.coordinates)
        omega = sympy.zeros(2 * n, 2 * n)
        for k in range(n):
            omega[k, n + k], omega[n + k, k] = 1, -1
        read = self.matrix.applyfunc(self.space.read)
        off = read * omega * read.T - omega
        return vanishes(off[i, j] for i in range(2 * n) for j in range(i))

    @property
    def is_canonical(self) -> bool:
        """Whether it is canonical."""
        return self.verdict.holds

    @cached_property
    def hamiltonian(self) -> Sympy:
        """The new Hamiltonian ``K = H + dF/dt``, in the new coordinates and momenta.

        Raises
        ------
        UsageError
            If the transformation is not canonical, or no Hamiltonian was given.
        UnsupportedError
            If the old coordinates and momenta, or dF/dt, are not known in terms of the new ones.
        """
        if self.old_hamiltonian is None:
            raise UsageError("no Hamiltonian was given", where="canonical transformation", advice="Give one.")
        if not self.is_canonical:
            raise UsageError(
                f"the transformation is not canonical: J Omega J^T is {self.verdict.sentence.removeprefix('off by')} "
                "away from Omega",
                where="canonical transformation",
            )
        if not self.solved or self.added is None:
            raise UnsupportedError(
                "the old coordinates and momenta are not known in terms of the new ones, or dF/dt is not",
                where="canonical transformation",
                advice="Give `inverse`, or a generating function.",
            )
        return short(self.old_hamiltonian.xreplace(dict(self.solved)) + self.added)

    def __repr__(self) -> str:
        told = "canonical" if self.is_canonical else "not canonical"
        return f"<CanonicalTransformation to {', '.join(map(str, self.coordinates))}: {told}, {self.verdict.sentence}>"


@takes(hamiltonian=PHASE_SPACE, coordinates=BY_SYMBOL, momenta=BY_SYMBOL, inverse=INVERSE)
def canonical_transformation(
    hamiltonian: Space,
    coordinates: Mapping[Any, Any],
    momenta: Mapping[Any, Any],
    *,
    inverse: Mapping[Any, Any] | None = None,
) -> CanonicalTransformation:
    """Return new coordinates and momenta, with whether they are canonical and their Hamiltonian.

    Parameters
    ----------
    hamiltonian
        What `atwood.hamiltonian` returns, or a pair: coordinates and momenta.
    coordinates, momenta
        Each new symbol with what it is in terms of the old coordinates and momenta, parameters and t.
    inverse
        Each old coordinate and momentum in terms of the new; it is sought if not given.

    Returns
    -------
    CanonicalTransformation
        Ready to be asked for J, for whether it is canonical, and for the new Hamiltonian.

    Raises
    ------
    UsageError
        If there are not as many new coordinates and momenta as old ones.
    """
    space = phase_space_of(hamiltonian)
    n = len(space.coordinates)
    new = [*coordinates, *momenta]
    if len(coordinates) != n or len(momenta) != n or len(set(new)) != 2 * n:
        raise _not_as_many(n, coordinates, momenta)
    values = [space.read(one) for one in (*coordinates.values(), *momenta.values())]
    old = list(space.own)
    if inverse is not None:
        by = {space.read(key): value for key, value in inverse.items()}
        if set(by) != set(old):
            raise UsageError(
                "the inverse does not give every old coordinate and momentum",
                where=f"{list(inverse)}"[:80],
                advice=f"Give {', '.join(map(str, space.given))}, each in terms of the new ones.",
            )
    else:
        by = _solved([value - one for value, one in zip(values, new, strict=True)], old)
    return _transformation(hamiltonian, space, new, values, by, _added(values, new, by))


@takes(
    function=EXPRESSION, kind=whole("1, 2, 3 or 4", 1, 4), hamiltonian=PHASE_SPACE, coordinates=SYMBOLS, momenta=SYMBOLS
)
def generated_transformation(
    function: Any, kind: int, hamiltonian: Space, coordinates: Sequence[Any], momenta: Sequence[Any]
) -> CanonicalTransformation:
    """Return the canonical transformation of a generating function (Goldstein, table 9.1).

    Parameters
    ----------
    function
        F in terms of old and new variables, parameters and t, in sympy.
    kind
        1: F(q, Q, t), with ``p = dF/dq`` and ``P = -dF/dQ``. 2: F(q, P, t), with ``p = dF/dq`` and ``Q = dF/dP``.
        3: F(p, Q, t), with ``q = -dF/dp`` and ``P = -dF/dQ``. 4: F(p, P, t), with ``q = -dF/dp`` and ``Q = dF/dP``.
    hamiltonian
        See `canonical_transformation`.
    coordinates, momenta
        Symbols of the new coordinates and momenta.

    Raises
    ------
    UsageError
        If the function holds variables of the wrong kind, or leaves new variables undetermined.
    """
    space = phase_space_of(hamiltonian)
    n, new_q, new_p = len(space.coordinates), tuple(coordinates), tuple(momenta)
    f = space.read(function, (*new_q, *new_p))
    if len(new_q) != n or len(new_p) != n:
        raise _not_as_many(n, coordinates, momenta)
    variables = {"q": space.coordinates, "p": space.momenta, "Q": new_q, "P": new_p}
    used = _KINDS[kind]
    wrong = [one for name, own in variables.items() if name not in used for one in own if f.has(one)]
    if wrong:
        raise UsageError(
            f"a generating function of kind {kind} is one of {used[0]} and {used[1]}, and this holds {wrong[0]}",
            where=str(function)[:80],
        )
    first, second = ("p", 1) if used[0] == "q" else ("q", -1), ("P", -1) if used[1] == "Q" else ("Q", 1)
    new = [*new_q, *new_p]
    given = [
        {
            y: _without_arcs(sign * f.diff(x), (*space.own, *new))
            for x, y in zip(variables[by], variables[name], strict=True)
        }
        for by, name, sign in ((used[0], *first), (used[1], *second))
    ]
    ways = (_in_turn(given[0], variables[used[1]], given[1], sign) for sign in (1, -1))
    forward = next((one for one in ways if one and _agree({**given[0], **given[1]}, one)), {})
    back = (_in_turn(given[1], variables[used[0]], given[0], sign) for sign in (1, -1) if forward)
    inverse = next((one for one in back if one and _agree(one, forward)), {})
    if not forward:
        raise UsageError(
            "it leaves new coordinates or momenta undetermined, or has no solution that is found",
            where=str(function)[:80],
            advice=f"The mixed second derivatives by {used[0]} and {used[1]} must not be singular.",
        )
    added = f.diff(sympy.Symbol("t"))
    if inverse:
        added = added.xreplace(inverse)
    values = [short(forward[one]) for one in new]
    return _transformation(hamiltonian, space, new, values, inverse, added if inverse or added == 0 else None)


def _transformation(
    hamiltonian: Space,
    space: PhaseSpace,
    new: Sequence[Sympy],
    values: Sequence[Sympy],
    solved: Mapping[Sympy, Sympy],
    added: Sympy | None,
) -> CanonicalTransformation:
    """Return the transformation to new symbols, coordinates first, with the values that they have."""
    n, shown = len(space.coordinates), tuple(space.shown(one) for one in values)
    old = None if isinstance(hamiltonian, (tuple, list)) else space.read(hamiltonian.expression)
    return CanonicalTransformation(space, tuple(new[:n]), tuple(new[n:]), shown[:n], shown[n:], solved, old, added)


def _not_as_many(n: int, coordinates: Iterable[Sympy], momenta: Iterable[Sympy]) -> UsageError:
    given = (
        f"coordinates {', '.join(map(str, coordinates)) or 'none'}; momenta {', '.join(map(str, momenta)) or 'none'}"
    )
    advice = f"Give as many of each as the old ones, {n}, all different."
    return UsageError(f"{n} new coordinates and {n} new momenta are needed", where=given[:80], advice=advice)


def _solved(equations: Sequence[Sympy], unknowns: Sequence[Sympy], any_branch: bool = False) -> dict[Sympy, Sympy]:
    """Return a solution of equations, perhaps with roots and arcs of other branches; empty where none is found."""
    if any(one.has(*unknowns) for equation in equations for one in equation.atoms(sympy.Integral)):
        return {}
    plain = equations if any_branch else [one.rewrite((sympy.tan, sympy.cot), sympy.cos) for one in equations]
    try:
        found = sympy.solve(list(plain), list(unknowns), dict=True, simplify=False, check=False)
    except UNSOLVED:
        return {}
    whole, held = [one for one in reversed(found) if set(one) == set(unknowns)], () if any_branch else equations
    chosen = next((one for size in _SIZES for one in whole if _solves(one, held, size)), None)
    return {} if chosen is None else {key: short(value) for key, value in chosen.items()}


_SIZES = (1, 0.25)
"""Some positive numbers are of these sizes: not every transformation leads to all places."""


UNSOLVED = (ArithmeticError, AttributeError, LookupError, NotImplementedError, RecursionError, TypeError, ValueError)
"""What sympy raises where it finds no solution, as of an integral by its end."""


def _in_turn(
    given: Mapping[Sympy, Sympy], unknowns: Sequence[Sympy], explicit: Mapping[Sympy, Sympy], sign: int
) -> dict[Sympy, Sympy]:
    """Return a solution for some unknowns, and what follows from these; empty where none is found.

    Half of a generating function's equations hold one group of the unknowns alone, and the other half gives the others.
    """
    solved = _solved([one - value for one, value in given.items()], unknowns, any_branch=True)
    if not solved:
        return {}
    solved = {one: on_branch(value, sign) for one, value in solved.items()}
    others = {one: on_branch(value.xreplace(solved), sign) for one, value in explicit.items()}
    return {**solved, **others}


def _without_arcs(value: Sympy, variables: Sequence[Sympy]) -> Sympy:
    """Return an expression without the roots that derivatives of arcs leave behind, which cancel."""
    roots = [one for one in value.atoms(sympy.Pow) if not one.exp.is_Integer and one.base.has(*variables)]
    return on_branch(value, arcs=False) if roots or value.has(sympy.asin, sympy.acos) else value


def _agree(given: Mapping[Sympy, Sympy], forward: Mapping[Sympy, Sympy]) -> bool:
    """Return whether equations hold where the old variables are some positive numbers and the new what they lead to."""
    symbols = set().union(*(one.free_symbols for one in (*forward.values(), *given.values())), given) - set(forward)
    point = {one: sympy.Rational(7 + 3 * k, 11 + 7 * k) for k, one in enumerate(sorted(symbols, key=str))}
    there = point | {one: value.xreplace(point).evalf(30) for one, value in forward.items()}
    off = [(there[one] - value.xreplace(there)).evalf(30) for one, value in given.items()]
    return all(one.is_number and one.is_finite and abs(one) < 1e-20 for one in off)


def _solves(found: Mapping[Sympy, Sympy], equations: Sequence[Sympy], size: float) -> bool:
    """Return whether a solution is one, and real, where all symbols are some positive numbers."""
    symbols = set().union(*(one.free_symbols for one in (*equations, *found.values()))) - set(found)
    point = {one: sympy.Rational(size) * (7 + 3 * k) / (11 + 2 * k) for k, one in enumerate(sorted(symbols, key=str))}
    there = {one: value.xreplace(point).evalf(30) for one, value in found.items()}
    if not all(
        one.is_number and one.is_finite and abs(sympy.im(one)) <= 1e-20 * (abs(one) + 1) for one in there.values()
    ):
        return False
    left = (one.xreplace({**point, **there}).evalf(30) for one in equations)
    return all(one.is_number and one.is_finite and abs(one) < 1e-20 for one in left)


def _added(values: Sequence[Sympy], new: Sequence[Sympy], inverse: Mapping[Sympy, Sympy]) -> Sympy | None:
    """Return dF/dt, from how new coordinates and momenta move while the old ones stay.

    That motion is the one of dF/dt as a Hamiltonian, which is found along straight lines from the origin: for what is a
    polynomial in the new variables.
    """
    t = sympy.Symbol("t")
    rates = [one.diff(t) for one in values]
    if all(one == 0 for one in rates):
        return sympy.Integer(0)
    if not inverse:
        return None
    n, share = len(new) // 2, sympy.Dummy("s")
    rates = [short(one.xreplace(dict(inverse))) for one in rates]
    scaled = [one.xreplace({x: share * x for x in new}) for one in rates]
    total = sympy.expand(sum(new[n + k] * scaled[k] - new[k] * scaled[n + k] for k in range(n)))
    if not total.is_polynomial(share):
        return None
    found = sum(c * sympy.Rational(1, m[0] + 1) for m, c in sympy.Poly(total, share).terms())
    return short(sympy.expand(found))


@command("bracket")
@takes(f=EXPRESSION, g=EXPRESSION, hamiltonian=PHASE_SPACE, constants=SYMBOLS)
def poisson_bracket(
    f: Any,
    g: Any,
    hamiltonian: Space,
    *,
    constants: Sequence[Any] = (),
) -> Sympy:
    """Return the Poisson bracket ``{f, g} = sum df/dq dg/dp - df/dp dg/dq``.

    Parameters
    ----------
    f, g
        Functions of coordinates, momenta and time: sympy expressions in the symbols of the Hamiltonian, or text of
        them: ``"theta"`` is the coordinate theta(t).
    hamiltonian
        What `atwood.hamiltonian` returns, or a pair: coordinates and momenta.
    constants
        Further symbols that stand for numbers, beside the parameters of the scene; beside a pair any other symbol does.

    Returns
    -------
    sympy.Expr
        The bracket, as short as formulas of equations are made.

    Raises
    ------
    UsageError
        If a function holds what is neither coordinate nor momentum, parameter nor time.
    """
    space = phase_space_of(hamiltonian)
    return space.shown(short(bracket(space.declared(f, constants), space.declared(g, constants), space)))


@command("brackets")
@takes(functions=EXPRESSIONS, hamiltonian=PHASE_SPACE, constants=SYMBOLS)
def poisson_brackets(
    functions: Sequence[Any] = (),
    hamiltonian: Space | None = None,
    *,
    constants: Sequence[Any] = (),
) -> Sympy:
    """Return the matrix of the Poisson brackets of several functions with each other.

    Parameters
    ----------
    functions
        The functions, such as the components of angular momentum; coordinates and momenta, in this order, if there are
        none: then these are the fundamental brackets (Goldstein, equation 9.69).
    hamiltonian, constants
        See `poisson_bracket`.
    """
    space = phase_space_of(check(PHASE_SPACE, hamiltonian, "hamiltonian", "poisson_brackets"))
    read = [space.declared(one, constants) for one in functions or space.given]
    return sympy.ImmutableMatrix(
        len(read), len(read), [space.shown(short(bracket(f, g, space))) for f in read for g in read]
    )


@takes(coordinates=EXPRESSIONS, momenta=EXPRESSIONS, hamiltonian=PHASE_SPACE)
def fundamental_brackets(
    coordinates: Sequence[Any],
    momenta: Sequence[Any],
    hamiltonian: Space,
) -> Sympy:
    """Return the brackets of new coordinates and momenta: the matrix Omega if they are canonical.

    Parameters
    ----------
    coordinates, momenta
        New ones as functions of the old.
    hamiltonian
        See `poisson_bracket`.
    """
    return poisson_brackets([*coordinates, *momenta], hamiltonian)


@takes(f=EXPRESSION, hamiltonian=HAMILTONIAN)
def total_derivative(f: Any, hamiltonian: Hamiltonian) -> Sympy:
    """Return the rate of a function along motions, ``df/dt = {f, H} + df/dt`` (Goldstein, equation 9.94).

    It is zero for constants of the motion; so is then that of the bracket of two of them (Poisson's theorem).

    Parameters
    ----------
    f
        The function.
    hamiltonian
        The Hamiltonian; forces that do not follow from it are not in it.
    """
    space = phase_space_of(hamiltonian)
    read = space.declared(f)
    found = bracket(read, space.read(hamiltonian.expression), space) + read.diff(sympy.Symbol("t"))
    return space.shown(short(found))


def bracket(f: Sympy, g: Sympy, space: PhaseSpace) -> Sympy:
    """Return the Poisson bracket of functions on the plain symbols of a phase space, as it comes."""
    f, g = (one.replace(sympy.Abs, lambda inside: sympy.sqrt(inside**2)) for one in (f, g))  # all is real
    pairs = zip(space.coordinates, space.momenta, strict=True)
    return sympy.Add(*(f.diff(q) * g.diff(p) - f.diff(p) * g.diff(q) for q, p in pairs))
