"""Small oscillations as formulas (Goldstein, chapter 6): ``det(V - omega^2 T) = 0``, shapes, and normal coordinates.

With velocity terms, as of rotating frames, magnetic fields and damping, motions ``exp(s t)`` fulfil
``det(s^2 M + s C + K) = 0``.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

from atwood.display import count_of, data_of, fitted
from atwood.errors import UnsupportedError, UsageError, check_known, suggestion
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy
from atwood.model.values.units import parse_quantity, parse_unit
from atwood.simulation.initialization.start import find_start
from atwood.table import Shown, Table, facts, table
from atwood.theory.formulas.page import aligned
from atwood.theory.formulas.printers import Sympy
from atwood.theory.formulas.reading import latex_of, text_of
from atwood.theory.formulas.tree import as_fraction, of_pi
from atwood.theory.oscillations.bifurcations import State
from atwood.theory.oscillations.conditions import NoClosedFormError, Solution, solve_conditions
from atwood.theory.oscillations.equilibria import SymbolicEquilibrium, described, find_symbolic, said, state_of
from atwood.theory.oscillations.rest import Expansion, PlainEquations, plain_equations
from atwood.theory.oscillations.spectrum import Eigenvalue, blocks, eigenvalues, of_even, of_pencil, on_block, short
from atwood.theory.oscillations.stability import characteristic


@dataclass(frozen=True, eq=False)
class SymbolicMode:
    """A normal mode as formulas.

    Attributes
    ----------
    square
        omega^2; None with damping, or where the characteristic polynomial has no roots in closed form.
    rate
        s of ``exp(s t)``: ``i omega`` without damping; None where there is no closed form.
    shapes
        For each independent shape the amplitude of every coordinate by path.
    polynomial
        The factor of the characteristic polynomial that omega^2, or s with velocity terms, is a root of.
    number
        s with the values of the scene, 1/s, that with the positive imaginary part; of a factor without roots in closed
        form all of them.
    """

    square: Sympy | None
    rate: Sympy | None
    shapes: tuple[Mapping[str, Sympy], ...]
    polynomial: Sympy
    number: tuple[complex, ...]

    @property
    def angular_frequency(self) -> Sympy | None:
        """omega, rad/s."""
        return None if self.square is None else sympy.sqrt(self.square)

    def __repr__(self) -> str:
        numbers, head = ", ".join(map(_number, self.number)), "" if self.square is None else "ω² = "
        return fitted(f"<SymbolicMode {head}{_formula(self)}; s = {numbers} 1/s with these values>")


@dataclass(frozen=True, eq=False)
class SymbolicModes(Shown):
    """Small oscillations about a state of rest as formulas, in the symbols of `equations`.

    Attributes
    ----------
    rest
        The state of rest, with where it exists and is stable.
    modes
        The modes, the slowest first.
    """

    rest: SymbolicEquilibrium
    modes: tuple[SymbolicMode, ...]
    plain: PlainEquations
    expansion: Expansion
    found: tuple[Eigenvalue, ...]

    def __len__(self) -> int:
        return len(self.modes)

    @property
    def scene(self) -> str:
        """Name of the scene."""
        return self.plain.name

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Paths of the coordinates whose deviations are independent."""
        return tuple(self.plain.paths[k] for k in self.expansion.independent)

    @property
    def mass(self) -> Sympy:
        """M of ``M z'' + C z' + K z = 0``; ``T = z'.M z' / 2``."""
        return self.expansion.mass.applyfunc(self.plain.told)

    @property
    def damping(self) -> Sympy:
        """C of ``M z'' + C z' + K z = 0``: damping and gyroscopic terms."""
        return self.expansion.damping.applyfunc(self.plain.told)

    @property
    def stiffness(self) -> Sympy:
        """K of ``M z'' + C z' + K z = 0``; ``V = z.K z / 2`` where K is symmetric."""
        return self.expansion.stiffness.applyfunc(self.plain.told)

    @property
    def angular_frequencies(self) -> tuple[Sympy | None, ...]:
        """Omega of each shape, rad/s."""
        return tuple(one.angular_frequency for one in self.modes for _ in one.shapes or (None,))

    # -- normal coordinates -------------------------------------------------------------------------------------------

    @cached_property
    def _normal(self) -> Sympy:
        """Deviations of all coordinates by normal coordinates, as columns, in plain symbols."""
        one = self.expansion
        if not one.damping.is_zero_matrix or any(not eigen.vectors for eigen in self.found):
            left = next((mode.polynomial for mode in self.modes if not mode.shapes), None)
            text = "it has terms with velocities" if left is None else f"{left} has no roots in closed form"
            raise UnsupportedError(
                f"it has no normal coordinates as formulas: {text}",
                where=self.scene,
                advice="Without `symbolic` modes are found in numbers.",
            )
        columns: list[Sympy] = []
        for eigen in self.found:
            own: list[Sympy] = []
            for vector in eigen.vectors:
                for other in own:  # of several shapes, each across the others
                    vector = vector - other * (other.T * one.mass * vector)[0]
                size = short((vector.T * one.mass * vector)[0])
                own.append((vector / sympy.sqrt(size)).applyfunc(sympy.factor_terms))
            columns += own
        return one.basis * sympy.Matrix.hstack(*columns)

    @property
    def transformation(self) -> Sympy:
        """A of ``q - q0 = A zeta``: rows are all coordinates, columns normal coordinates; ``A^T M A = 1``."""
        return self._normal.applyfunc(self.plain.told)

    def to_normal(self, deviations: Mapping[str, Any]) -> tuple[Any, ...]:
        """Return the normal coordinates of deviations from rest by path; numbers if these are numbers.

        Deviations of independent coordinates that are not given are zero.
        """
        return self._evaluated(self._amplitudes(deviations))

    def from_normal(self, amplitudes: Sequence[Any]) -> dict[str, Any]:
        """Return the deviations of all coordinates that belong to normal coordinates; numbers if these are numbers."""
        if len(amplitudes) != self._normal.shape[1]:
            advice = "Give one for each shape."
            raise UsageError(f"there are {self._normal.shape[1]} normal coordinates", where=self.scene, advice=advice)
        found = self._normal * sympy.Matrix(list(map(sympy.sympify, amplitudes)))
        return dict(zip(self.plain.paths, self._evaluated(found), strict=True))

    def motion(self, deviations: Mapping[str, Any], rates: Mapping[str, Any] | None = None) -> dict[str, Sympy]:
        """Return every coordinate as a function of t: the sum of all modes that begins with given deviations and rates.

        Parameters
        ----------
        deviations, rates
            At t = 0 by path, numbers or expressions; those of independent coordinates that are not given are zero.
        """
        t, waves = sympy.Symbol("t"), []
        squares = [eigen.value for eigen in self.found for _ in eigen.vectors]
        for square, start, rate in zip(
            squares, self._amplitudes(deviations), self._amplitudes(rates or {}), strict=True
        ):
            omega = sympy.sqrt(square)
            wave = (
                start * sympy.cos(omega * t) + rate * sympy.sin(omega * t) / omega if square != 0 else start + rate * t
            )
            waves.append(wave)
        moved = (self._normal * sympy.Matrix(waves)).applyfunc(self.plain.told)
        return {path: self.rest.values[path] + one for path, one in zip(self.plain.paths, moved, strict=True)}

    def _amplitudes(self, deviations: Mapping[str, Any]) -> Sympy:
        for path in deviations:
            if path not in self.coordinates:
                advice = suggestion(path, self.coordinates)
                raise UsageError("it is no independent coordinate", where=path, advice=advice)
        given = sympy.Matrix([sympy.sympify(deviations.get(path, 0)) for path in self.coordinates])
        rows = list(self.expansion.independent)
        return self._normal.extract(rows, list(range(len(rows)))).T * self.expansion.mass * given

    def _evaluated(self, found: Sympy) -> tuple[Any, ...]:
        """Return numbers where there is nothing but parameters, else formulas."""
        if found.free_symbols <= set(self.plain.values):
            return tuple(self.plain.number(one).real for one in found)
        return tuple(found.applyfunc(self.plain.told))

    # -- to be shown --------------------------------------------------------------------------------------------------

    @property
    def _deviations(self) -> Sympy:
        t, n = sympy.Symbol("t"), len(self.coordinates)
        return sympy.Matrix([sympy.Function(f"eta_{k + 1}" if n > 1 else "eta")(t) for k in range(n)])

    @property
    def energies(self) -> tuple[Sympy, Sympy]:
        """T and V to second order, in deviations eta, functions of t; V lacks what `circulatory` forces do."""
        eta, rate = self._deviations, self._deviations.diff(sympy.Symbol("t"))
        return (rate.T * self.mass * rate)[0].expand() / 2, (eta.T * self.stiffness * eta)[0].expand() / 2

    @property
    def circulatory(self) -> Sympy:
        """Forces along the deviations eta that no potential has, from the skew part of K."""
        return ((self.stiffness.T - self.stiffness) / 2).applyfunc(short) * self._deviations

    @property
    def equation(self) -> Sympy:
        """The characteristic polynomial: ``det(K - lambda M)``, lambda = omega^2; with velocity terms in s."""
        if self.expansion.damping.is_zero_matrix:
            return (self.stiffness - sympy.Symbol("lambda") * self.mass).det(method="berkowitz")
        return characteristic(self.mass, self.damping, self.stiffness, sympy.Symbol("s")).as_expr()

    def latex(self) -> str:
        """Return energies to second order, and omega^2 and shapes of all modes, as an aligned block of LaTeX."""
        kinetic, potential = self.energies
        rows = [f"T &= {latex_of(kinetic)}", f"V &= {latex_of(potential)}"]
        rows += [f"Q_{{{k}}} &= {latex_of(one)}" for k, one in enumerate(self.circulatory, 1) if one != 0]
        for k, one in enumerate(self.modes, 1):
            left, value = (rf"\omega_{{{k}}}^2", one.square) if one.square is not None else (f"s_{{{k}}}", one.rate)
            rows.append(f"{left} &= {latex_of(value)}" if value is not None else f"0 &= {latex_of(one.polynomial)}")
            rows += [rf"A_{{{k}}} &\propto ({', '.join(map(latex_of, shape.values()))})" for shape in one.shapes]
        return aligned(rows)

    def to_data(self) -> dict[str, Any]:
        """Return it as plain data, formulas in the words of Python."""
        return data_of(self, "scene", "rest", "coordinates", "mass", "damping", "stiffness", "modes")

    def tables(self) -> tuple[Table, ...]:
        """Return where it rests, both energies to second order, and the modes."""
        kinetic, potential = self.energies
        letters = {path: text_of(self.plain.letter(path)) for path in self.plain.paths}
        rows = [
            ("about", state_of(self.plain, self.rest)),
            ("exists where", said(self.rest.exists)),
            ("stable where", said(self.rest.stable)),
        ]
        rows += [("T", text_of(kinetic)), ("V", text_of(potential))]
        if not self.circulatory.is_zero_matrix:
            rows.append(("circulatory forces", "; ".join(map(text_of, self.circulatory))))
        shown = []
        for k, one in enumerate(self.modes, 1):
            shapes = "; ".join(" : ".join(map(text_of, shape.values())) for shape in one.shapes)
            numbers = ", ".join(_number(value) for value in one.number)
            shown.append((str(k), _formula(one), shapes, numbers))
        is_plain = self.expansion.damping.is_zero_matrix
        headings = ("mode", "ω²" if is_plain else "ω², or s", " : ".join(letters.values()), "s with these values, 1/s")
        return facts(rows, f"{self.scene}: {count_of(len(self), 'mode')} as formulas"), table(headings, shown)

    __str__ = Shown.as_text


def _formula(one: SymbolicMode) -> str:
    """Return omega^2, or s; the characteristic equation where these have no closed form."""
    value = one.rate if one.square is None else one.square
    return f"{text_of(one.polynomial)} = 0" if value is None else text_of(value)


def _number(value: complex) -> str:
    real = f"{value.real:.6g}" if abs(value.real) > 1e-12 * abs(value) else ""
    return f"{real}{value.imag:{'+' if real else ''}.6g}i" if value.imag else real or "0"


def symbolic_modes(
    assembly: Assembly, at: Mapping[str, Any] | None = None, symbols: Mapping[str, str] | None = None
) -> SymbolicModes:
    """Return small oscillations about a state of rest as formulas."""
    plain = plain_equations(assembly, symbols)
    rest, (*_, expansion) = _chosen(plain, at)
    if expansion is None:
        raise UsageError(
            "its coordinates are singular at this state of rest, or its constraints are",
            where=plain.name,
            advice="Choose other coordinates, or places with a constraint.",
        )
    if expansion.damping.is_zero_matrix and expansion.stiffness.is_symmetric():
        found = eigenvalues(expansion.mass, expansion.stiffness, sympy.Dummy("lambda"))
    else:
        found = list(_with_velocities(plain, expansion))
    made = [(_mode(plain, expansion, one), one) for one in found]
    made.sort(key=lambda pair: (abs(pair[0].number[0].imag), -pair[0].number[0].real))
    return SymbolicModes(rest, tuple(mode for mode, _ in made), plain, expansion, tuple(one for _, one in made))


def _with_velocities(plain: PlainEquations, one: Expansion) -> Iterator[Eigenvalue]:
    """Yield the roots s of ``det(s^2 M + s C + K)``; where it is even, in pairs of opposite ones, by one of them."""
    matrices, s = (one.mass, one.damping, one.stiffness), sympy.Dummy("s")
    for basis in blocks(matrices):
        m, c, k = (on_block(matrix, basis) for matrix in matrices)
        pencil, coefficients = s**2 * m + s * c + k, characteristic(m, c, k, s).all_coeffs()
        is_even = not any(coefficients[1::2])
        for eigen in of_even(pencil, coefficients[::2], s, plain.number) if is_even else of_pencil(pencil, s):
            yield Eigenvalue(eigen.value, tuple(basis * vector for vector in eigen.vectors), eigen.polynomial)


def _mode(plain: PlainEquations, expansion: Expansion, found: Eigenvalue) -> SymbolicMode:
    """Return a mode in the symbols that people see, with its numbers."""
    (symbol,) = (one for one in found.polynomial.free_symbols if one.is_Dummy and one.name in ("s", "lambda"))
    is_square, value = symbol.name == "lambda", found.value
    if value is None:
        exact = sympy.Poly(plain.exact(found.polynomial), symbol)
        roots = [complex(one) for one in exact.nroots(n=20, maxsteps=200)]
    else:
        roots = [plain.number(value)]
    numbers = {_upper(cmath.sqrt(-one) if is_square else one) for one in roots}
    square = value if is_square else None
    if value is not None and not is_square and not any(sympy.Poly(found.polynomial, symbol).all_coeffs()[1::2]):
        square = short(-(value**2))  # of gyroscopic terms
    shapes = (dict(zip(plain.paths, map(plain.told, expansion.basis * one), strict=True)) for one in found.vectors)
    rate = None if value is None else plain.told(sympy.I * sympy.sqrt(value) if is_square else value)
    polynomial = plain.told(found.polynomial.xreplace({symbol: sympy.Symbol(symbol.name)}))
    told = None if square is None else plain.told(square)
    return SymbolicMode(told, rate, tuple(shapes), polynomial, tuple(sorted(numbers, key=lambda one: one.imag)))


def _upper(value: complex) -> complex:
    """Return a root or its conjugate, whichever has the positive imaginary part; growing where it is real."""
    size = abs(value)
    real, imag = (0.0 if abs(part) <= 1e-13 * size else part for part in (value.real, value.imag))
    return complex(real, abs(imag))


# -- about which state -------------------------------------------------------------------------------------------------


def _chosen(plain: PlainEquations, at: Mapping[str, Any] | None) -> tuple[SymbolicEquilibrium, State]:
    """Return the state that was asked for: that of given values, the start if it is at rest, or one that is stable.

    Those that are stable must have the same frequencies.
    """
    numbers = _start(plain) if at is None else {path: _in_si(plain, path, value) for path, value in at.items()}
    exact = _at_rest(plain, numbers)
    if exact is not None:
        return described(plain, exact)
    found = find_symbolic(plain)
    there = [one for one in found if numbers and _is_there(plain, one[0], numbers)]
    if at is None and not there:
        there = [one for one in found if one[0].stability == "stable"]
    if len(there) == 1 or (at is None and len({_frequencies(one) for _, one in there}) == 1):
        return there[0]
    ahead = "its start is not at rest, and " if at is None else ""
    listed = "; ".join(
        f"{', '.join(f'{path} = {value:.6g}' for path, value in one.numbers.items())} ({one.stability})"
        for one, _ in found
    )
    raise UsageError(
        f"{ahead}{len(there)} of its states of rest {'are stable' if at is None else 'have these values'}: {listed}",
        where=plain.name,
        advice="Say about which state with `at`.",
    )


def _frequencies(state: State) -> Sympy:
    """Return what the frequencies about a state are roots of: states that mirror each other have the same."""
    one, s = state.expansion, sympy.Symbol("s")
    return None if one is None else characteristic(one.mass, one.damping, one.stiffness, s).monic()


def _start(plain: PlainEquations) -> dict[str, float]:
    """Return the coordinates of the scene's start; nothing if it moves."""
    start = find_start(plain.equations.assembly)
    if len(start.coordinates) != len(plain.paths) or abs(start.speeds).max(initial=0.0) > 0.0:
        return {}
    return dict(zip(plain.paths, map(float, start.coordinates), strict=True))


def _in_si(plain: PlainEquations, path: str, value: Any) -> float:
    check_known(path, plain.paths, "it is no coordinate")
    unit = plain.equations.expressions.names[plain.paths.index(path)].unit
    return float(parse_quantity(value, parse_unit(unit), path)) if isinstance(value, str) else float(value)


def _is_there(plain: PlainEquations, one: SymbolicEquilibrium, numbers: Mapping[str, float]) -> bool:
    """Return whether a state of rest has given values, angles up to whole turns."""
    if one.stability == "does not exist":
        return False
    for path, value in numbers.items():
        apart = value - one.numbers.get(path, value)
        if plain.is_angle[plain.paths.index(path)]:
            apart = math.remainder(apart, 2.0 * math.pi)
        if abs(apart) > _SAME * (1.0 + abs(value)):
            return False
    return True


_SAME = 1e-5
"""Relative: so near must values be to a state that is meant; states are listed with six digits."""


def _at_rest(plain: PlainEquations, numbers: Mapping[str, float]) -> Solution | None:
    """Return the state at exact values, such as 0 or half a turn, if it is at rest whatever the parameters are."""
    if set(numbers) != set(plain.paths):
        return None
    values = {}
    for path, q in zip(plain.paths, plain.coordinates, strict=True):
        number = as_fraction(numbers[path])
        turns = of_pi(numbers[path])
        part = number if turns is None else turns
        if isinstance(part, float):
            return None
        values[q] = sympy.Rational(part.numerator, part.denominator) * (1 if turns is None else sympy.pi)
    try:
        left = [one.subs(values) for one in plain.conditions]
        found = solve_conditions(left, plain.multipliers) if plain.multipliers else [Solution({})]
    except NoClosedFormError:
        return None
    if len(found) != 1 or (not plain.multipliers and any(short(one) != 0 for one in left)):
        return None
    return Solution({**values, **found[0].values}, found[0].conditions)
