"""Scenes in other coordinates: polar, relative and of the centre of mass, in frames that move; one after another.

With ``L = v.M v/2 + b.v + L_0`` and old coordinates ``x(q, t)``, ``J = dx/dq``, ``e = dx/dt``, the parts of L in new
coordinates are ``J^T M J``, ``J^T (b + M e)`` and ``L_0 + b.e + e.M e/2``, and its Legendre transform is
``K = H + dF/dt`` with ``F = P . q(x, t)`` (Goldstein, section 9.1). Factors of the determinant of J are positive: a
distance r where it is zero at r = 0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from atwood.arguments import BY_PATH, check, command, instance, takes
from atwood.arrays import FloatArray
from atwood.display import fitted
from atwood.errors import StartError, UnsupportedError, UsageError, suggestion
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import scipy, sympy
from atwood.model.compose.composite import Model
from atwood.simulation.initialization.start import find_start
from atwood.theory.equations.equations import EquationsOfMotion
from atwood.theory.formulas.described import Described
from atwood.theory.formulas.notation import SYMBOLS as LETTERS
from atwood.theory.formulas.printers import Sympy
from atwood.theory.formulas.reading import text_of
from atwood.theory.hamiltonian.hamiltonian import Hamiltonian, hamiltonian, start_of
from atwood.theory.hamiltonian.phase_space import EXPRESSION, SYMBOLS, spelled
from atwood.theory.hamiltonian.tidied import is_positive, length, tidied


@dataclass(frozen=True, eq=False)
class PointTransformation(Described):
    """A scene in new coordinates; everything in sympy, with new coordinates and momenta as symbols.

    Attributes
    ----------
    coordinates, velocities, momenta
        Symbols of the new coordinates, of their derivatives, and of their momenta.
    old
        What the old coordinates are in terms of the new and of time.
    lagrangian
        L in new coordinates and velocities.
    definitions
        The new momenta ``dL/dQ'`` in terms of velocities.
    hamiltonian
        The new Hamiltonian: ``K = H + dF/dt`` with ``F = P . Q(q, t)``.
    source
        The Hamiltonian in the old coordinates.
    positive
        What is taken to be positive: factors of the Jacobian determinant, such as the distance from a centre. Where one
        of them is zero the new coordinates are singular.
    solved
        The new velocities in terms of the new momenta.
    """

    coordinates: tuple[Sympy, ...]
    velocities: tuple[Sympy, ...]
    momenta: tuple[Sympy, ...]
    old: Mapping[Sympy, Sympy]
    lagrangian: Sympy
    definitions: tuple[Sympy, ...]
    hamiltonian: Sympy
    source: Hamiltonian
    positive: tuple[Sympy, ...]
    solved: tuple[Sympy, ...]

    @property
    def ignorable(self) -> tuple[Sympy, ...]:
        """The new coordinates that K does not depend on: their momenta are conserved."""
        return tuple(one for one in self.coordinates if not self.hamiltonian.has(one))

    @cached_property
    def jacobian(self) -> Sympy:
        """Derivatives of the old coordinates by the new."""
        return sympy.ImmutableMatrix([[x.diff(q) for q in self.coordinates] for x in self.old.values()])

    @cached_property
    def accelerations(self) -> dict[Sympy, Sympy]:
        """The second derivatives of the new coordinates, solved for: those of dampers and loads included."""
        inertia = sympy.Matrix([[one.diff(v) for v in self.velocities] for one in self.definitions])
        inverse, _ = _inverted(inertia, self.positive)
        moved = [*zip(self.coordinates, self.velocities, strict=True), (sympy.Symbol("t"), 1)]
        right = [
            self.lagrangian.diff(q) - sum(p.diff(one) * rate for one, rate in moved) + force
            for q, p, force in zip(self.coordinates, self.definitions, self._other_forces(), strict=True)
        ]
        found = (inverse * sympy.Matrix(right)).applyfunc(lambda one: _shorter(sympy.expand(one), self.positive))
        return {sympy.Symbol(f"{q}''"): one for q, one in zip(self.coordinates, found, strict=True)}

    def _other_forces(self) -> Sequence[Sympy]:
        """Return the generalized forces ``J^T Q`` of dampers and loads, which L does not give."""
        h, t = self.source, sympy.Symbol("t")
        if not h.other_forces:
            return [sympy.Integer(0)] * len(self.coordinates)
        eq = equations_of(h)
        losses, v = eq.rayleigh_function, {one: sympy.Dummy() for one in eq.velocities}
        slopes = [losses.xreplace(v).diff(one) for one in v.values()]
        forces = {u: q - one for u, q, one in zip(v, eq.generalized_forces, slopes, strict=True)}
        rates = self.jacobian * sympy.Matrix(self.velocities) + sympy.Matrix([x.diff(t) for x in self.old.values()])
        moved = {q.diff(t): rate for q, rate in zip(self.old, rates, strict=True)}
        moved |= {one: moved[u] for u, one in v.items()}
        found = self.jacobian.T * sympy.Matrix([forces[q.diff(t)].xreplace(moved).xreplace(self.old) for q in self.old])
        if found.atoms(sympy.core.function.AppliedUndef):
            names = ", ".join(h.other_forces)
            raise UnsupportedError("they depend on more than coordinates and velocities", where=f"{h.name}: {names}")
        return list(found)

    @cached_property
    def old_momenta(self) -> dict[Sympy, Sympy]:
        """The old momenta in terms of the new coordinates and momenta."""
        h = self.source
        explicit = [x.diff(sympy.Symbol("t")) for x in self.old.values()]
        moved = list(self.jacobian * sympy.Matrix(self.solved) + sympy.Matrix(explicit))
        rates = dict(zip((q.diff(sympy.Symbol("t")) for q in h.coordinates), moved, strict=True))
        made = [sympy.expand(one.xreplace(rates).xreplace(dict(self.old))) for one in h.definitions]
        return {
            p: sympy.Add(*(tidied(one.coeff(new)) * new for new in self.momenta), tidied(one.xreplace(self._still)))
            for p, one in zip(h.momenta, made, strict=True)
        }

    @cached_property
    def new_momenta(self) -> dict[Sympy, Sympy]:
        """The new momenta in terms of the old ones: ``P = J^T p``, in new coordinates."""
        found = self.jacobian.T * sympy.Matrix(self.source.momenta)
        return dict(zip(self.momenta, found, strict=True))

    @property
    def _still(self) -> dict[Sympy, Sympy]:
        return dict.fromkeys(self.momenta, sympy.Integer(0))

    def __repr__(self) -> str:
        names = ", ".join(map(text_of, self.coordinates))
        return fitted(f"<PointTransformation to {names}: K = {text_of(self.hamiltonian)}>")


_SCENE = instance("a scene, an assembly, or what `point_transformation` returns", Model, Assembly, PointTransformation)


@command("transform")
@takes(scene=_SCENE, old=BY_PATH, coordinates=SYMBOLS, symbols=LETTERS)
def point_transformation(
    scene: Model | Assembly | PointTransformation,
    old: Mapping[str, Any],
    coordinates: Sequence[Any],
    *,
    symbols: Mapping[str, str] | None = None,
) -> PointTransformation:
    """Return a scene in other coordinates: polar, relative and of the centre of mass, in a rotating frame.

    Parameters
    ----------
    scene
        The scene, or an assembly of it; or the scene in other coordinates, which are then transformed further.
    old
        Every coordinate of the scene by its path, in terms of the new ones, parameters and t; in sympy. Of a scene in
        other coordinates these by their names; those that are left out stay.
    coordinates
        Symbols of the new coordinates, as many as old ones.
    symbols
        See `atwood.equations`.

    Returns
    -------
    PointTransformation
        L, momenta and Hamiltonian in the new coordinates.

    Raises
    ------
    UsageError
        If a coordinate is missing or there is none of that path, or the new ones do not determine the old.
    UnsupportedError
        If the scene has no Hamiltonian in symbols, or L is of higher than second degree in the velocities.
    """
    if isinstance(scene, PointTransformation):
        paths: tuple[str, ...] = tuple(map(str, scene.coordinates))
        stay = [one for one in scene.coordinates if str(one) not in old]
        old = {**old, **{str(one): one for one in stay}}
        coordinates = (*(one for one in stay if one not in coordinates), *coordinates)
        h = scene.source
    else:
        h = hamiltonian(scene, symbols=symbols)
        paths = h.paths
    new = tuple(coordinates)
    old = read_places(old, paths, h, new)
    if len(new) != len(paths) or len(set(new)) != len(paths):
        advice = f"Give {', '.join(paths)}, each in terms of {len(paths)} new ones that are all different."
        raise UsageError(f"{len(paths)} new coordinates are needed", where=h.name, advice=advice)
    if isinstance(scene, PointTransformation):
        values = [old[path] for path in paths]
        before = dict(zip(scene.coordinates, values, strict=True))
        whole = {x: one.xreplace(before) for x, one in scene.old.items()}
        return _moved(h, scene.lagrangian, scene.coordinates, scene.velocities, values, new, whole)
    return point_transformation_of(h, old, new)


def read_places(
    given: Mapping[str, Any], paths: Sequence[str], h: Hamiltonian, new: Sequence[Sympy] = ()
) -> dict[str, Sympy]:
    """Return expressions by the paths of all coordinates, in new ones and the parameters of H."""
    where = h.name
    for path in given:
        if path not in paths:
            advice = suggestion(path, paths) or f"There are {', '.join(paths)}."
            raise UsageError(f"{path!r} is no coordinate of it", where=where, advice=advice)
    missing = [path for path in paths if path not in given]
    if missing:
        advice = f"Give {', '.join(paths)}, each in terms of others."
        raise UsageError(f"the coordinates leave out {', '.join(missing)}", where=where, advice=advice)
    return {path: spelled(check(EXPRESSION, given[path], path, where), h.values, new) for path in paths}


def equations_of(h: Hamiltonian) -> EquationsOfMotion:
    """Return Lagrange's equations of a Hamiltonian's scene, in its letters."""
    return EquationsOfMotion(h.assembly, h.formulas.expressions, h.formulas.notation)


def point_transformation_of(
    h: Hamiltonian, old: Mapping[str, Sympy], new: tuple[Sympy, ...], numbers: Mapping[Sympy, Sympy] | None = None
) -> PointTransformation:
    """Return a scene in new coordinates, from its Hamiltonian in the old ones; symbols may stand for numbers."""
    if not h.is_short:
        raise UnsupportedError("its Hamiltonian would fill a page", where=h.name, advice="It is there in numbers.")
    values, eq = [old[path] for path in h.paths], equations_of(h)
    whole = dict(zip(h.coordinates, values, strict=True))
    return _moved(h, eq.lagrangian.xreplace(numbers or {}), eq.coordinates, eq.velocities, values, new, whole)


def _moved(
    h: Hamiltonian,
    lagrangian: Sympy,
    coordinates: Sequence[Sympy],
    velocities: Sequence[Sympy],
    values: Sequence[Sympy],
    new: tuple[Sympy, ...],
    whole: Mapping[Sympy, Sympy],
) -> PointTransformation:
    """Return a scene in new coordinates from L in old ones, and these in terms of the new."""
    v = [sympy.Dummy() for _ in velocities]
    plain = lagrangian.xreplace(dict(zip(velocities, v, strict=True)))
    plain = plain.xreplace(dict(zip(coordinates, values, strict=True)))
    still = dict.fromkeys(v, sympy.Integer(0))
    slopes = [plain.diff(one) for one in v]
    mass = sympy.Matrix([[one.diff(other) for other in v] for one in slopes])
    if mass.has(*v):
        raise UnsupportedError("its Lagrangian is of higher than second degree in the velocities", where=h.name)
    linear = sympy.Matrix([one.xreplace(still) for one in slopes])
    by_new = sympy.Matrix([[one.diff(x) for x in new] for one in values])
    explicit = sympy.Matrix([one.diff(sympy.Symbol("t")) for one in values])
    known = [one for one in new if one.is_positive] + [one for one, value in h.values.items() if value > 0.0]
    inertia = (by_new.T * mass * by_new).applyfunc(lambda one: tidied(one, known))
    inverse, determinant = _inverted(inertia, known)
    if determinant == 0:
        raise UsageError(
            "the new coordinates do not determine the old ones: their Jacobian is zero",
            where=h.name,
            advice="Give as many independent coordinates as the scene has.",
        )
    positive = _factors(tidied(determinant, known), new)
    own = (by_new.T * (linear + mass * explicit)).applyfunc(lambda one: tidied(one, [*known, *positive]))
    rest = plain.xreplace(still) + (linear.T * explicit)[0, 0] + (explicit.T * mass * explicit)[0, 0] / 2
    rates = sympy.Matrix([sympy.Symbol(f"{one.name}'") for one in new])
    momenta = sympy.Matrix([sympy.Symbol(f"p_{one.name}") for one in new])
    n, signs = len(new), [*known, *positive]

    def quadratic(matrix: Sympy, vector: Sympy, of: Sympy, last: Sympy) -> Sympy:
        """Return a polynomial of second degree, each coefficient as short as it comes."""
        pairs = [(i, j) for i in range(n) for j in range(i + 1)]
        squares = (matrix[i, j] * of[i] * of[j] * sympy.Rational(2 - (i == j), 2) for i, j in pairs)
        return sympy.Add(*squares, *(tidied(vector[i], signs) * of[i] for i in range(n)), last)

    apart = sympy.Add(*(_shorter(one, signs) for one in sympy.Add.make_args(rest)))
    found = quadratic(inertia, own, rates, _shorter(apart, signs))
    turned = inverse * own
    last = _shorter((own.T * turned)[0, 0] / 2 - apart, signs)
    k = quadratic(inverse, -turned, momenta, last)
    solved = (inverse * (momenta - own)).applyfunc(sympy.expand)
    definitions = tuple(_shorter(one, signs) for one in inertia * rates + own)
    return PointTransformation(
        new, tuple(rates), tuple(momenta), dict(whole), found, definitions, k, h, positive, tuple(solved)
    )


def _shorter(value: Sympy, positive: Sequence[Sympy]) -> Sympy:
    """Return an expression as a sum of tidied terms, or tidied as a whole where that is far shorter."""
    parts = sympy.Add(*(tidied(one, positive) for one in sympy.Add.make_args(value)))
    whole = tidied(parts, positive)
    return min((sympy.expand(whole), 1), (parts, 1), (whole, 2), key=lambda one: length(one[0]) * one[1])[0]


def _inverted(matrix: Sympy, known: Sequence[Sympy]) -> tuple[Sympy, Sympy]:
    """Return the inverse of a symmetric matrix and its determinant, block by block."""
    n = matrix.shape[0]
    inverse, determinant = sympy.zeros(n, n), sympy.Integer(1)
    for block in sympy.utilities.iterables.connected_components(
        (list(range(n)), [(i, j) for i in range(n) for j in range(n) if matrix[i, j] != 0])
    ):
        size = len(block)
        part = matrix.extract(block, block).row_join(sympy.eye(size))
        for k in range(size):  # by Gauss and Jordan: each entry is made short before others are made of it
            pivot = part[k, k]
            determinant *= pivot
            if pivot == 0:
                return inverse, pivot
            part[k, :] = (part[k, :] / pivot).applyfunc(lambda one: tidied(one, known))
            for i in set(range(size)) - {k}:
                part[i, :] = (part[i, :] - part[i, k] * part[k, :]).applyfunc(lambda one: tidied(one, known))
        for a, i in enumerate(block):
            for b, j in enumerate(block):
                inverse[i, j] = part[a, size + b]
    return inverse, determinant


def _factors(determinant: Sympy, new: Sequence[Sympy]) -> tuple[Sympy, ...]:
    """Return the factors of a determinant of a mass matrix that depend on coordinates."""
    found = (one.as_base_exp()[0] for one in sympy.Mul.make_args(sympy.factor(determinant)))
    return tuple(-one if is_positive(-one, ()) else one for one in found if one.has(*new))


_TRIALS = 60
"""Starts of Newton's method for the new coordinates."""


def refuse_letters(given: PointTransformation) -> None:
    """Refuse what has letters that are neither coordinates nor parameters of the scene."""
    held = {*given.coordinates, *given.velocities, *given.source.values, sympy.Symbol("t")}
    stray = sorted(map(str, given.lagrangian.free_symbols - held))
    if stray:
        raise UnsupportedError(
            f"{', '.join(stray)} in its coordinates have no value",
            where=given.source.name,
            advice="Transform with numbers in their places.",
        )


def _rounded(values: FloatArray, inverse: FloatArray, sizes: FloatArray) -> FloatArray:
    """Return new coordinates or rates, zero where they are the rounding of old ones of some sizes."""
    off = 8.0 * np.finfo(float).eps * np.abs(inverse) @ sizes
    return np.where(np.abs(values) <= off, 0.0, values)


def start_in(given: PointTransformation) -> tuple[float, FloatArray, FloatArray]:
    """Return time, new coordinates and their derivatives where a scene starts."""
    h = given.source
    refuse_letters(given)
    start = find_start(h.assembly)
    q, v = start_of(h.assembly)
    t = sympy.Symbol("t")
    old = [one.xreplace(h.values) for one in given.old.values()]
    by_new = [[one.diff(x) for x in given.coordinates] for one in old]
    symbols = (*given.coordinates, t)
    place, slope, explicit = (
        sympy.lambdify(symbols, what, "numpy") for what in (old, by_new, [one.diff(t) for one in old])
    )

    positive = [one for one in given.coordinates if one.is_positive]
    signs = sympy.lambdify(symbols, [one.xreplace(h.values) for one in (*positive, *given.positive)], "numpy")

    def missing(x: Any) -> FloatArray:
        return np.asarray(place(*x, start.time), dtype=float) - q

    distances = [
        one.is_positive or any(one in factor.free_symbols for factor in given.positive) for one in given.coordinates
    ]
    random = np.random.default_rng(11)
    for trial in range(_TRIALS):
        guess = start.length * random.uniform(0.1, 2.0, len(q)) if trial else np.abs(q) + 0.1 * start.length
        if trial % 2:  # angles may be anywhere
            guess = np.where(distances, guess, random.uniform(-np.pi, np.pi, len(q)))
        with np.errstate(all="ignore"):
            found = scipy.optimize.least_squares(missing, guess, xtol=3e-16, ftol=3e-16, gtol=3e-16)
        is_met = np.max(np.abs(found.fun)) <= 1e-13 * (np.max(np.abs(q)) + start.length)
        if is_met and min(signs(*found.x, start.time), default=1.0) > 0.0:
            matrix = np.array(slope(*found.x, start.time), dtype=float)
            own = np.asarray(explicit(*found.x, start.time), dtype=float)
            inverse = np.linalg.inv(matrix)
            sizes = np.array([start.length if one.unit == "m" else 1.0 for one in h.assembly.reduced.names])
            pace = np.max(np.abs(v - own) / sizes)
            return start.time, _rounded(found.x, inverse, sizes), _rounded(inverse @ (v - own), inverse, pace * sizes)
    raise StartError("its start is at no values of the new coordinates that are found", where=h.name)
