"""`reduced`: a scene whose coordinates are ignorable but for one, by quadrature."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from atwood.arguments import ARRAY, BY_PATH, TEXT, check, instance, optional, takes
from atwood.arrays import FloatArray
from atwood.errors import UnsupportedError, check_known
from atwood.expr import depends_on
from atwood.forms.assembly import Assembly
from atwood.forms.quantities import observer
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy
from atwood.model.compose.composite import Model
from atwood.result.segment_quantities import state_values
from atwood.simulation.initialization.start import find_start
from atwood.theory.dynamics.one_coordinate import PartsAt, Radial, parts_of
from atwood.theory.dynamics.quadrature import FULL_TURN, Path, find_path
from atwood.theory.formulas.described import Described
from atwood.theory.formulas.notation import SYMBOLS
from atwood.theory.hamiltonian.hamiltonian import hamiltonian, start_of
from atwood.theory.hamiltonian.phase_space import EXPRESSION, spelled
from atwood.theory.hamiltonian.point_transformations import PointTransformation, point_transformation, start_in
from atwood.theory.hamiltonian.tidied import tidied
from atwood.theory.reduction.orbit import RadialFormulas
from atwood.theory.reduction.routhian import (
    Routhian,
    ignorable_of,
    routhian_of,
    transformed_parts,
)


@dataclass(frozen=True, eq=False)
class ReducedMotion(Described):
    """The motion of a scene from its start, reduced to one coordinate.

    Attributes
    ----------
    coordinate
        Path of the coordinate that is left.
    ignorable
        Paths of the others.
    momenta
        Values of their momenta, by path.
    energy
        The energy function h, J.
    radial
        The effective potential in numbers.
    path
        Turning points and quadratures.
    routhian
        The same in symbols; None of a scene in other coordinates.
    start
        Values of all coordinates at the start, by path.
    t_start
        Time of the start, s.
    potential
        The effective potential in symbols, of a scene in other coordinates.
    scene, unit
        What the scene is called, and the unit of the coordinate that is left.
    transformation
        The scene in other coordinates, where it is one.
    """

    coordinate: str
    ignorable: tuple[str, ...]
    momenta: Mapping[str, float]
    energy: float
    radial: Radial
    path: Path
    routhian: Routhian | None
    start: Mapping[str, float]
    t_start: float
    potential: Any = None
    scene: str = ""
    unit: str = ""
    transformation: PointTransformation | None = None

    @property
    def kind(self) -> str:
        """What motion it is.

        ``"libration"`` between two turning points, ``"rotation"`` of an angle, ``"rest"`` of the coordinate (a steady
        motion of the whole), or ``"unbounded"``.
        """
        return self.path.kind

    @property
    def turning_points(self) -> tuple[float, float]:
        """Where the coordinate turns; infinite where it does not."""
        return self.path.low, self.path.high

    @property
    def period(self) -> float:
        """Time until the coordinate and its rate are what they were, s; of rest, that of small oscillations."""
        return self.path.period

    @property
    def is_separatrix(self) -> bool:
        """Whether its energy is that of a separatrix: it rests on top of its effective potential, without a period."""
        return self.kind == "rest" and not np.isfinite(self.period)

    @property
    def advance(self) -> dict[str, float]:
        """How far the ignorable coordinates go in a period, by path."""
        return dict(zip(self.ignorable, map(float, self.path.advance), strict=True))

    @property
    def error(self) -> float:
        """Estimated relative error of the period."""
        return self.path.error

    @cached_property
    def expression(self) -> Any:
        """The effective potential as a sympy expression of the coordinate, the momenta and parameters."""
        return self.potential if self.routhian is None else self.routhian.effective_potential

    @cached_property
    def formulas(self) -> RadialFormulas:
        """The orbit, its elements, the period and the angle of scattering as formulas, where they are closed."""
        if self.transformation is not None:
            given = self.transformation
            names = [str(one) for one in given.coordinates]
            k = names.index(self.coordinate)
            s, mu, letters = given.coordinates[k], 1 / given.hamiltonian.diff(given.momenta[k], 2), given.source.values
            others = {q: p for q, p in zip(given.coordinates, given.momenta, strict=True) if q != s}
            potential = self.expression
        else:
            assert self.routhian is not None
            [moving] = self.routhian.coordinates
            s, t = sympy.Symbol(str(moving.func)), sympy.Symbol("t")
            mu = tidied(-self.routhian.expression.diff(moving.diff(t), 2).xreplace({moving: s}))
            potential = self.expression.xreplace({moving: s})
            others = {sympy.Symbol(str(p).removeprefix("p_")): p for p in self.routhian.momenta}
            letters = self.routhian.values
        held = dict(zip(others.values(), self.momenta.values(), strict=True))
        values = {**letters, **held, sympy.Symbol("E"): self.energy, s: self.start[self.coordinate]}
        return RadialFormulas(s, mu, potential, others, values)

    @property
    def orbit(self) -> dict[Any, Any]:
        """The coordinate as a function of each of the others since a turning point, where that is closed."""
        return self.formulas.orbit

    @property
    def elements(self) -> dict[str, Any]:
        """Semi-latus rectum, eccentricity and semi-major axis of a conic about its focus, as formulas."""
        return self.formulas.elements

    @property
    def scattering_angle(self) -> Any:
        """By how much the direction of an unbounded motion about a centre changes, as a formula; None of others."""
        return self.formulas.scattering_angle

    def effective_potential(self, values: Any) -> FloatArray:
        """Return the effective potential at values of the coordinate, J."""
        values = check(ARRAY, values, "values", "effective_potential")
        found = self.radial.at(np.ravel(values)).potential
        return np.asarray(found.reshape(np.shape(values)))

    def at(self, times: Any) -> dict[str, FloatArray]:
        """Return all coordinates at times, by path.

        Parameters
        ----------
        times
            s.

        Raises
        ------
        UnsupportedError
            If the motion does not come back.
        """
        times = check(ARRAY, times, "times", "at")
        t = np.ravel(times)
        s, moved = self.path.at(t - self.t_start)
        found = {self.coordinate: s.reshape(np.shape(times))}
        for path, values in zip(self.ignorable, moved, strict=True):
            found[path] = (self.start[path] + values).reshape(np.shape(times))
        return found

    def table(self, times: FloatArray, paths: Sequence[str]) -> dict[str, FloatArray]:
        """Return quantities that follow from the coordinates alone, at times.

        Parameters
        ----------
        times
            s, shape (times,).
        paths
            Positions, angles and axes by path; of those that depend on velocities or forces, and of angles that are
            not counted, none are returned.
        """
        if self.routhian is None:
            return {}
        assembly, found = self.routhian.formulas.assembly, self.at(times)
        e = assembly.reduced
        late = [*e.speeds, *e.accelerations, *(one.symbol for one in assembly.reactions)]
        own = {one.name for one in e.names}
        chosen = []
        for path in paths:
            one = assembly.observables.get(path)
            if one is not None and not depends_on(one.value, late) and (path in own or not one.periodic):
                chosen.append(path)
        if not chosen:
            return {}
        q = np.array([found[one.name] for one in e.names])
        values = state_values(
            assembly, observer(assembly, tuple(chosen)), times, q, np.zeros((len(e.speeds), len(times)))
        )
        return dict(zip(chosen, values, strict=True))

    def __repr__(self) -> str:
        low, high = self.turning_points
        told = f"{self.kind} between {low:.6g} and {high:.6g}" if self.kind == "libration" else self.kind
        period = f", period {self.period:.6g} s" if np.isfinite(self.period) else ""
        return f"<ReducedMotion of {self.coordinate}: {told}{period}>"


_GIVEN = instance("a scene, an assembly, or what `point_transformation` returns", Model, Assembly, PointTransformation)


@takes(scene=_GIVEN, coordinate=optional(TEXT), orientation=optional(TEXT), symbols=SYMBOLS, old=optional(BY_PATH))
def reduced(
    scene: Model | Assembly | PointTransformation,
    coordinate: str | None = None,
    *,
    orientation: str | None = None,
    symbols: Mapping[str, str] | None = None,
    old: Mapping[str, Any] | None = None,
) -> ReducedMotion:
    """Return the motion of a scene from its start, reduced to one coordinate and done by quadrature.

    All coordinates but one must be ignorable, and the energy function conserved: pendulums, orbits in polar
    coordinates, tops, beads on turning hoops. Then ``mu s'^2/2 + U_eff(s) = h`` (Goldstein, sections 3.3 and 5.7;
    Landau and Lifshitz, Mechanics, sections 11 and 14), and turning points, period, the advance of the ignorable
    coordinates in a period, and the whole motion follow to rounding.

    Parameters
    ----------
    scene
        The scene, or an assembly of it; or the scene in other coordinates, as `atwood.point_transformation` returns it,
        whose names then stand in place of paths: an orbit in polar coordinates.
    coordinate
        Path of the coordinate that is left; the one that is not ignorable if not given.
    orientation
        Euler angles in which orientations in space are; ``"euler-zxz"`` if not given.
    symbols
        See `atwood.equations`; a transformed scene has its letters already.
    old
        Other coordinates, as of `atwood.point_transformation`: every coordinate of the scene by its path in terms of
        those, such as ``{"body.position.x": "r*cos(phi)", "body.position.z": "r*sin(phi)"}``.

    Raises
    ------
    UnsupportedError
        If more than one coordinate is left, the energy function is not conserved, or the motion passes a place where
        coordinates are singular.
    StartError
        If the start is not consistent, or the coordinates are singular there.
    SolveError
        If the motion is too near to a separatrix.
    """
    if old is not None:
        scene = _in_others(scene, old, symbols)
    if isinstance(scene, PointTransformation):
        return _transformed(scene)
    assembly, found, names = ignorable_of(scene, orientation)
    paths = [one.name for one in found.names]
    left = [path for path in paths if path not in names]
    if coordinate is not None:
        check_known(coordinate, paths, "no coordinate has this path")
        left = [*dict.fromkeys([*left, coordinate])]
    if not left and len(paths) == 1:
        left = paths
    if len(left) != 1:
        told = "all coordinates are ignorable" if not left else f"{', '.join(left)} are not ignorable"
        raise UnsupportedError(
            f"its motion is not reduced to one coordinate: {told}",
            where=assembly.flat.name,
            advice="Name one with `coordinate`."
            if not left
            else "Other coordinates may have symmetries that these do not show: see `conserved`.",
        )
    number, unit = paths.index(left[0]), found.names[paths.index(left[0])].unit
    ignorable = tuple(path for path in paths if path != left[0])
    whole, t = parts_of(assembly, found, number), find_start(assembly).time
    symbolic = {"routhian": routhian_of(assembly, found, ignorable, symbols)}
    return _motion(assembly, lambda q: whole(q, t), paths, number, start_of(assembly), unit, symbolic)


def _motion(
    assembly: Assembly,
    parts: PartsAt,
    paths: Sequence[str],
    number: int,
    start: tuple[FloatArray, FloatArray],
    unit: str,
    symbolic: Mapping[str, Any],
) -> ReducedMotion:
    """Return the motion of one coordinate, all others being ignorable, from a start of coordinates and velocities."""
    (q, v), begun, name = start, find_start(assembly), assembly.flat.name
    others = tuple(k for k in range(len(paths)) if k != number)
    now = parts(q[:, None])
    momenta = now.mass[:, :, 0] @ v + now.linear[:, 0]
    radial = Radial(parts, number, others, momenta[list(others)], q)
    here, (turn, scale) = radial.at([q[number]]), (FULL_TURN, 1.0) if unit == "rad" else (None, begun.length)
    path = find_path(radial, float(q[number]), float(v[number]), turn, scale, f"{name}: {paths[number]}")
    ignorable = tuple(paths[k] for k in others)
    return ReducedMotion(
        coordinate=paths[number],
        ignorable=ignorable,
        momenta=dict(zip(ignorable, map(float, radial.momenta), strict=True)),
        energy=float(here.potential[0] + 0.5 * here.inertia[0] * v[number] ** 2),
        radial=radial,
        path=path,
        start=dict(zip(paths, map(float, q), strict=True)),
        t_start=begun.time,
        scene=name,
        unit=unit,
        **{"routhian": None, **symbolic},
    )


def _in_others(
    scene: Model | Assembly | PointTransformation, old: Mapping[str, Any], symbols: Mapping[str, str] | None
) -> PointTransformation:
    """Return a scene in the coordinates that its own are given in terms of."""
    h = scene.source if isinstance(scene, PointTransformation) else hamiltonian(scene, symbols=symbols)
    given = (spelled(check(EXPRESSION, value, path, "reduced"), h.values) for path, value in old.items())
    new = sorted({*sympy.Tuple(*given).free_symbols} - {*h.values, sympy.Symbol("t")}, key=str)
    return point_transformation(scene, old, new, symbols=symbols)


def _transformed(given: PointTransformation) -> ReducedMotion:
    """Return the motion of a scene in other coordinates, of which all but one are ignorable."""
    h, gone = given.source, given.ignorable
    left = [k for k, one in enumerate(given.coordinates) if one not in gone]
    if len(left) != 1 or h.other_forces or given.hamiltonian.has(sympy.Symbol("t")):
        told = "forces act that do not follow from H" if h.other_forces else "H depends on time"
        if len(left) != 1:
            told = (
                f"{', '.join(str(given.coordinates[k]) for k in left) or 'none'} of its coordinates are not ignorable"
            )
        raise UnsupportedError(f"its motion is not reduced to one coordinate: {told}", where=h.name)
    number, (_, q, v) = left[0], start_in(given)
    parts = transformed_parts(given, number)
    # What turns as an angle does is known by its sines and cosines alone: then a whole turn changes nothing.
    here, turned = (parts(q[:, None] + turn * np.eye(len(q))[:, [number]]).potential for turn in (0.0, 2.0 * np.pi))
    same = np.allclose(turned, here, rtol=1e-12, atol=0.0)
    unit = "rad" if same and not given.coordinates[number].is_positive else "m"
    potential = given.hamiltonian.xreplace({given.momenta[number]: sympy.Integer(0)})
    names, symbolic = [str(one) for one in given.coordinates], {"potential": potential, "transformation": given}
    return _motion(h.assembly, parts, names, number, (q, v), unit, symbolic)
