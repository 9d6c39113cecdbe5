"""The conditions of a start in numbers, sorted by what they are of, and the nearest place that meets them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import StartError
from atwood.expr import Expression, Program, depends_on, jacobian, jvp, live
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.other_values import no_start_quantity
from atwood.forms.quantities import coordinate_program
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.outputs.observables import Observable
from atwood.model.values.units import parse_unit
from atwood.numerics.matrices import (
    Matrix,
    from_entries,
    is_full,
    scaled,
)
from atwood.numerics.newton import Missing, newton
from atwood.numerics.rank import certain, independent_rows, open_directions, row_scales
from atwood.numerics.sparse import free_columns
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of
from atwood.simulation.dynamics.rounding import RowErrors
from atwood.simulation.dynamics.scales import FAR, floating_alone
from atwood.tolerances import tolerances


@dataclass(frozen=True)
class Conditions:
    """The conditions of a start as a program, with their derivatives; the same for all values of a structure."""

    program: Program
    rows: tuple[int, ...]
    columns: tuple[int, ...]
    shape: tuple[int, int]


_CONDITIONS: Key[Conditions] = Key("conditions of a start")


def start_conditions(
    assembly: Assembly, equations: Equations, targets: Sequence[Target], constrained: bool, of_speeds: bool
) -> Conditions:
    """Return the conditions of a start."""

    def make() -> Conditions:
        constraints: list[Expression] = []
        if constrained and of_speeds:
            constraints = [one.rate for one in equations.constraints]
        elif constrained:
            constraints = [one.value for one in equations.constraints if one.value is not None]
        unknowns = equations.speeds if of_speeds else equations.coordinates
        expressions = [*constraints, *(one.observable.value for one in targets)]
        entries = jacobian(expressions, list(unknowns)) if expressions else None
        groups = {"values": expressions, "jacobian": entries.entries if entries else ()}
        program = coordinate_program(assembly, "start", equations, groups)
        places = (tuple(entries.rows), tuple(entries.columns)) if entries else ((), ())
        return Conditions(program, *places, (len(expressions), len(unknowns)))

    return assembly.shared.get(_CONDITIONS, make, tuple(one.path for one in targets), constrained, of_speeds)


_EXACT, _LONGEST, _HALVINGS = 1e-15, 0.5, 8
"""In the scene's sizes: what is rounding, and how far a step leads at most; it is halved as often where it misses."""


class System:
    """Values and derivatives of targets and constraints along the speeds: of places, or of speeds themselves.

    Parameters
    ----------
    assembly, equations, targets, constrained, of_speeds
        See `start_conditions`.
    whole_turns
        Whether angles are met that differ by whole turns from what is said, also where they count their turns.
    """

    def __init__(
        self,
        assembly: Assembly,
        equations: Equations,
        targets: Sequence[Target],
        constrained: bool,
        of_speeds: bool = False,
        whole_turns: bool = False,
    ) -> None:
        made = start_conditions(assembly, equations, targets, constrained, of_speeds)
        kinematic_map = kinematic_map_of(assembly, "regular")
        self.kinematic_map = None if of_speeds else kinematic_map
        self.program = made.program
        self.kernel = assembly.kernel(made.program)
        self._last: tuple[tuple[float, bytes, bytes] | None, tuple[Any, ...]] = (None, ())
        self.rows, self.columns, self.shape = made.rows, made.columns, made.shape
        places = made.rows, made.columns
        held = [one.key[:2] for one in equations.constraints if of_speeds or one.value is not None]
        laws = [*(held if constrained else []), *(one.path for one in targets)]
        self.errors = RowErrors(
            assembly, made.program, ("values", "jacobian"), laws, places, kinematic_map, not of_speeds
        )
        self._assembly = assembly if equations is assembly.regular else None  # what starts closed may float no more
        self.targets, self.constraints = targets, made.shape[0] - len(targets)
        self._wanted = np.array([one.value for one in targets], dtype=float)
        self.wrapped = [one.observable.periodic or (whole_turns and one.observable.unit == "rad") for one in targets]
        self.speed_names = tuple(one.name for one in equations.speed_names)
        self.speeds = len(equations.speeds)

    def longest(self, scales: FloatArray) -> float | FloatArray:
        """Return how far a step leads at most, in the scene's sizes: what floats far away may come from anywhere."""
        far = max((abs(one.value) for one in self.targets if one.observable.unit == "m"), default=0.0)
        if self._assembly is None or not far:
            return _LONGEST
        along = np.array([one.unit == "m/s" for one in self._assembly.regular.speed_names], dtype=bool)
        if far <= FAR * float(np.max(scales[along], initial=0.0)):
            return _LONGEST
        found = np.full(len(scales), _LONGEST)
        found[floating_alone(self._assembly)] = np.inf
        return found

    def at(self, t: float, q: FloatArray, u: FloatArray) -> tuple[FloatArray, Matrix]:
        """Return what is missing in each equation, and the derivatives."""
        residual = self.missing(t, q, u)
        matrix = from_entries(self.rows, self.columns, self._last[1][1], self.shape)
        if self.kinematic_map is not None and not self.kinematic_map.is_plain:
            matrix = matrix @ self.kinematic_map.matrix(t, q)
        return residual, matrix

    def missing(self, t: float, q: FloatArray, u: FloatArray) -> FloatArray:
        """Return what is missing in each equation."""
        key = t, q.tobytes(), u.tobytes()
        if self._last[0] != key:
            self._last = key, self.kernel([t], q, u)
        residual = np.array(self._last[1][0], dtype=float)
        residual[self.constraints :] -= self._wanted
        for i, is_wrapped in enumerate(self.wrapped, start=self.constraints):
            if is_wrapped:
                residual[i] = np.remainder(residual[i] + np.pi, 2.0 * np.pi) - np.pi
        return residual


def nearest(
    system: System, scales: FloatArray, t: float, q: FloatArray, iterations: int = 60
) -> tuple[FloatArray, FloatArray, Matrix]:
    """Move to the nearest configuration that fulfils a system; return it with what is missing, scaled."""
    assert system.kinematic_map is not None
    errors, still = system.errors.near(t, q, scales), np.zeros_like(scales)

    def look(place: FloatArray) -> Missing:
        residual, matrix = system.at(t, place, still)
        rows = row_scales(matrix, scales, errors)
        # Which components of a law are small depends on how a scene is turned.
        return Missing(residual, rows, lambda: matrix, system.errors.shared(rows))

    moved = partial(system.kinematic_map.moved, t)
    q, now = newton(
        look,
        moved,
        q,
        scales,
        steps=iterations,
        met=tolerances.MET,
        exact=_EXACT,
        longest=system.longest(scales),
        halvings=_HALVINGS,
        is_even=True,
        missed=lambda place: system.missing(t, place, still),
    )
    # What hardly changes with any coordinate, as where links line up, is measured by the scene.
    sizes = np.maximum(now.units, 1e-4 * max(now.units.max(initial=0.0), scales.max(initial=0.0)))
    # What rounding could have left of a condition that nothing changes, as of a speed that a drive prescribes, is met.
    sizes = np.maximum(sizes, certain(errors, np.zeros_like(errors)) / tolerances.MET)
    return q, now.value / sizes, scaled(now.slopes(), scales)


def counted(
    names: Sequence[str],
    tangent: Matrix | None,
    fixed: Sequence[Target],
    constraints: int,
    matrix: Matrix,
    errors: FloatArray,
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return which coordinates or speeds nothing determines, and which fixed values repeat others."""
    if 0 in matrix.shape:
        return tuple(names), ()
    kept = independent_rows(matrix, errors, first=np.arange(matrix.shape[0]) < constraints)
    known = set(kept)
    repeated = tuple(t.path for i, t in enumerate(fixed, start=constraints) if i not in known)
    if len(kept) == matrix.shape[1]:
        return (), repeated
    if not is_full(matrix):
        rows = row_scales(matrix, np.ones(matrix.shape[1]), errors)
        found = free_columns(scaled(matrix, np.ones(matrix.shape[1]), rows))
        found = found if tangent is None else abs(tangent) @ found > tolerances.FREE
        return tuple(n for n, is_free in zip(names, found, strict=True) if is_free), repeated
    directions = open_directions(matrix[kept])
    moved = np.abs(directions if tangent is None else directions @ tangent.T)
    return tuple(n for i, n in enumerate(names) if np.max(moved[:, i], initial=0.0) > tolerances.FREE), repeated


@dataclass(frozen=True)
class Target:
    """A quantity with the value that it is to have at the start.

    Attributes
    ----------
    path, value, observable
        The quantity, its value, and what computes it.
    given
        What was said instead, where a part says it in another way: paths and values of its Euler angles, for one.
    """

    path: str
    value: float
    observable: Observable
    given: tuple[tuple[str, float], ...] = ()

    @property
    def where(self) -> str:
        """The path under which it was said."""
        return self.given[0][0] if self.given else self.path


def as_said(targets: Iterable[Target]) -> list[str]:
    """Return targets in the words in which they were given, each of these once."""
    words = (pair for one in targets for pair in (one.given or ((one.path, one.value),)))
    return [f"{path} = {value:g}" for path, value in dict(words).items()]


@dataclass(frozen=True)
class Level:
    """Targets of one level, position or velocity, split into what is fixed and what is guessed."""

    fixed: list[Target]
    guessed: list[Target]


def sort_targets(assembly: Assembly, equations: Equations) -> tuple[Level, Level]:
    """Return what is said of positions and of speeds at the start."""
    levels = (Level([], []), Level([], []))
    for is_fixed, given in ((True, assembly.flat.start), (False, assembly.flat.guess)):
        restated, origins = _restated(assembly, given)
        for path, value in restated.items():
            number = assembly.shared.get(_LEVEL, partial(find_level, assembly, equations, path), path)
            level = levels[number]
            target = Target(path, value, assembly.start_observables[path], origins.get(path, ()))
            (level.fixed if is_fixed else level.guessed).append(target)
    return levels


Origins = dict[str, tuple[tuple[str, float], ...]]
"""For the path of a value that was said in another way, what was said."""


def _restated(assembly: Assembly, given: Mapping[str, float]) -> tuple[dict[str, float], Origins]:
    """Return start values with those that a part says in another way said so; see `Component.restate_start`."""
    found = dict(given)
    origins: Origins = {}
    said: dict[str, dict[str, float]] = {}
    for key, value in given.items():
        path, _, name = key.rpartition(".")
        if path in assembly.flat.parts:
            said.setdefault(path, {})[name] = value
    for path, own in said.items():
        part = assembly.flat.parts[path]
        restated = part.component.restate_start(own, assembly.mechanism.space.name)
        if restated != own:
            for name, value in restated.items():
                said_too = given.get(f"{path}.{name}", value)
                if not abs(said_too - value) <= tolerances.CLOSED:
                    others = ", ".join(f"{one} = {own[one]:g}" for one in own if one not in restated)
                    raise StartError(
                        f"it is given as {said_too:g}, and {others} makes it {value:g}",
                        where=f"{path}.{name}",
                        advice="The start values contradict each other: give one or the other.",
                    )
            for name in own:
                del found[f"{path}.{name}"]
            found.update({f"{path}.{name}": value for name, value in restated.items()})
            instead = tuple((f"{path}.{name}", value) for name, value in own.items() if name not in restated)
            origins.update({f"{path}.{name}": instead for name in restated if name not in own})
    return found, origins


_LEVEL: Key[int] = Key("level of a start value")
_LATER_SYMBOLS: Key[tuple[frozenset[Expression], frozenset[Expression]]] = Key("what starts do not give, and speeds")


def find_level(assembly: Assembly, equations: Equations, path: str) -> int:
    """Return whether a start value is of positions (0) or of speeds (1)."""
    observables = assembly.start_observables
    if path not in observables:
        raise no_start_quantity(path, observables)
    one = observables[path]
    reads = {node for node in live([one.value]) if node.is_symbol}
    late, speeds = assembly.shared.get(_LATER_SYMBOLS, lambda: _later_symbols(assembly, equations))
    if not late.isdisjoint(reads):
        raise StartError(
            "the quantity follows from positions and speeds and cannot be prescribed at the start",
            where=path,
            advice="Give coordinates, positions and velocities.",
        )
    own = [symbol for symbol in reads if symbol in speeds]
    if not own:  # what does not move with anything is a rate if its unit is one
        still = reads.isdisjoint(equations.coordinates)
        return int(still and parse_unit(one.unit).exponents[2] == -1)
    if not _is_linear(one.value, own):
        raise StartError(
            "the quantity is not linear in the speeds and cannot be prescribed at the start",
            where=path,
            advice="Give velocities.",
        )
    return 1


def _later_symbols(assembly: Assembly, equations: Equations) -> tuple[frozenset[Expression], frozenset[Expression]]:
    """Return what is known only after positions and speeds, and the speeds."""
    late = frozenset([*equations.accelerations, *(one.symbol for one in assembly.reactions)])
    return late, frozenset(equations.speeds)


def _is_linear(value: Expression, speeds: Sequence[Expression]) -> bool:
    """Return whether an expression is linear in the speeds: its derivative along them does not depend on them."""
    directions: dict[Expression, Expression | float] = {}
    start = len(value.graph)
    for u in sorted(speeds, key=lambda u: u.index):  # new nodes come in the same order in every process
        directions[u] = u.graph.symbol(f"direction:{u.name}")
    found = value.is_symbol or not depends_on(jvp([value], directions)[0], speeds)
    value.graph.forget(start)
    return found


def said(unknowns: Sequence[Expression], targets: Sequence[Target], otherwise: FloatArray) -> tuple[FloatArray, bool]:
    """Return what is said of unknowns themselves, which needs no iteration, and whether that is all that is said."""
    values, is_direct = otherwise.copy(), True
    places = {symbol: i for i, symbol in enumerate(unknowns)} if targets else {}
    for target in targets:
        if target.observable.value in places:
            values[places[target.observable.value]] = target.value
        else:
            is_direct = False
    return values, is_direct


def named_once(unknowns: Sequence[Expression], fixed: Sequence[Target]) -> set[int] | None:
    """Return which unknowns fixed values are of; None if one of these is of something else, or two are of one."""
    places = {symbol: i for i, symbol in enumerate(unknowns)} if fixed else {}
    found = {places[one.observable.value] for one in fixed if one.observable.value in places}
    return found if len(found) == len(fixed) else None
