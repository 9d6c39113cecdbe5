"""`action`: the integral of the Lagrangian along a run or a path, and its change when these are varied."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import Any, TypeAlias

import numpy as np
from numpy.polynomial import legendre

from atwood.arguments import instance, optional, takes
from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, UnsupportedError, UsageError, check_known
from atwood.expr import Expression, Program, jacobian_by_rows, vjp
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.lagrangian import Lagrangian, lagrangian_along_speeds
from atwood.forms.program import rates_are_speeds
from atwood.forms.quantities import coordinate_program
from atwood.lazy_dataclasses import dataclass, replace
from atwood.lazy_modules import sympy
from atwood.model.compose.composite import Model
from atwood.pipeline import simulate, smooth_assembly_of
from atwood.result.result import Result
from atwood.result.work import joined_times, nodes_between
from atwood.simulation.problem.arguments import RTOL, T_END, check_span
from atwood.simulation.run.run_record import Run, run_again, times_of_steps
from atwood.theory.formulas.described import Described
from atwood.theory.hamiltonian.hamiltonian import read_hamiltonian
from atwood.theory.hamiltonian.phase_space import as_expression

PATH = replace(instance("a dictionary of functions of time by path", Mapping), word="PATH=EXPRESSION", is_many=True)

_PROGRAM: Key[Program] = Key("action")
_Groups: TypeAlias = Callable[[Lagrangian], Mapping[str, Sequence[Expression]]]
_PANELS, _MODES = 64, 8
_AT_ENDS = 1e-9
"""A direction vanishes at the ends where it is so small, of its largest size."""


@dataclass(frozen=True, eq=False)
class Variation:
    """First variations of an action.

    Attributes
    ----------
    names
        The directions.
    values
        The variations, J s for a direction in the units of the coordinates.
    relative
        The same divided by the integral of the sizes of the terms that cancel.
    """

    names: tuple[str, ...]
    values: FloatArray
    relative: FloatArray

    @property
    def largest(self) -> float:
        """The largest relative variation."""
        return float(np.max(np.abs(self.relative), initial=0.0))

    def __repr__(self) -> str:
        return f"<Variation in {len(self.names)} directions: at most {self.largest:.2g} of the terms that cancel>"


@dataclass(frozen=True, eq=False)
class SecondVariation(Described):
    """The second variation of an action as a quadratic form.

    Attributes
    ----------
    names
        The directions.
    matrix
        The form on these, J s for directions in the units of the coordinates: the second derivatives of S.
    index
        How many independent directions lower the action: for a motion, the number of points conjugate to its start that
        it has passed (Morse), as far as these directions tell them.
    """

    names: tuple[str, ...]
    matrix: FloatArray
    index: int

    def __repr__(self) -> str:
        return f"<SecondVariation on {len(self.names)} directions: {self.index} of them lower the action>"


@dataclass(frozen=True, eq=False)
class Action(Described):
    """The action ``S``, the integral of L along a motion or a path, and its derivatives by the ends.

    For a motion, S as a function of its ends is Hamilton's principal function: ``dS/dq = p`` and ``dS/dt = -H`` at the
    end, with the other signs at the start (Landau and Lifshitz, Mechanics, section 43).

    Attributes
    ----------
    name
        The scene.
    value
        S, J s.
    error
        Of the quadrature, as estimated by half as many points.
    time
        Of start and end, s.
    coordinates
        Their paths.
    ends
        Coordinates at start and end, a row each.
    momenta
        Momenta at start and end, a row each; None where speeds are no derivatives of the coordinates.
    energies
        ``p q' - L`` at start and end, J.
    """

    name: str
    value: float
    error: float
    time: tuple[float, float]
    coordinates: tuple[str, ...]
    ends: FloatArray
    momenta: FloatArray | None
    energies: tuple[float, float]
    _pieces: tuple[_Piece, ...] = field(repr=False)

    @property
    def gradient(self) -> dict[str, float]:
        """``dS/dq = p`` at the end, by path.

        Raises
        ------
        UnsupportedError
            If velocities are no derivatives of the coordinates, as for orientations in space.
        """
        return dict(zip(self.coordinates, self._momenta()[1].tolist(), strict=True))

    @property
    def time_derivative(self) -> float:
        """``dS/dt = -H`` at the end, J."""
        return -self.energies[1]

    @property
    def initial_gradient(self) -> dict[str, float]:
        """``dS/dq = -p`` at the start, by path; errors as of `gradient`."""
        return dict(zip(self.coordinates, (-self._momenta()[0]).tolist(), strict=True))

    @property
    def initial_time_derivative(self) -> float:
        """``dS/dt = H`` at the start, J."""
        return self.energies[0]

    def variation(self, direction: Mapping[str, Any] | None = None) -> Variation:
        """Return the first variation, the integral of ``dL/dq eta + p eta'`` for directions eta with fixed ends.

        It is computed as it stands, by quadrature in each step of the solver: nothing is integrated by parts, which
        would give the equations of motion, and with them zero. So on a motion it is as small as the solver is accurate.

        Parameters
        ----------
        direction
            By path: numbers, text or sympy expressions in t, or functions of arrays of times. If not given, each
            coordinate moves as ``sin(k pi (t - t0)/(t1 - t0))``, k from 1 to 8: any direction is a sum of such.

        Raises
        ------
        UsageError
            If a direction does not vanish at the ends.
        UnsupportedError
            See `gradient`.
        """
        names, curves = self._directions(direction)
        values, sizes = np.zeros(len(names)), np.zeros(len(names))
        for piece, found in zip(self._pieces, curves, strict=True):
            first = np.concatenate([piece.slopes, piece.momenta])
            values += np.einsum("ait,it,t->a", found, first, piece.nodes.weights)
            sizes += np.einsum("ait,it,t->a", np.abs(found), np.abs(first), piece.nodes.weights)
        return Variation(names, values, np.divide(values, sizes, out=np.zeros(len(names)), where=sizes > 0.0))

    def second_variation(self, direction: Mapping[str, Any] | None = None) -> SecondVariation:
        """Return the second variation, the integral of ``eta' L_vv eta' + 2 eta' L_vq eta + eta L_qq eta``.

        Parameters
        ----------
        direction
            See `variation`.

        Raises
        ------
        UsageError
            If a direction does not vanish at the ends.
        UnsupportedError
            See `gradient`; or the path is one of coordinates and momenta.
        """
        names, curves = self._directions(direction)
        matrix = np.zeros((len(names), len(names)))
        for piece, found in zip(self._pieces, curves, strict=True):
            if piece.seconds is None:
                raise UnsupportedError(
                    "on paths in phase space no direction has the action least", where=self.name, advice="Give q alone."
                )
            matrix += np.einsum("ait,ijt,bjt,t->ab", found, piece.seconds(), found, piece.nodes.weights, optimize=True)
        return SecondVariation(names, matrix, int(np.sum(np.linalg.eigvalsh(matrix) < 0.0)))

    def _directions(self, direction: Mapping[str, Any] | None) -> tuple[tuple[str, ...], list[FloatArray]]:
        """Return names of directions, and values and rates of each at the nodes of each piece."""
        self._momenta()
        held = [not one.startswith("p:") for one in self.coordinates]  # momenta are free at the ends
        chosen = self._sines() if direction is None else {"the direction": direction}
        curves = []
        for piece in self._pieces:
            found = [curves_at(given, self.coordinates, piece.nodes, self.name) for given in chosen.values()]
            for eta, _, at_ends, _ in found:
                ends = [*([0] if piece is self._pieces[0] else []), *([1] if piece is self._pieces[-1] else [])]
                if np.any(np.abs(at_ends[held][:, ends]) > _AT_ENDS * np.max(np.abs(eta), initial=0.0)):
                    raise UsageError(
                        "the direction does not vanish at both ends",
                        where=self.name,
                        advice="Multiply it by (t - t0)*(t1 - t).",
                    )
            curves.append(np.array([np.concatenate([eta, rate]) for eta, rate, *_ in found]))
        return tuple(chosen), curves

    def _sines(self) -> dict[str, dict[str, Any]]:
        begin, end = self.time

        def wave(k: int) -> Any:
            return lambda t: np.sin(k * np.pi * (t - begin) / (end - begin))

        return {
            f"{path}, {k} half wave{'s' if k > 1 else ''}": {path: wave(k)}
            for path in self.coordinates
            for k in range(1, _MODES + 1)
        }

    def _momenta(self) -> FloatArray:
        if self.momenta is None:
            raise UnsupportedError(
                "its speeds are no derivatives of its coordinates, as angular velocities of bodies in space, so that "
                "these have no momenta",
                where=self.name,
                advice="`hamiltonian` has momenta of Euler angles.",
            )
        return self.momenta

    def __repr__(self) -> str:
        begin, end = self.time
        return f"<Action of {self.name} from t = {begin:g} to {end:g} s: {self.value:.12g} J s>"


@dataclass(frozen=True, eq=False)
class _Piece:
    """A stretch without jumps: L, dL/dq, dL/du at the nodes, rows of one number for each, and second derivatives."""

    nodes: Nodes
    values: FloatArray
    slopes: FloatArray
    momenta: FloatArray
    seconds: Callable[[], FloatArray] | None = None


@takes(
    scene=instance("a scene, an assembly of one, or a result", Model, Assembly, Result),
    path=optional(PATH),
    t_end=T_END,
    rtol=RTOL,
)
def action(
    scene: Model | Assembly | Result,
    path: Mapping[str, Any] | None = None,
    *,
    t_end: float | str | None = None,
    rtol: float = 1e-12,
) -> Action:
    """Return the action of a scene's motion, of a run, or of a path that need not be a motion.

    Parameters
    ----------
    scene
        The scene, which is run from its start; or the result of a run.
    path
        A path instead: for each coordinate by its path a number, text or a sympy expression in t, or a function of an
        array of times. With ``"p:PATH"`` for each momentum, too, it is a path in phase space, on which S is the
        integral of ``p q' - H``; momenta are varied on their own then.
    t_end
        Time of the end, s; the scene's own if not given. A result has its end.
    rtol
        Relative tolerance of the run.

    Returns
    -------
    Action
        S, its derivatives by the ends, and its first variation.

    Raises
    ------
    UsageError
        If a path leaves a coordinate out, or a result is given a path or an end.
    """
    if isinstance(scene, Result):
        if path is not None or t_end is not None:
            raise UsageError("a result has its motion and its end", advice="Give the scene, with a path or an end.")
        return action_of_run(scene.run)
    if path is None:
        assembly = smooth_assembly_of(scene)
        return action_of_run(simulate(assembly, t_end=t_end, rtol=rtol).run)
    is_of_both = any(one.startswith("p:") for one in path)
    return (_of_phase_path if is_of_both else _of_path)(smooth_assembly_of(scene), path, t_end)


def action_of_run(run: Run) -> Action:
    """Return the action of a run; it is made again to look at it within its steps."""
    steps = times_of_steps(run)
    nodes = [panels(joined_times(one.time, steps)) for one in run.segments if len(one.time) > 1]
    again = run_again(run, np.concatenate([one.times.ravel() for one in nodes])) if nodes else None
    segments = [one for one in again.segments if len(one.time) > 1] if again is not None else []
    if len(segments) != len(nodes):
        raise UsageError("the run cannot be made again to be looked at", where=run.assembly.flat.name)
    pieces, ends = [], []
    for points, segment in zip(nodes, segments, strict=True):
        places = np.searchsorted(segment.time, points.times.ravel())
        q, u = segment.coordinates[:, places], segment.speeds[:, places]
        pieces.append(_piece(segment.assembly, points, q, u))
        edge = [0, -1]
        ends.append((segment.assembly, segment.time[edge], segment.coordinates[:, edge], segment.speeds[:, edge]))
    return _made(pieces, ends)


def _of_path(assembly: Assembly, path: Mapping[str, Any], t_end: float | str | None) -> Action:
    """Return the action of a path."""
    equations, name = assembly.own_equations, assembly.flat.name
    names = tuple(one.name for one in equations.names)
    if not rates_are_speeds(equations) and set(names) <= set(path):
        raise UnsupportedError("its speeds are no derivatives of its coordinates", where=name)
    points, (q, v, at_ends, speeds) = _curves_of(assembly, names, path, t_end)
    begin, end = points.edges[[0, -1]]
    piece = _piece(assembly, points, q, v)
    return _made([piece], [(assembly, np.array([begin, end]), at_ends, speeds)])


def _curves_of(
    assembly: Assembly, names: Sequence[str], path: Mapping[str, Any], t_end: float | str | None
) -> tuple[Nodes, Curves]:
    """Return where a path is looked at, with its values and rates there and at the ends."""
    missing = [one for one in names if one not in path]
    if missing:
        raise UsageError(f"the path leaves out {', '.join(missing)}", where=assembly.flat.name, advice="Give each one.")
    begin, end = assembly.flat.t_start, assembly.flat.t_end if t_end is None else float(t_end)
    check_span(begin, end)
    points = panels(np.linspace(begin, end, _PANELS + 1))
    return points, curves_at(path, names, points, assembly.flat.name)


def _of_phase_path(assembly: Assembly, path: Mapping[str, Any], t_end: float | str | None) -> Action:
    """Return the action of a path in phase space: that of ``p q' - H`` with q and p for coordinates."""
    h = read_hamiltonian(assembly)
    names, n = (*h.paths, *(f"p:{one}" for one in h.paths)), len(h.paths)
    points, (state, rates, at_ends, _) = _curves_of(assembly, names, path, t_end)
    t, (q, p) = points.times.ravel(), (state[:n], state[n:])
    if h.depends_on_time:
        energies = np.array([float(h(*one)) for one in zip(q.T, p.T, t, strict=True)])
        slopes = np.array([np.concatenate(h.gradient(*one)) for one in zip(q.T, p.T, t, strict=True)]).T
    else:
        energies, slopes = h(q.T, p.T), np.concatenate(h.gradient(q.T, p.T), axis=1).T
    pushes = np.concatenate([-slopes[:n], rates[:n] - slopes[n:]])
    piece = _Piece(points, np.sum(p * rates[:n], axis=0) - energies, pushes, np.concatenate([p, np.zeros(q.shape)]))
    momenta, begin, end = np.zeros((2, 2 * n)), *points.edges[[0, -1]]
    momenta[:, :n] = at_ends[n:].T
    first, last = (float(h(x[:n], x[n:], one)) for x, one in zip(at_ends.T, (begin, end), strict=True))
    total, rough = points.integral(piece.values), _rougher(piece)
    return Action(h.name, total, abs(total - rough), (begin, end), names, at_ends.T, momenta, (first, last), (piece,))


def _first(found: Lagrangian, both: Sequence[Expression]) -> list[Expression]:
    return vjp([found.lagrangian], [found.graph.one], list(both))


def _slopes(found: Lagrangian) -> dict[str, Sequence[Expression]]:
    """Return L, dL/dq and dL/du."""
    return {
        "L": [found.lagrangian],
        "dL/dq": _first(found, found.coordinates),
        "dL/du": _first(found, found.velocities),
    }


def _seconds(found: Lagrangian) -> dict[str, Sequence[Expression]]:
    """Return the second derivatives of L by coordinates and speeds."""
    both = [*found.coordinates, *found.velocities]
    return {"seconds": jacobian_by_rows(_first(found, both), both)}


def _evaluated(
    assembly: Assembly, t: FloatArray, q: FloatArray, u: FloatArray, of: _Groups = _slopes
) -> list[FloatArray]:
    """Return what is made of L along (t, q, u), a row for each expression."""

    def make() -> Program:
        equations = assembly.own_equations
        return coordinate_program(assembly, "(action)", equations, of(lagrangian_along_speeds(assembly, equations)))

    program = assembly.shared.get(_PROGRAM, make, of, assembly.form, assembly.orientation.kind)
    found = zip(assembly.kernel(program, vectorized=True)(t[None, :], q, u), program.outputs, strict=True)
    return [np.broadcast_to(np.asarray(x, dtype=float), (len(group.expressions), len(t))) for x, group in found]


def _piece(assembly: Assembly, points: Nodes, q: FloatArray, u: FloatArray) -> _Piece:
    t = points.times.ravel()
    value, slopes, momenta = _evaluated(assembly, t, q, u)
    return _Piece(points, value[0], slopes, momenta, lambda: _bends(assembly, t, q, u))


def _bends(assembly: Assembly, t: FloatArray, q: FloatArray, u: FloatArray) -> FloatArray:
    size = len(q) + len(u)
    return _evaluated(assembly, t, q, u, _seconds)[0].reshape(size, size, len(t))


_End = tuple[Assembly, FloatArray, FloatArray, FloatArray]
"""A scene, two times, and coordinates and speeds at these, a column each."""


def _made(pieces: list[_Piece], ends: list[_End]) -> Action:
    total = sum(one.nodes.integral(one.values) for one in pieces)
    rough = sum(_rougher(one) for one in pieces)
    (before, t0, q0, u0), (after, t1, q1, u1) = ends[0], ends[-1]
    first, last = _evaluated(before, t0, q0, u0), _evaluated(after, t1, q1, u1)
    equations = before.own_equations
    plain = rates_are_speeds(equations) and rates_are_speeds(after.own_equations)
    return Action(
        name=before.flat.name,
        value=total,
        error=abs(total - rough),
        time=(float(t0[0]), float(t1[-1])),
        coordinates=tuple(one.name for one in equations.names),
        ends=np.array([q0[:, 0], q1[:, -1]]),
        momenta=np.array([first[2][:, 0], last[2][:, -1]]) if plain else None,
        energies=(
            float(first[2][:, 0] @ u0[:, 0] - first[0][0, 0]),
            float(last[2][:, -1] @ u1[:, -1] - last[0][0, -1]),
        ),
        _pieces=tuple(pieces),
    )


def _rougher(piece: _Piece) -> float:
    """Return the integral of L by the polynomials through every second point, which errs more."""
    points, values = legendre.leggauss(COUNT)[0][::2], piece.values.reshape(-1, COUNT)[:, ::2]
    means = legendre.legfit(points, values.T, len(points) - 1)[0]
    return float(np.diff(piece.nodes.edges) @ means)


COUNT = 12
"""Points of Gauss and Legendre between two edges."""


@dataclass(frozen=True, eq=False)
class Nodes:
    """Points of Gauss and Legendre between edges.

    Attributes
    ----------
    edges
        Between which functions are smooth, s.
    times
        The points, shape (edges - 1, points).
    """

    edges: FloatArray
    times: FloatArray

    @property
    def weights(self) -> FloatArray:
        """What the values at the points count in integrals, in one row."""
        weights = legendre.leggauss(COUNT)[1]
        return np.asarray((0.5 * np.diff(self.edges)[:, None] * weights).ravel())

    def integral(self, values: FloatArray) -> float:
        """Return the integral of what has these values at the points, of any shape with as many of them."""
        return float(values.ravel() @ self.weights)

    def slopes(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the derivatives of the polynomials that have these values between two edges: there, at both ends."""
        points = legendre.leggauss(COUNT)[0]
        series = legendre.legder(legendre.legfit(points, values.reshape(-1, COUNT).T, COUNT - 1))
        scale = 2.0 / np.diff(self.edges)
        at_ends = [legendre.legval(end, series[:, k]) * scale[k] for end, k in ((-1.0, 0), (1.0, -1))]
        return np.asarray(legendre.legval(points, series) * scale[:, None]).ravel(), np.array(at_ends)


def panels(edges: FloatArray) -> Nodes:
    """Return the points between edges."""
    return Nodes(edges, nodes_between(edges, COUNT).reshape(-1, COUNT))


Curves: TypeAlias = tuple[FloatArray, FloatArray, FloatArray, FloatArray]
"""Values and rates of functions of time at points, and both at the two ends."""


def curves_at(given: Mapping[str, Any], names: Sequence[str], nodes: Nodes, where: str) -> Curves:
    """Return functions of time at points and at both ends; rates of what is no formula are those of polynomials."""
    for path in given:
        check_known(path, names, f"{path!r} is no coordinate of it", where=where)
    t, ends = nodes.times.ravel(), nodes.edges[[0, -1]]
    values, rates, at_ends, end_rates = (np.zeros((len(names), size)) for size in (len(t), len(t), 2, 2))
    for k, name in enumerate(names):
        if name not in given:
            continue
        function, derivative = _read(given[name], name)
        values[k], at_ends[k] = _called(function, t, name), _called(function, ends, name)
        if derivative is None:
            rates[k], end_rates[k] = nodes.slopes(values[k])
        else:
            rates[k], end_rates[k] = _called(derivative, t, name), _called(derivative, ends, name)
    return values, rates, at_ends, end_rates


Function = Callable[[FloatArray], Any]


def _read(given: Any, name: str) -> tuple[Function, Function | None]:
    """Return a function, and its derivative where that is known."""
    if callable(given) and not hasattr(given, "free_symbols"):
        return given, None
    t = sympy.Symbol("t")
    try:
        made = as_expression(given)
    except Exception:  # text is read as Python
        made = None
    if made is None or not made.free_symbols <= {t} or made.is_real is False:
        raise UsageError(
            f"{given!r} is no function of time", where=name, advice="Write it in t, as 'sin(2*t)', or give a function."
        )
    return sympy.lambdify(t, made, "numpy"), sympy.lambdify(t, made.diff(t), "numpy")


def _called(function: Function, t: FloatArray, name: str) -> FloatArray:
    try:
        found = np.asarray(function(t), dtype=float)
    except AtwoodError:
        raise
    except Exception as error:  # a function of somebody else
        advice = "Give a function of an array of times, in seconds, that returns as many numbers."
        raise UsageError(f"it fails: {type(error).__name__}: {error}", where=name, advice=advice) from error
    try:
        found = np.broadcast_to(found, t.shape)
    except ValueError:
        advice = "Give a function of an array of times that returns as many numbers."
        raise UsageError(f"gives {found.shape} values for {t.shape} times", where=name, advice=advice) from None
    if not np.all(np.isfinite(found)):
        raise UsageError(f"has no finite value at t = {t[~np.isfinite(found)][0]:.6g}", where=name)
    return found
