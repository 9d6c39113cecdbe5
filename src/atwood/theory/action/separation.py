"""`separation`: whether the equation of Hamilton and Jacobi separates in given coordinates, and its quadratures.

Levi-Civita's conditions are evaluated at random states with many digits, beside the error of what is evaluated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from atwood.arguments import BY_PATH, instance, optional, takes
from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, UnsupportedError, UsageError, check_known
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import mpmath, sympy
from atwood.model.compose.composite import Model
from atwood.theory.action.action_angle import Curves, Level, Terms, level_through
from atwood.theory.action.complete_integral import CompleteIntegral, complete_integral
from atwood.theory.equations.stated import GAUGE
from atwood.theory.formulas.described import Described
from atwood.theory.formulas.notation import SYMBOLS
from atwood.theory.formulas.printers import Sympy
from atwood.theory.hamiltonian.hamiltonian import Hamiltonian, hamiltonian
from atwood.theory.hamiltonian.point_transformations import (
    PointTransformation,
    equations_of,
    point_transformation_of,
    read_places,
    start_in,
)

_PLAIN = 40
"""Up to so many operations it is said what is left over where it does not separate."""

_LONG = 10**6
"""A fraction with a larger denominator is a decimal number, known to 16 digits."""


@dataclass(frozen=True, eq=False)
class SeparatedMotion:
    """The motion of one coordinate of those in which H separates.

    Attributes
    ----------
    coordinate
        Its name.
    kind
        ``"libration"`` between two turning points, or ``"rotation"``.
    ends
        The turning points, or the begin and the end of the coordinate's period.
    action
        The action variable ``J_i``, the integral of ``p_i dq_i`` over one turn of this coordinate, J s.
    """

    coordinate: str
    kind: str
    ends: tuple[float, float]
    action: float
    _level: Level

    def momentum(self, q: Any, sign: float = 1.0) -> FloatArray:
        """Return ``p_i = dW_i/dq_i`` at values of the coordinate; nan where the motion does not come to.

        Parameters
        ----------
        q
            Values of the coordinate.
        sign
            1 for the branch on which it rises, -1 for that on which it falls.
        """
        return self._level.momentum(np.asarray(q, dtype=float), sign)

    def __repr__(self) -> str:
        low, high = self.ends
        return f"<SeparatedMotion of {self.coordinate}: {self.kind}, {low:.6g} to {high:.6g}, J = {self.action:.9g}>"


@dataclass(frozen=True, eq=False)
class Separation(Described):
    """Whether H separates in some coordinates, by the conditions of Levi-Civita.

    The equation ``H(q, dW/dq) = E`` has a complete integral ``W = sum of W_i(q_i)`` if and only if, for each two
    different i and j,

        H_pi H_pj H_qiqj - H_pi H_qj H_qipj - H_qi H_pj H_piqj + H_qi H_qj H_pipj = 0

    (Levi-Civita, Mathematische Annalen 59, 1904; Landau and Lifshitz, Mechanics, section 48).

    Attributes
    ----------
    name
        The scene.
    coordinates, momenta
        sympy symbols.
    expression
        H of these.
    values
        The value of each parameter's symbol.
    separates
        Whether all conditions hold at random states, with 40 digits.
    condition
        Levi-Civita's condition that is missed most: of which two coordinates, and by which share of its terms.
    source
        H in the scene's coordinates.
    transformation
        The scene's coordinates in terms of those in which it separates, by path.
    """

    name: str
    coordinates: tuple[Sympy, ...]
    momenta: tuple[Sympy, ...]
    expression: Sympy
    values: Mapping[Sympy, float]
    separates: bool
    condition: tuple[str, str, float]
    source: Hamiltonian
    transformation: Mapping[str, Sympy]

    @property
    def sentence(self) -> str:
        """The answer in words, and how it was found."""
        names = ", ".join(map(str, self.coordinates))
        if len(self.coordinates) == 1:
            return f"{self.name} has one coordinate, {names}, and separates."
        if self.separates:
            only = "" if self.is_general else ", for these values of the parameters"
            return (
                f"{self.name} separates in {names}{only}: Levi-Civita's conditions hold at {STATES} random states, to "
                f"{DIGITS} digits."
            )
        one, other, miss = self.condition
        told = f"the condition of {one} and {other} is missed by {miss:.2g}"
        if self.expression.count_ops() < _PLAIN:
            try:
                _ = self.complete
            except AtwoodError as error:
                left = error.message.rpartition(": ")[2]
                told = f"{left}; {told}" if "left over" in left else told
        return f"{self.name} does not separate in {names}: {told}."

    @cached_property
    def is_general(self) -> bool:
        """Whether the answer is the same for some other values of the parameters."""
        others = {one: value * (1.0 + 0.3 / (k + 2.0)) for k, (one, value) in enumerate(self.values.items())}
        try:
            found = worst_condition(self.expression, self.coordinates, self.momenta, others, self.name)
        except UnsupportedError:  # H is not real there
            return True
        return (found[2] <= ZERO) == self.separates

    @cached_property
    def complete(self) -> CompleteIntegral:
        """W and S as sums, the constants of the separation, and the motion that follows from them.

        Raises
        ------
        UnsupportedError
            If the equation does not separate, which names the term that is left over.
        """
        if set(self.transformation.values()) == set(self.coordinates):
            state = dict(zip(self.transformation.values(), self.source.start()[0], strict=True))
            letters = dict(zip(self.coordinates, self.momenta, strict=True))
            state |= {letters[q]: p for q, p in zip(self.transformation.values(), self.source.start()[1], strict=True)}
            return complete_integral(self.expression, [*letters.items()], self.values, state, self.name)
        given = point_transformation_of(self.source, self.transformation, self.coordinates)
        t, *starts = start_in(given)
        state = dict(zip((*given.coordinates, *given.velocities), np.concatenate(starts), strict=True))
        known = {**self.values, **state, sympy.Symbol("t"): t}
        state |= {p: one.xreplace(known) for p, one in zip(given.momenta, given.definitions, strict=True)}
        pairs = [*zip(given.coordinates, given.momenta, strict=True)]
        return complete_integral(given.hamiltonian, pairs, self.values, state, self.name)

    @property
    def constants(self) -> dict[Sympy, Sympy]:
        """What each constant of the separation is in terms of coordinates and momenta."""
        return dict(self.complete.constants)

    @property
    def characteristic_function(self) -> Sympy:
        """Hamilton's characteristic function W, as a sum."""
        return self.complete.characteristic

    @property
    def principal_function(self) -> Sympy:
        """Hamilton's principal function ``S = W - E t``."""
        return self.complete.principal

    @property
    def betas(self) -> dict[Sympy, Sympy]:
        """What stays the same on a motion besides the constants: ``dS/dalpha``, by constant."""
        return self.complete.betas

    @property
    def motions(self) -> dict[Sympy, Sympy]:
        """Coordinates as functions of time since a turning point, where they follow from betas."""
        return self.complete.motion

    @property
    def actions(self) -> dict[Sympy, Sympy]:
        """Action variables in terms of the constants, by coordinate, where they are residues."""
        return self.complete.actions

    def motion(
        self, coordinate: str, q: Sequence[float], p: Sequence[float], turn: float | None = None
    ) -> SeparatedMotion:
        """Return the separated motion of one coordinate through a state: turning points and action variable.

        ``W_i' = p_i(q_i)`` is what H = E gives while the other coordinates and their momenta stay as they are in the
        state: where H separates, all their values on the same motion give the same.

        Parameters
        ----------
        coordinate
            Its name.
        q, p
            A state in the coordinates of the separation.
        turn
            The period of the coordinate, such as 2 pi, if it may go round.

        Raises
        ------
        UsageError
            If there is no such coordinate, or H does not separate.
        SolveError
            If its motion has no period.
        """
        i, names = self._number(coordinate), [str(one) for one in self.coordinates]
        here, momenta = np.array(q, dtype=float), np.array(p, dtype=float)
        if here.shape != (len(names),) or momenta.shape != here.shape:
            raise UsageError(f"a state has {len(names)} coordinates and momenta", where=self.name)

        others = dict(zip((*self.coordinates, *self.momenta), (*here, *momenta), strict=True))
        found = level_through(self._curves(i, others), here[i], momenta[i], max(abs(here[i]), 0.1), turn, coordinate)
        return SeparatedMotion(coordinate, found.kind, found.ends, found.action, found)

    def _curves(self, i: int, state: Mapping[Sympy, float]) -> Curves:
        """Return the curves of one coordinate and its momentum while the others are held."""
        q, p = self.coordinates[i], self.momenta[i]
        held = {one: sympy.Float(value) for one, value in state.items() if one not in (q, p)}
        h = self.expression.xreplace({**self.values, **held})
        rate, second = h.diff(p), h.diff(p, 2)
        if second.has(p) or second == 0:
            raise UnsupportedError(f"H is not quadratic in {p}", where=str(q))
        shift = -rate.xreplace({p: sympy.Integer(0)}) / second
        still = h.subs(p, shift)
        function = sympy.lambdify(q, [1 / second, shift, still, still.diff(q)], "numpy")

        def terms(places: FloatArray) -> Terms:
            with np.errstate(all="ignore"):
                a, b, c, d = (np.broadcast_to(np.asarray(x, dtype=float), places.shape) for x in function(places))
            return a, b, c, d

        return Curves(terms)

    def momentum_squared(self, coordinate: str) -> Sympy:
        """Return ``p_i^2`` of a coordinate as a function of it and of constants of the motion.

        Of these, E is the energy, and momenta of ignorable coordinates are themselves. Where H = E leaves another
        coordinate, the constant ``alpha_NAME`` is the value of ``p_i^2`` at the place ``NAME_0`` of this one, which
        takes its place: in polar coordinates ``p_phi^2 = alpha_phi``.

        Raises
        ------
        UsageError
            If there is no such coordinate, or H does not separate.
        UnsupportedError
            If H has a term linear in that momentum, or two or more other coordinates are left.
        """
        i = self._number(coordinate)
        q, p = self.coordinates[i], self.momenta[i]
        second = self.expression.diff(p, 2)
        if second.has(p) or self.expression.diff(p).subs(p, 0).expand() != 0:
            raise UnsupportedError("H has more than its square in this momentum", where=coordinate)
        whole = 2 * (sympy.Symbol("E") - self.expression.subs(p, 0)) / second
        left = [
            (x, y) for x, y in zip(self.coordinates, self.momenta, strict=True) if x != q and self.expression.has(x)
        ]
        if not left:
            return whole
        (other, momentum), square = left[0], sympy.Dummy()
        plain = sympy.expand(whole).subs(momentum**2, square)
        slope = plain.diff(square)
        if len(left) > 1 or slope == 0 or plain.has(momentum) or slope.has(square):
            told = ", ".join(str(x) for x, _ in left)
            raise UnsupportedError(f"H = E leaves {told} in it", where=coordinate, advice="Use `motion`, in numbers.")
        there = {q: sympy.Symbol(f"{q}_0")}
        held = (sympy.Symbol(f"alpha_{q}") - plain.subs(square, 0).subs(there)) / slope.subs(there)
        # What separates is the same whatever the other coordinate is.
        found = (plain.subs(square, 0) + slope * held).subs(other, 1)
        return sympy.expand(found) if found.has(q) and not found.expand().has(q) else found

    def _number(self, coordinate: str) -> int:
        """Return which coordinate has a name; refuse where H does not separate."""
        names = [str(one) for one in self.coordinates]
        check_known(coordinate, names, "it is none of the coordinates")
        if not self.separates:
            raise UsageError(self.sentence, where=self.name)
        return names.index(coordinate)

    def __repr__(self) -> str:
        return f"<Separation: {self.sentence}>"


@takes(
    scene=instance(
        "a scene, an assembly of one, a Hamiltonian, or what `point_transformation` returns",
        *(Model, Assembly, Hamiltonian, PointTransformation),
    ),
    coordinates=optional(BY_PATH),
    symbols=SYMBOLS,
    gauge=GAUGE,
)
def separation(
    scene: Model | Assembly | Hamiltonian | PointTransformation,
    coordinates: Mapping[str, Any] | None = None,
    *,
    symbols: Mapping[str, str] | None = None,
    gauge: Any = None,
) -> Separation:
    """Return whether the equation of Hamilton and Jacobi of a scene separates in given coordinates.

    Parameters
    ----------
    scene
        The scene, or its Hamiltonian; or the scene in the coordinates that are asked about.
    coordinates
        The scene's coordinates, by their paths, as text or sympy expressions of others, which are those that are asked
        about: ``{"body.position.x": "r*cos(phi)", "body.position.z": "r*sin(phi)"}``. If not given, the scene's own.
    symbols, gauge
        See `atwood.equations`: a charge in a magnetic field separates in one gauge and not in another.

    Returns
    -------
    Separation
        The answer; where it is yes, W and S as sums, their constants, and the motion of each coordinate.

    Raises
    ------
    UsageError
        If coordinates are missing, or there are more or fewer of the others.
    UnsupportedError
        If the scene has no Hamiltonian, none that is short enough to be written down, or one that depends on time.
    """
    if isinstance(scene, PointTransformation):
        coordinates = dict(zip(scene.source.paths, scene.old.values(), strict=True))
        scene = scene.source
    h = scene if isinstance(scene, Hamiltonian) else hamiltonian(scene, symbols=symbols, gauge=gauge)
    if h.depends_on_time:
        raise UnsupportedError("H depends on time", where=h.name)
    plain = [sympy.Symbol(f"{by}{one.func.__name__}") for by in ("", "p_") for one in h.coordinates]
    places = dict(zip(h.paths, plain, strict=False)) if coordinates is None else read_places(coordinates, h.paths, h)
    named = {symbol for one in places.values() for symbol in one.free_symbols} - set(h.values)
    new = tuple(sorted(named, key=str))
    if len(new) != len(h.paths):
        raise UsageError(
            f"its {len(h.paths)} coordinates are given by {len(new)} others: {', '.join(map(str, new)) or 'none'}",
            where=h.name,
            advice=f"Write them in terms of {len(h.paths)} others.",
        )
    momenta = tuple(sympy.Symbol(f"p_{one}") for one in new)
    # Decimal numbers are symbols, so that it is seen what their last digits make of a condition.
    own = h.expression if coordinates is None else equations_of(h).lagrangian
    numbers = {one: sympy.Dummy() for whole in (*places.values(), own) for one in _decimals(whole)}
    back = {symbol: one for one, symbol in numbers.items()}
    if coordinates is None:
        made = own.xreplace(numbers | dict(zip((*h.coordinates, *h.momenta), plain, strict=True)))
    else:
        read = {path: one.xreplace(numbers) for path, one in places.items()}
        made = point_transformation_of(h, read, new, numbers).hamiltonian
    worst = worst_condition(made, new, momenta, {**h.values, **back}, h.name)
    return Separation(h.name, new, momenta, made.xreplace(back), h.values, worst[2] <= ZERO, worst, h, places)


def _decimals(value: Sympy) -> list[Sympy]:
    """Return the numbers of an expression that are known to 16 digits."""
    every = value.atoms(sympy.Number)
    return sorted((one for one in every if one.is_Float or (one.is_Rational and one.q > _LONG)), key=float)


STATES, _TRIALS = 6, 200
"""So many random states at which H is real are enough, among so many."""

DIGITS, ZERO, _UNKNOWN = 40, 1e-12, 30
"""Conditions are evaluated with so many digits, and hold where their terms cancel to the second.

Parameters are known to 16 digits: a condition holds too where what is left of it is at most so many times what other
last digits, and more digits, make of it.
"""


def worst_condition(
    h: Sympy, q: Sequence[Sympy], p: Sequence[Sympy], values: Mapping[Sympy, float], where: str
) -> tuple[str, str, float]:
    """Return by how much Levi-Civita's conditions are missed at random states, relative to their terms."""
    held = {symbol: float(value) for symbol, value in values.items()}
    by_q, by_p = [h.diff(one) for one in q], [h.diff(one) for one in p]
    worst = (str(q[0]), str(q[0]), 0.0)
    if len(q) == 1:
        return worst
    variables, variants = (*q, *p, *held), _variants([*held.values()])
    slopes = sympy.lambdify(variables, [h, *by_q, *by_p], "mpmath", cse=True)
    states = _states(lambda *state: slopes(*state, *variants[0][1]), len(q), where)
    first = [[_evaluated(slopes, state, *variant) for variant in variants] for state, _ in states]
    for i in range(len(q)):
        for j in range(i):
            seconds = [by_q[i].diff(q[j]), by_q[i].diff(p[j]), by_p[i].diff(q[j]), by_p[i].diff(p[j])]
            evaluate = sympy.lambdify(variables, seconds, "mpmath", cse=True)
            for (state, _), known in zip(states, first, strict=True):
                found = []
                for variant, own in zip(variants, known, strict=True):
                    qq, qp, pq, pp = _evaluated(evaluate, state, *variant) or [0] * 4
                    _, *slope = own or [0] * (2 * len(q) + 1)
                    hq, hp = slope[: len(q)], slope[len(q) :]
                    found.append((hp[i] * hp[j] * qq, -hp[i] * hq[j] * qp, -hq[i] * hp[j] * pq, hq[i] * hq[j] * pp))
                total, *others = [sum(one) for one in found]
                size = sum(abs(one) for one in found[0])
                # What other digits change is not known, however little there is beside it.
                known_to = _UNKNOWN * max(abs(one - total) for one in others)
                miss = float(abs(total) / size) if abs(total) > known_to else 0.0
                if miss > worst[2]:
                    worst = (str(q[j]), str(q[i]), miss)
            if worst[2] > ZERO:
                return worst
    return worst


def _variants(values: Sequence[float]) -> list[tuple[int, list[Any]]]:
    """Return numbers of digits, and parameters as they are and off by rounding, to see what is known of a condition."""
    random = np.random.default_rng(5)
    exact = [mpmath.mpf(one) for one in values]
    made = [(DIGITS, exact), (DIGITS + 20, exact)]
    off = [random.uniform(-1.0, 1.0, len(values)) for _ in range(3)]
    return made + [(DIGITS, [x * (1 + mpmath.mpf(2.0**-52 * u)) for x, u in zip(exact, w, strict=True)]) for w in off]


def _states(evaluate: Any, n: int, where: str) -> list[tuple[list[Sympy], list[Any]]]:
    """Return random states at which H is real, with H and its derivatives there."""
    random = np.random.default_rng(3)
    found: list[tuple[list[Sympy], list[Any]]] = []
    for _ in range(_TRIALS):
        state = [sympy.Rational(int(k), 10**6) for k in random.integers(2 * 10**5, 18 * 10**5, 2 * n)]
        values = _evaluated(evaluate, state)
        if values is not None:
            found.append((state, values))
        if len(found) == STATES:
            return found
    raise UnsupportedError("H is real at too few random states to be looked at", where=where)


def _evaluated(
    evaluate: Any, state: Sequence[Sympy], digits: int = DIGITS, values: Sequence[Any] = ()
) -> list[Any] | None:
    """Return real values with many digits, None where there are none."""
    with mpmath.workdps(digits):
        try:
            found = evaluate(*[mpmath.mpf(one.p) / one.q for one in state], *values)
        except (ZeroDivisionError, ValueError, TypeError, ArithmeticError):
            return None
        values = [one if isinstance(one, mpmath.mpf) else mpmath.mpmathify(one) for one in found]
        finite = all(isinstance(one, mpmath.mpf) and mpmath.isfinite(one) for one in values)
        return values if finite else None
