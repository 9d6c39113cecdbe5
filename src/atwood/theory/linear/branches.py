"""`equilibrium_branches`: equilibria while a parameter changes, with folds and branch points.

They are solutions of ``r(x, p) = 0``, followed by arc length. Pseudo-arclength continuation (Keller, in Applications
of Bifurcation Theory, 1977; Allgower and Georg, Numerical Continuation Methods, 1990, chapters 2 and 8): a tangent
predicts, Newton's method corrects across it. Where the determinant of the equations with the tangent changes its sign
another branch crosses, along the null vector there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from atwood.arguments import TEXT, Kind, Refused, real, takes
from atwood.arrays import BoolArray, FloatArray
from atwood.display import data_of
from atwood.errors import AtwoodError, UsageError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import scipy
from atwood.model.compose.composite import Model
from atwood.numerics.matrices import or_one
from atwood.numerics.newton import Missing, largest, newton
from atwood.numerics.rank import decompose
from atwood.pipeline import SCENE, smooth_assembly_of
from atwood.ranges import range_of
from atwood.simulation.dynamics.balance import balance_of
from atwood.table import Shown, Table, table
from atwood.theory.linear.equilibria import REGION, numeric_equilibria
from atwood.theory.linear.normal_modes import modes_of, values_text
from atwood.theory.linear.operating_point import OperatingPoint, find_operating_point, moved_to, values_at
from atwood.theory.linear.rest import difference, slopes_at
from atwood.theory.linear.variations import LinearScene
from atwood.tolerances import tolerances

_SEEDS = (0.02, 0.5, 0.98)
"""Where in the parameter's range equilibria are looked for to begin with."""

_MOST_BRANCHES = 40

_DIFFERENCE = 1e-6
"""Relative: how far a parameter is moved to see what it does. Only Newton's steps depend on it, not what is found."""


@dataclass(frozen=True)
class BranchPoint:
    """A point at which a branch turns back, or another crosses it.

    Attributes
    ----------
    parameter
        Value of the parameter.
    values
        Coordinates by path.
    """

    parameter: float
    values: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class EquilibriumBranch:
    """Equilibria that belong together.

    Attributes
    ----------
    parameter
        Values of the parameter, shape (points,).
    values
        Coordinates by path, each of shape (points,).
    stable
        Whether each is stable, shape (points,).
    """

    parameter: FloatArray
    values: Mapping[str, FloatArray]
    stable: BoolArray


@dataclass(frozen=True, eq=False)
class EquilibriumBranches(Shown):
    """The equilibria of a scene over a parameter.

    Attributes
    ----------
    path
        The parameter.
    branches
        The branches.
    folds, crossings
        Where branches turn back, and where they cross.
    scene
        Name of the scene.
    """

    path: str
    branches: tuple[EquilibriumBranch, ...]
    folds: tuple[BranchPoint, ...]
    crossings: tuple[BranchPoint, ...]
    scene: str

    def to_data(self) -> dict[str, Any]:
        """Return them as plain data, for JSON."""
        return data_of(self, "scene", "path", "branches", "folds", "crossings")

    def tables(self) -> tuple[Table, ...]:
        """Return where each branch goes, and where branches turn back or cross."""
        rows = []
        for one in self.branches:
            shares = f"{int(one.stable.sum())} of {len(one.stable)} points stable"
            ends = ", ".join(f"{path} {x[0]:.5g} to {x[-1]:.5g}" for path, x in list(one.values.items())[:3])
            rows.append((f"{one.parameter[0]:.6g} to {one.parameter[-1]:.6g}", ends, shares))
        notes = [
            f"{kind} at {self.path} = {one.parameter:.10g}: {values_text(one.values)}"
            for kind, points in (("fold", self.folds), ("branch point", self.crossings))
            for one in points
        ]
        title = f"{self.scene}: {len(self.branches)} branches of equilibria over {self.path}"
        return (table((self.path, "coordinates at the ends", ""), rows, title, notes),)

    __str__ = Shown.as_text


def _read_span(value: Any) -> tuple[float, float]:
    if isinstance(value, (set, frozenset)):
        raise Refused
    low, high = (real(one) for one in value)
    if not (np.isfinite(low) and np.isfinite(high) and low < high):
        raise ValueError
    return low, high


@takes(
    scene=SCENE,
    path=TEXT,
    span=Kind("the least and the largest value", _read_span, "FROM:TO", range_of),
    region=REGION,
)
def equilibrium_branches(
    scene: Model | Assembly, path: str, span: tuple[float, float], *, region: Mapping[str, Any] | None = None
) -> EquilibriumBranches:
    """Follow the equilibria of a scene while a parameter changes.

    Equilibria are looked for at three values of the parameter, as by `equilibria`, and followed from there by arc
    length; where another branch crosses, it is followed too. Folds and branch points are located to 1e-10.

    Parameters
    ----------
    scene
        The scene, or an assembly of it.
    path
        The parameter.
    span
        Its least and its largest value, SI units.
    region
        See `equilibria`.

    Returns
    -------
    EquilibriumBranches
        The branches.

    Raises
    ------
    UsageError
        If there is no equilibrium at any of the three values.
    ParameterError
        If there is no such parameter.
    """
    base = smooth_assembly_of(scene)
    family = _Family(base, path, *span)
    curves: list[Curve] = []
    waiting: list[tuple[FloatArray, float, FloatArray]] = []
    problem_error: AtwoodError | None = None
    for share in _SEEDS:
        p = span[0] + share * (span[1] - span[0])
        try:
            found = numeric_equilibria(family.assembly(p), region=region)
        except UsageError as error:
            problem_error = error
            continue
        for one in found:
            x = family.unknowns(one.modes.point.q)
            for sign in (1.0, -1.0):
                waiting.append((x, family.scaled(p), np.append(np.zeros(len(x)), sign)))
    if not waiting:
        raise problem_error or UsageError("no equilibrium was found", where=path)
    problem = Problem(family.residual, family.scaled(span[0]), family.scaled(span[1]))
    crossings: list[tuple[FloatArray, float]] = []
    while waiting and len(curves) < _MOST_BRANCHES:
        x, p, direction = waiting.pop(0)
        if _known(curves, x, p, direction):
            continue
        curve = follow(problem, x, p, direction)
        if len(curve.p) < 2:
            continue
        curves.append(curve)
        for there in curve.crossings:
            if not any(_near(there, other) for other in crossings):
                crossings.append(there)
                waiting += branch_directions(problem, *there)
    folds: list[tuple[FloatArray, float]] = []
    for curve in curves:
        folds += [one for one in curve.folds if not any(_near(one, other) for other in folds)]
    folds = [one for one in folds if not any(_near(one, other, 1e-4) for other in crossings)]
    return EquilibriumBranches(
        path,
        tuple(family.branch(curve) for curve in _joined(curves)),
        tuple(family.named(*one) for one in folds),
        tuple(family.named(*one) for one in crossings),
        base.flat.name,
    )


def _joined(curves: Sequence[Curve]) -> list[Curve]:
    """Return curves with those made one that begin at the same point and lead away from it to both sides."""
    found: list[Curve] = []
    for curve in curves:
        first = (curve.x[0], float(curve.p[0]))
        other = next((one for one in found if _near(first, (one.x[0], float(one.p[0])), 1e-9)), None)
        if other is None:
            found.append(curve)
            continue
        x = np.concatenate([other.x[:0:-1], curve.x])
        p = np.concatenate([other.p[:0:-1], curve.p])
        found[found.index(other)] = Curve(x, p, other.folds + curve.folds, other.crossings + curve.crossings)
    return found


def _near(one: tuple[FloatArray, float], other: tuple[FloatArray, float], by: float = 1e-5) -> bool:
    return bool(abs(one[1] - other[1]) < by and np.max(np.abs(one[0] - other[0]), initial=0.0) < 100.0 * by)


def _known(curves: Sequence[Curve], x: FloatArray, p: float, direction: FloatArray) -> bool:
    """Return whether a point lies on a curve that was followed already, past it in its direction."""
    for curve in curves:
        for i in range(len(curve.p) - 1):
            first, second = np.append(curve.x[i], curve.p[i]), np.append(curve.x[i + 1], curve.p[i + 1])
            way = second - first
            length = float(np.linalg.norm(way))
            share = float((np.append(x, p) - first) @ way) / max(length**2, 1e-300)
            if not -1e-6 <= share <= 1.0 + 1e-6:
                continue
            off = float(np.linalg.norm(np.append(x, p) - first - share * way))
            at_start = i == 0 and share < 1e-3
            if off < 0.2 * length**2 + 1e-8 and not (at_start and float(way @ direction) < 0.0):
                return True
    return False


class _Family:
    """A scene for all values of a parameter, in unknowns of size one.

    Parameters
    ----------
    base, path, low, high
        The scene, the parameter and its range.
    """

    def __init__(self, base: Assembly, path: str, low: float, high: float) -> None:
        self._base, self._path, self._low, self._range = base, path, low, high - low
        self._points: dict[float, OperatingPoint] = {}
        self._origin = find_operating_point(self.assembly(0.5 * (low + high)), {}, ())
        scene, kept = self._origin.scene, self._origin.kept
        flow = scene.flow(self._origin.t, self._origin.q, np.zeros(len(scene.sizes)), kept)
        minimal, _, slopes = slopes_at(scene, flow, kept)
        moving = np.max(np.abs(slopes), axis=0, initial=0.0) > 1e-9 * np.max(np.abs(slopes), initial=0.0)
        self._numbers = [k for k, is_moving in zip(minimal.displacements, moving, strict=True) if is_moving]

    def assembly(self, p: float) -> Assembly:
        """Return the scene at a value of the parameter."""
        return self._base.with_values({self._path: p})

    def scaled(self, p: float) -> float:
        """Return the parameter in units of its range."""
        return (p - self._low) / self._range

    def unknowns(self, q: FloatArray) -> FloatArray:
        """Return the displacements from the origin that count, in the scene's sizes."""
        scene = self._origin.scene
        found = difference(scene, self._origin.q, q) / scene.displacement_sizes
        return np.asarray(found[self._numbers])

    def _point(self, p: float) -> OperatingPoint:
        value = self._low + p * self._range
        if value not in self._points:
            if len(self._points) > 16:
                self._points.clear()
            assembly = self.assembly(value)
            scene = LinearScene(assembly, "reduced")
            origin = self._origin
            self._points[value] = OperatingPoint(
                assembly, scene, origin.t, origin.q, origin.u, origin.finding, (), False
            )
        return self._points[value]

    def _place(self, point: OperatingPoint, x: FloatArray) -> FloatArray:
        scene = self._origin.scene
        moved = np.zeros(len(scene.tangents))
        moved[self._numbers] = x * scene.displacement_sizes[self._numbers]
        q = scene.tangents.moved(self._origin.q, moved)
        if not point.kept:
            return q
        held = point.scene.sizes.copy()
        held[[k for k in self._numbers if k < len(held)]] *= 1e-9  # what is followed stays, the others close the loops
        return balance_of(point.assembly, "reduced").project(point.t, q, np.zeros(len(held)), held)[0]

    def _forces(self, x: FloatArray, p: float) -> tuple[FloatArray, FloatArray]:
        """Return generalized forces along what is followed, with their derivatives by it."""
        point = self._point(p)
        scene = point.scene
        flow = scene.flow(point.t, self._place(point, x), np.zeros(len(scene.sizes)), point.kept)
        minimal, a, slopes = slopes_at(scene, flow, point.kept)
        n = len(minimal.speeds)
        own = scene.sizes[list(minimal.speeds)]
        u = minimal.speed[:, len(minimal.displacements) : minimal.states]
        mass = (u.T @ flow.variation.by["force", "a"] @ u) * own
        size = np.max(np.abs(mass), axis=1, initial=0.0)[:, None]
        mass = mass / or_one(size)
        a, slopes = np.append(mass @ a[:n], a[n:]), np.vstack([mass @ slopes[:n], slopes[n:]])
        columns = [i for i, k in enumerate(minimal.displacements) if k in self._numbers]
        rows = [i for i in columns if i < len(a)]
        return a[rows], slopes[np.ix_(rows, columns)]

    def residual(self, x: FloatArray, p: float, by_p: FloatArray | None = None) -> Residual | None:
        """Return the equations at a point, with given derivatives by the parameter; None where a law has no value."""
        try:
            value, by_x = self._forces(x, p)
            if by_p is not None:
                return Residual(value, by_x, by_p)
            ahead, behind = (self._forces(x, p + sign * _DIFFERENCE)[0] for sign in (1.0, -1.0))
        except (AtwoodError, ArithmeticError, np.linalg.LinAlgError):
            return None
        return Residual(value, by_x, (ahead - behind) / (2.0 * _DIFFERENCE))

    def _state(self, x: FloatArray, p: float) -> OperatingPoint:
        point = self._point(p)
        return moved_to(point, self._place(point, x), np.zeros(len(point.scene.sizes)))

    def _values(self, point: OperatingPoint) -> dict[str, float]:
        count = len(point.scene.tangents.plain)
        return dict(list(values_at(point).items())[:count])

    def named(self, x: FloatArray, p: float) -> BranchPoint:
        """Return a point by the paths of its coordinates."""
        return BranchPoint(self._low + p * self._range, self._values(self._state(x, p)))

    def branch(self, curve: Curve) -> EquilibriumBranch:
        """Return a branch by the paths of its coordinates, with stability."""
        states = [self._state(x, p) for x, p in zip(curve.x, curve.p, strict=True)]
        stable = np.array([modes_of(one, is_steady=True).is_stable for one in states])
        rows = [self._values(one) for one in states]
        values = {path: np.array([row[path] for row in rows]) for path in (rows[0] if rows else {})}
        return EquilibriumBranch(self._low + curve.p * self._range, values, stable)


_FIRST, _LARGEST, _SMALLEST = 1e-2, 5e-2, 1e-7
"""Arc length of steps, where every unknown and the parameter's range have size one."""

_MOST_STEPS = 2000

_NEARLY = 100.0
"""Times `tolerances.MET`: what is a solution where rounding leaves no better."""

_FAR = 0.5
"""A step of Newton's method that is longer leads to another branch."""

_STEPS = 12

_ASIDE = 1e-3
"""How far from a branch point a branch that crosses is looked for."""


class _Nowhere(ArithmeticError):
    """There are no residuals at a point, or it is too far away."""


class Residual(NamedTuple):
    """Residuals at a point, with their derivatives by the unknowns and by the parameter."""

    value: FloatArray
    by_x: FloatArray
    by_p: FloatArray


@dataclass(frozen=True, eq=False)
class Problem:
    """What is solved, in unknowns of size one.

    Attributes
    ----------
    at
        Residuals at (x, p); None where there are none. Their derivatives by the parameter may be given, from near by.
    low, high
        Range of the parameter, of length one.
    """

    at: Callable[[FloatArray, float, FloatArray | None], Residual | None]
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Curve:
    """A branch.

    Attributes
    ----------
    x, p
        Its points, shape (points, unknowns) and (points,).
    folds
        Points at which the parameter turns back, as (x, p).
    crossings
        Points at which another branch crosses, as (x, p).
    """

    x: FloatArray
    p: FloatArray
    folds: tuple[tuple[FloatArray, float], ...]
    crossings: tuple[tuple[FloatArray, float], ...]


@dataclass(frozen=True, eq=False)
class _Point:
    x: FloatArray
    p: float
    tangent: FloatArray
    determinant: float


def follow(problem: Problem, x: FloatArray, p: float, direction: FloatArray) -> Curve:
    """Return the branch from a solution in one direction, to the end of the parameter's range."""
    now = _point(problem, x, p, direction)
    if now is None:
        return Curve(x[None], np.array([p]), (), ())
    points, folds, crossings = [now], [], []
    step = _FIRST
    for _ in range(_MOST_STEPS):
        later = _step(problem, now, step)
        if later is None or float(later.tangent @ now.tangent) < 0.9:
            step *= 0.5
            if step < _SMALLEST:
                break
            continue
        if later.tangent[-1] * now.tangent[-1] < 0.0:
            folds += _located(problem, now, step, lambda point: point.tangent[-1])
        if later.determinant * now.determinant < 0.0:
            crossings += _located(problem, now, step, lambda point: point.determinant)
        if not problem.low <= later.p <= problem.high:
            edge = problem.low if later.p < problem.low else problem.high
            points += _at_edge(problem, now, later, edge)
            break
        points.append(later)
        closed = len(points) > 10 and np.linalg.norm(_whole(later) - _whole(points[0])) < 0.5 * step
        now, step = later, min(1.4 * step, _LARGEST)
        if closed:
            break
    return Curve(
        np.array([one.x for one in points]), np.array([one.p for one in points]), tuple(folds), tuple(crossings)
    )


def branch_directions(problem: Problem, x: FloatArray, p: float) -> list[tuple[FloatArray, float, FloatArray]]:
    """Return points beside a branch point on the branch that crosses there, with directions away from it."""
    found: list[tuple[FloatArray, float, FloatArray]] = []
    residual = problem.at(x, p, None)
    if residual is None:
        return found
    along = np.append(decompose(residual.by_x).right[-1], 0.0)
    for sign in (1.0, -1.0):
        start = np.append(x, p) + sign * _ASIDE * along
        solved = _corrected(problem, start, sign * along)
        if solved is not None:
            found.append((solved[:-1], float(solved[-1]), sign * along))
    return found


def _whole(point: _Point) -> FloatArray:
    return np.append(point.x, point.p)


def _point(problem: Problem, x: FloatArray, p: float, direction: FloatArray) -> _Point | None:
    """Return a solution with its unit tangent in a direction."""
    residual = problem.at(x, p, None)
    if residual is None:
        return None
    matrix = np.hstack([residual.by_x, residual.by_p[:, None]])
    tangent = decompose(matrix).right[-1]
    tangent = tangent if float(tangent @ direction) >= 0.0 else -tangent
    sign, size = np.linalg.slogdet(np.vstack([matrix / or_one(np.max(np.abs(matrix), axis=1, keepdims=True)), tangent]))
    return _Point(x, p, tangent, float(sign * np.exp(size / (len(x) + 1))))


def _step(problem: Problem, now: _Point, length: float) -> _Point | None:
    solved = _corrected(problem, _whole(now) + length * now.tangent, now.tangent)
    return None if solved is None else _point(problem, solved[:-1], float(solved[-1]), now.tangent)


def _corrected(problem: Problem, guess: FloatArray, across: FloatArray) -> FloatArray | None:
    """Return the solution in the plane through a guess across a direction; None if Newton's method finds none."""
    by_p: FloatArray | None = None

    def look(whole: FloatArray) -> Missing:
        nonlocal by_p
        residual = problem.at(whole[:-1], float(whole[-1]), by_p)
        if residual is None:
            raise _Nowhere
        by_p = residual.by_p  # which changes little over a step
        matrix = np.vstack([np.hstack([residual.by_x, residual.by_p[:, None]]), across])
        rows = or_one(np.max(np.abs(matrix), axis=1))
        return Missing(np.append(residual.value, across @ (whole - guess)), rows, lambda: matrix)

    def moved(whole: FloatArray, step: FloatArray) -> FloatArray:
        if largest(step) > _FAR:
            raise _Nowhere
        return whole + step

    try:
        found, left = newton(look, moved, guess, np.ones(len(guess)), steps=_STEPS, met=tolerances.MET)
    except _Nowhere:
        return None
    return found if left.miss <= _NEARLY * tolerances.MET else None


def _located(
    problem: Problem, now: _Point, step: float, value: Callable[[_Point], float]
) -> list[tuple[FloatArray, float]]:
    """Return where along a step a function of the point is zero."""

    def at(length: float) -> float:
        point = now if length == 0.0 else _step(problem, now, length)
        return np.nan if point is None else value(point)

    try:
        length = scipy.optimize.brentq(at, 0.0, step, xtol=1e-13, rtol=1e-13)
    except (ValueError, RuntimeError):
        return []
    point = _step(problem, now, float(length)) or now
    return [(point.x, point.p)]


def _at_edge(problem: Problem, now: _Point, later: _Point, edge: float) -> list[_Point]:
    """Return the solution at the end of the parameter's range."""
    share = (edge - now.p) / (later.p - now.p)
    guess = np.append(now.x + share * (later.x - now.x), edge)
    across = np.zeros(len(guess))
    across[-1] = 1.0
    solved = _corrected(problem, guess, across)
    point = None if solved is None else _point(problem, solved[:-1], edge, now.tangent)
    return [] if point is None else [point]
