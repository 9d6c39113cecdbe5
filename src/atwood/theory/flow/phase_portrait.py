"""Motions in phase space: all those of one degree of freedom in a picture, and where motions pass a surface."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from atwood.arguments import BY_PATH, FLAG, TEXT, Kind, Refused, command, each, optional, real, takes
from atwood.arrays import FloatArray
from atwood.display import count_of, data_of, fitted
from atwood.errors import KernelEvaluationError, SolveError, UsageError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass, replace
from atwood.model.compose.composite import Model
from atwood.model.values.units import parse_quantity, parse_unit
from atwood.pipeline import SCENE, simulate, smooth_assembly_of
from atwood.ranges import range_of
from atwood.simulation.dynamics.scales import scene_length
from atwood.simulation.events.modes import find_event_functions
from atwood.simulation.problem.arguments import RTOL, SOLVER, T_END
from atwood.table import Shown, Table, facts, table
from atwood.theory.dynamics.dynamics import Dynamics
from atwood.theory.flow.plane_field import Field, Window, separatrices, spaced_curves
from atwood.theory.formulas.described import Described
from atwood.theory.hamiltonian.hamiltonian import Hamiltonian, read_hamiltonian
from atwood.theory.linear.linear_model import complex_text
from atwood.theory.linear.variations import LinearScene

_LOOKS = 2001
"""Points of rest are looked for between so many coordinates."""

_NOTHING = 1e-10
"""Relative to the largest: accelerations and rates below are zero, to what a scene is evaluated."""


@dataclass(frozen=True)
class RestPoint:
    """A state of rest.

    Attributes
    ----------
    coordinate
        Where, m or rad.
    kind
        ``"centre"``, ``"saddle"``, ``"stable focus"``, ``"unstable focus"``, ``"stable node"``, ``"unstable node"`` or
        ``"degenerate"``.
    eigenvalues
        Of the linear equations there, 1/s.
    """

    coordinate: float
    kind: str
    eigenvalues: tuple[complex, complex]


@dataclass(frozen=True, eq=False)
class Separatrix:
    """A motion that comes out of a saddle, or goes into one, in infinite time.

    Attributes
    ----------
    kind
        ``"homoclinic"``, out of and into one saddle, ``"heteroclinic"``, from one to another, or ``"open"``: it does
        not come to another in the window.
    begin, end
        The saddles; None where there is none.
    energy
        H on it, J; None where it is not known or not kept.
    """

    kind: str
    begin: float | None
    end: float | None
    energy: float | None


@dataclass(frozen=True, eq=False)
class PhasePortrait(Shown):
    """The motions of a scene with one degree of freedom, as curves over coordinate and speed, or momentum.

    Attributes
    ----------
    coordinate, speed
        Names of both; that of the momentum in the place of the speed where the curves are over that.
    units
        Of coordinate and speed, or momentum.
    window
        Their ranges.
    rest_points
        States of rest in the window, ascending.
    everywhere_at_rest
        Whether every coordinate is a state of rest, as of a free particle.
    curves
        Motions, each of shape (points, 2), in the direction in which they are run through.
    separatrices
        Those into and out of saddles.
    levels
        H on each of the curves, J: over coordinate and momentum they are its level sets; None where it is not kept, or
        curves are over the speed.
    named
        What each separatrix is.
    scene
        Name of the scene.
    """

    coordinate: str
    speed: str
    units: tuple[str, str]
    window: Window
    rest_points: tuple[RestPoint, ...]
    everywhere_at_rest: bool
    curves: tuple[FloatArray, ...]
    separatrices: tuple[FloatArray, ...]
    levels: tuple[float, ...] | None
    named: tuple[Separatrix, ...]
    scene: str

    def to_data(self) -> dict[str, Any]:
        """Return it as plain data, for JSON."""
        window = [list(self.window.across), list(self.window.up)]
        told = data_of(self, "scene", "coordinate", "speed", "units")
        points = [data_of(one, "coordinate", "kind", "eigenvalues") for one in self.rest_points]
        ends = data_of(self, "curves", "levels", "separatrices")
        ends["named"] = [data_of(one, "kind", "begin", "end", "energy") for one in self.named]
        return {**told, "window": window, "everywhere_at_rest": self.everywhere_at_rest, "rest_points": points, **ends}

    def tables(self) -> tuple[Table, ...]:
        """Return the states of rest."""
        title, (low, high) = f"{self.scene}: {self.speed} over {self.coordinate}", self.window.across
        if self.everywhere_at_rest:
            return (facts((), title, ["It can stay at rest everywhere."]),)
        if not self.rest_points:
            return (facts((), title, [f"It can stay at rest nowhere from {low:.4g} to {high:.4g} {self.units[0]}."]),)
        rows = [
            (one.kind, f"{one.coordinate:.9g}", ", ".join(complex_text(value) for value in one.eigenvalues))
            for one in self.rest_points
        ]
        rest = table(("at rest", f"{self.coordinate}, {self.units[0]}>", "eigenvalues, 1/s"), rows, title)
        places = [["" if one is None else f"{one:.9g}" for one in (x.begin, x.end, x.energy)] for x in self.named]
        lines = sorted({(one.kind, *place) for one, place in zip(self.named, places, strict=True)})
        return (rest, table(("separatrix", "out of>", "into>", "H, J>"), lines)) if lines else (rest,)

    def __repr__(self) -> str:
        points = ", ".join(f"{one.kind} at {one.coordinate:.4g}" for one in self.rest_points) or "no point of rest"
        if self.everywhere_at_rest:
            points = "at rest everywhere"
        curves = count_of(len(self.curves), "curve")
        return fitted(f"<PhasePortrait of {self.scene}, {self.speed} over {self.coordinate}: {points}; {curves}>")


Linear: TypeAlias = Callable[[float], FloatArray]
"""Gives the matrix of the linear equations at a state of rest."""

Bounds = tuple[float | str, float | str]
"""From low to high: numbers in SI units, or text with a unit."""


def _read_bounds(value: Any) -> Bounds:
    if isinstance(value, (set, frozenset)):
        raise Refused
    low, high = (one if isinstance(one, str) else real(one) for one in value)
    return low, high


_BOUNDS = optional(
    Kind("a range from low to high, such as (-3.0, 3.0) or ('-90 deg', '90 deg')", _read_bounds, "FROM:TO", range_of)
)


@command("phase")
@takes(scene=SCENE, coordinates=_BOUNDS, speeds=_BOUNDS, momenta=FLAG)
def phase_portrait(
    scene: Model | Assembly,
    *,
    coordinates: Bounds | None = None,
    speeds: Bounds | None = None,
    momenta: bool = False,
) -> PhasePortrait:
    """Return the phase portrait of a scene with one degree of freedom: curves, points of rest, separatrices.

    Points of rest are found between evenly spaced coordinates, and told apart by the eigenvalues of the linear
    equations there (Arnold, Ordinary Differential Equations, section 21). Separatrices begin along the eigenvectors of
    saddles.

    Parameters
    ----------
    scene
        The scene, or an assembly of its reduced form.
    coordinates, speeds
        Ranges of the coordinate and of its rate, in SI units or text with units such as ``"180 deg"``; chosen by the
        points of rest and the start if not given.
    momenta
        Whether curves are over the momentum that belongs to the coordinate, and not over its rate.

    Returns
    -------
    PhasePortrait
        The portrait; `atwood.plot_phase_portrait` draws it.

    Raises
    ------
    UsageError
        If the scene has not one degree of freedom, depends on time, or changes its mode.
    """
    assembly = smooth_assembly_of(scene)
    functions = Dynamics(assembly)
    _refuse(assembly, functions)

    def field(points: FloatArray) -> FloatArray:
        try:
            accelerations = functions.forward_dynamics(points[:, :1], points[:, 1:])
        except KernelEvaluationError:  # no value at some of them, as where a spring has no length
            if len(points) > 1:
                return np.concatenate([field(half) for half in np.array_split(points, 2)])
            accelerations = np.full((1, 1), np.nan)
        return np.stack([points[:, 1], accelerations[:, 0]], axis=1)

    equations, t = LinearScene(assembly, "reduced"), assembly.flat.t_start

    def linear(place: float) -> FloatArray:
        return equations.flow(t, np.array([place]), np.zeros(1), ()).matrix[:, :2]

    q, u = (float(one[0]) for one in functions.start())
    unit, name = functions.equations.names[0].unit, functions.coordinates[0]
    length = 1.0 if unit == "rad" else scene_length(assembly)
    across = (
        _coordinates(field, linear, q, unit, length)
        if coordinates is None
        else _range(coordinates, unit, "coordinates")
    )
    places, everywhere = _places_of_rest(field, across)
    rest_points = tuple(_rest_point(linear(place), place) for place in places)
    rest = np.array([[place, 0.0] for place in places]).reshape(-1, 2)
    up = _speeds(field, linear, across, rest_points, u) if speeds is None else _range(speeds, f"{unit}/s", "speeds")
    window = Window(across, up)
    saddles = [(np.array([one.coordinate, 0.0]), linear(one.coordinate)) for one in rest_points if one.kind == "saddle"]
    special = separatrices(field, saddles, window, rest)
    curves = spaced_curves(field, window, rest, special)
    near = 0.02 * (across[1] - across[0]), 0.02 * (up[1] - up[0])
    ends = [[_saddle_at(place, saddles, near) for place in curve[[0, -1]]] for curve in special]
    made = PhasePortrait(
        coordinate=name,
        speed=functions.speeds[0],
        units=(unit, f"{unit}/s"),
        window=window,
        rest_points=rest_points,
        everywhere_at_rest=everywhere,
        curves=tuple(curves),
        separatrices=tuple(special),
        levels=None,
        named=tuple(Separatrix(_kind_of(a, b), a, b, None) for a, b in ends),
        scene=assembly.flat.name,
    )
    return _over_momenta(made, read_hamiltonian(assembly)) if momenta else made


def _saddle_at(
    place: FloatArray, saddles: Sequence[tuple[FloatArray, FloatArray]], near: tuple[float, float]
) -> float | None:
    """Return the saddle that a separatrix begins or ends at."""
    found = [where[0] for where, _ in saddles if np.all(np.abs(where - place) < near)]
    return float(found[0]) if found else None


def _kind_of(begin: float | None, end: float | None) -> str:
    return "open" if begin is None or end is None else "homoclinic" if begin == end else "heteroclinic"


def _over_momenta(portrait: PhasePortrait, h: Hamiltonian) -> PhasePortrait:
    """Return a portrait with momenta in the place of speeds, and H on its curves."""

    def moved(curve: FloatArray) -> FloatArray:
        return np.column_stack([curve[:, 0], h.momenta_at(curve[:, :1], curve[:, 1:])[:, 0]])

    window, levels, named = portrait.window, None, portrait.named
    rims = [moved(np.column_stack([np.linspace(*window.across, 101), np.full(101, one)])) for one in window.up]
    up = [one[:, 1] for one in rims]
    curves, special = (tuple(map(moved, one)) for one in (portrait.curves, portrait.separatrices))
    if h.is_conserved:
        levels = tuple(float(np.median(h(one[:, :1], one[:, 1:]))) for one in curves)
        tops = [moved(np.array([[one.end if one.begin is None else one.begin, 0.0]])) for one in named]
        named = tuple(
            replace(one, energy=float(h(top[0, :1], top[0, 1:]))) for one, top in zip(named, tops, strict=True)
        )
    return replace(
        portrait,
        speed=str(h.momenta[0].func),
        units=(portrait.units[0], "J s" if portrait.units[0] == "rad" else "kg m/s"),
        window=Window(window.across, (float(np.min(up)), float(np.max(up)))),
        curves=curves,
        separatrices=special,
        levels=levels,
        named=named,
    )


def _refuse(assembly: Assembly, functions: Dynamics) -> None:
    where, e = assembly.flat.name, functions.equations
    if assembly.form != "reduced" or len(e.speeds) != 1 or e.rates != e.speeds or e.constraints:
        free = count_of(max(len(e.speeds) - len(e.constraints), 0), "degree")
        raise UsageError(
            "a phase portrait is of one coordinate and its rate",
            where=where,
            advice=f"This has {count_of(len(e.coordinates), 'coordinate')} and {free} of freedom; `poincare_section` "
            "shows motions of more.",
        )
    if _depends_on_time(functions):
        raise UsageError(
            "its equations depend on time, so that curves over coordinate and speed cross each other",
            where=where,
            advice="Leave the drive away, or look at it once a period with `poincare_section`.",
        )
    watched = [one for one in find_event_functions(assembly) if one.target not in ("", "stop")]
    if watched:
        raise UsageError(
            f"it changes its mode where {watched[0].part}: {watched[0].message}",
            where=where,
            advice="A phase portrait is of motions in one mode.",
        )


def _range(given: Bounds, unit: str, where: str) -> tuple[float, float]:
    low, high = (parse_quantity(str(one), parse_unit(unit), where) for one in given)
    if not (np.isfinite(low) and np.isfinite(high) and low < high):
        raise UsageError(f"from {low:g} to {high:g} is no range", where=where, advice="Give the lower end first.")
    return low, high


def _depends_on_time(functions: Dynamics) -> bool:
    """Return whether accelerations at random states differ by more than rounding from one time to others."""
    random = np.random.default_rng(1788)
    q, u = functions.start()
    points = np.concatenate([q, u])[None, :] + 3.0 * random.normal(size=(50, 2))
    found = [functions.forward_dynamics(points[:, :1], points[:, 1:], t=t) for t in (0.0, 0.37, 2.9, 71.3)]
    return not all(np.allclose(one, found[0], rtol=1e-7, atol=1e-9 * float(np.max(np.abs(found[0])))) for one in found)


def _coordinates(field: Field, linear: Linear, start: float, unit: str, length: float) -> tuple[float, float]:
    """Return the range in which a scene is looked at: three half turns about a stable state, or what lies about it."""
    if unit == "rad":
        some = np.array([[0.1, 0.3], [1.3, -0.4], [2.9, 0.2]])
        here, there = field(some)[:, 1], field(some + np.array([2.0 * np.pi, 0.0]))[:, 1]
        if np.any(here) and np.allclose(here, there, rtol=1e-7, atol=1e-7 * (1e-300 + float(np.max(np.abs(here))))):
            places, everywhere = _places_of_rest(field, (start - np.pi, start + np.pi * (1.0 + 1e-9)))
            stable = [one for one in places if not everywhere and _rest_point(linear(one), one).kind != "saddle"]
            middle = min(stable, key=lambda one: abs(one - start)) if stable else start
            return middle - 1.5 * np.pi, middle + 1.5 * np.pi
    reach = 4.0 * max(length, abs(start))
    places, everywhere = _places_of_rest(field, (start - reach, start + reach))
    known = np.array([start, *([] if everywhere else places)])
    if not everywhere and len(places) == 1:
        middle, half = places[0], 1.6 * max(abs(start - places[0]), 0.3 * length)
    else:
        middle, half = 0.5 * float(np.min(known) + np.max(known)), max(0.8 * float(np.ptp(known)), length)
    return middle - half, middle + half


def _places_of_rest(field: Field, across: tuple[float, float]) -> tuple[list[float], bool]:
    """Return where accelerations at rest vanish, and whether they do so everywhere."""
    grid = np.linspace(*across, _LOOKS)
    still = np.stack([grid, np.zeros_like(grid)], axis=1)
    values = field(still)[:, 1]
    moved = field(still + np.array([0.0, 1e-3 * (across[1] - across[0])]))[:, 1]
    largest = float(np.nanmax(np.abs(values)))
    if largest <= _NOTHING * float(np.nanmax(np.abs(moved), initial=0.0)) or largest == 0.0:
        return [], True

    def at(place: float) -> float:
        return float(np.nan_to_num(field(np.array([[place, 0.0]]))[0, 1], nan=largest))

    found = list(grid[np.abs(values) <= 1e-14 * largest])
    for k in np.nonzero(values[:-1] * values[1:] < 0.0)[0]:
        place = float(brentq(at, grid[k], grid[k + 1], xtol=1e-15 * (across[1] - across[0]), rtol=1e-15))
        if abs(at(place)) <= _JUMP * max(abs(values[k]), abs(values[k + 1])):
            found.append(place)
    width = across[1] - across[0]
    kept: list[float] = []
    for place in sorted(found):
        if not kept or place - kept[-1] > width / _LOOKS:
            kept.append(float(place) if abs(place) > _ROUNDING * width else 0.0)
    return kept, False


_JUMP = 1e-3
"""Relative to accelerations beside a place: where more is left they jump there from one sign to the other."""

_ROUNDING = 1e-13
"""Relative to the window: coordinates below are zero."""


def _rest_point(matrix: FloatArray, place: float) -> RestPoint:
    """Return what kind of state a state of rest is, by the matrix of the linear equations there."""
    first, second = (complex(one) for one in np.linalg.eigvals(matrix))
    size = max(abs(first), abs(second))
    tiny = 1e-7 * size
    if size == 0.0 or min(abs(first), abs(second)) <= tiny:
        kind = "degenerate"
    elif abs(first.imag) > tiny:
        kind = "centre" if abs(first.real) <= tiny else f"{'stable' if first.real < 0.0 else 'unstable'} focus"
    elif first.real * second.real < 0.0:
        kind = "saddle"
    else:
        kind = f"{'stable' if first.real < 0.0 else 'unstable'} node"
    return RestPoint(place, kind, (first, second))


def _speeds(
    field: Field, linear: Linear, across: tuple[float, float], rest_points: Sequence[RestPoint], start: float
) -> tuple[float, float]:
    """Return the range of speeds: that of the separatrices and half as much again, or that of the slowest swing."""
    width = across[1] - across[0]
    rates = [max(abs(value) for value in one.eigenvalues) for one in rest_points]
    if rates:
        high = 0.55 * width * max(rates)
    else:
        accelerations = field(np.stack([np.linspace(*across, 11), np.zeros(11)], axis=1))[:, 1]
        high = max(float(np.sqrt(np.nanmax(np.abs(accelerations)) * width)), 2.0 * abs(start)) or width
    saddles = [one.coordinate for one in rest_points if one.kind == "saddle"]
    if saddles:
        tall = Window(across, (-20.0 * high, 20.0 * high))
        rest = np.array([[one.coordinate, 0.0] for one in rest_points])
        found = separatrices(field, [(np.array([one, 0.0]), linear(one)) for one in saddles], tall, rest)
        if len(rest_points) > 1:
            high = 1.6 * max(float(np.max(np.abs(curve[:, 1]))) for curve in found)
    return -high, high


@dataclass(frozen=True, eq=False)
class PoincareSection(Described):
    """The points at which motions pass through a surface.

    Attributes
    ----------
    surface
        What was given for it.
    values
        Quantities by path, shape (points,), in SI units.
    units
        Their units.
    time
        When, s.
    start
        Number of the start of each point's motion.
    scene
        Name of the scene.
    """

    surface: str
    values: Mapping[str, FloatArray]
    units: Mapping[str, str]
    time: FloatArray
    start: NDArray[np.intp]
    scene: str

    def __len__(self) -> int:
        return len(self.time)

    def __getitem__(self, path: str) -> FloatArray:
        return self.values[path]

    def to_data(self) -> dict[str, Any]:
        """Return it as plain data, for JSON."""
        return data_of(self, "scene", "surface", "time", "start", "values", "units")

    def __repr__(self) -> str:
        points = f"{count_of(len(self), 'point')} of {count_of(int(np.max(self.start, initial=-1)) + 1, 'motion')}"
        return fitted(f"<PoincareSection of {self.scene}, {self.surface}: {points}, {', '.join(self.values)}>")


_START = replace(
    BY_PATH, word="PATH=VALUE,...", typed=lambda text: dict(one.strip().split("=", 1) for one in text.split(","))
)


@command("section")
@takes(
    scene=SCENE,
    surface=TEXT,
    quantities=each(TEXT, "paths of quantities, at least one, as a list of texts", least=1),
    starts=optional(each(_START, "start values by path, one mapping for each motion")),
    t_end=T_END,
    rtol=RTOL,
    solver=SOLVER,
)
def poincare_section(
    scene: Model | Assembly,
    surface: str,
    quantities: Sequence[str],
    *,
    starts: Iterable[Mapping[str, Any]] | None = None,
    t_end: float | str | None = None,
    rtol: float = 1e-10,
    solver: str = "auto",
) -> PoincareSection:
    """Return where motions pass through a surface in phase space.

    Passages are found as events are, to rounding in time, and the quantities are those of the state there.

    Parameters
    ----------
    scene
        The scene, or an assembly of it.
    surface
        Such as ``"rod1.angle rises above 0"``; see `until` of `atwood.simulate`.
    quantities
        What to look at there, by path; angles count their turns.
    starts
        Start values of several motions, as changes of the scene's own; that alone if not given.
    t_end, rtol, solver
        See `atwood.simulate`.

    Returns
    -------
    PoincareSection
        The points.

    Raises
    ------
    UsageError
        If there is no such quantity.
    SolveError
        If a motion does not get to its end.
    """
    assembly = smooth_assembly_of(scene)
    own = [assembly] if starts is None else [assembly.with_values(start=dict(one)) for one in starts]
    times, numbers, units = list[FloatArray](), list[int](), dict[str, str]()
    found: dict[str, list[FloatArray]] = {path: [] for path in quantities}
    for k, one in enumerate(own):
        result = simulate(one, t_end=t_end, rtol=rtol, outputs=2, solver=solver, record=surface)
        if result.status not in ("finished", "stopped"):
            raise SolveError(
                f"motion {k} does not get to its end: {result.message}", where=assembly.flat.name, advice=""
            )
        passed = [event.time for event in result.events if not event.part and event.law == " ".join(surface.split())]
        at = np.searchsorted(result.time, passed)
        times.append(result.time[at])
        numbers += [k] * len(at)
        for path in quantities:
            found[path].append(result[path][at])
            units[path] = result.unit(path)
    if not own:
        raise UsageError("there is no start", where=assembly.flat.name, advice="Give at least one in `starts`.")
    values = {path: np.concatenate(parts) for path, parts in found.items()}
    shown = " ".join(surface.split())
    start = np.array(numbers, dtype=np.intp)
    return PoincareSection(shown, values, units, np.concatenate(times), start, assembly.flat.name)
