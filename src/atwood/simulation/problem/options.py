"""How a run is made: its end, tolerances, nominal sizes, outputs, limits and solver."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import field
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, UsageError, check_known, suggestion_in_parts
from atwood.expr import evaluate, vjp
from atwood.forms.assembly import Assembly
from atwood.integrators.methods import AUTO, METHODS
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import Equations
from atwood.model.values.units import parse_quantity, parse_si_unit
from atwood.simulation.dynamics.scales import motion_names
from atwood.simulation.problem.conditions import Condition
from atwood.tolerances import tolerances

if TYPE_CHECKING:
    from atwood.forms.assembly import Assembly


def how_solved(form: str, level: str, solvers: Iterable[str]) -> str:
    """Return form and solver in words, ``"dae (ggl), IDA"``, with each solver where it was changed on the way.

    Levels say how constraints enter the residual of IDA; other methods have none.
    """
    titles = {one.title: one for one in METHODS.values()}
    methods = [METHODS.get(each) or titles[each] for each in solvers]
    found = {
        f"{form} ({level}), {one.word or one.key}"
        if level and one.is_implicit
        else f"{form}, {one.word or one.key}": None
        for one in methods
    }
    return ", then ".join(found) or form


@dataclass(frozen=True)
class RunOptions:
    """How a run is made.

    Attributes
    ----------
    t_end
        Time of the end, s.
    relative_tolerance
        Error allowed in a step, as a share of the unknowns.
    absolute_tolerance
        The same as a share of the scene's sizes; the relative one if None.
    outputs
        Number of output times, evenly spread, or the times themselves.
    max_steps, max_seconds
        Limits of the run.
    progress
        Called with the time reached.
    max_order, max_step
        Limits for the method.
    first_step
        Its first step after each start, s; None where it works that out.
    samples
        A run is sampled at least so often, for work and for angles that count turns, whatever is shown of it.
    solver
        A key of `~atwood.integrators.methods.METHODS`, or ``"auto"``; see `atwood.simulation.run.choice`.
    structure
        Whether it may be that nothing can move.
    on_step
        Called with the time before each step of the solver.
    conditions
        What is looked for along the run, besides the events of parts.
    order, step
        Of a method with fixed steps: its order, and the step, s.
    accuracy
        The error of the motion that was asked for; tolerances are chosen for it.
    nominal
        Sizes of quantities by path, in place of the scene's own: their errors are relative to these.
    impacts
        ``"together"`` or ``"one_by_one"``: how several impacts at once are solved.
    """

    t_end: float
    relative_tolerance: float = tolerances.RTOL
    absolute_tolerance: float | None = None
    outputs: int | FloatArray = 201
    max_steps: int | None = None
    max_seconds: float | None = None
    progress: Callable[[float], object] | None = None
    max_order: int = 5
    max_step: float | None = None
    solver: str = AUTO
    samples: int = 400
    structure: bool = False
    on_step: Callable[[float], object] | None = None
    conditions: tuple[Condition, ...] = ()
    order: int | None = None
    step: float | None = None
    accuracy: float | None = None
    nominal: Mapping[str, float] = field(default_factory=dict)
    first_step: float | None = None
    impacts: str = "together"

    @property
    def looks_for_events(self) -> bool:
        """Whether the solver that was asked for ends its steps at events."""
        return self.solver == AUTO or METHODS[self.solver].looks_for_events

    def out_of_time(self, t: float) -> str:
        """Return what is said of a run that its limit of time ended, at a time of its own."""
        return f"the limit of {self.max_seconds:g} s was used up (at t = {t:.9g})"

    def out_of_steps(self, t: float) -> str:
        """Return the same of its limit of steps."""
        return f"the limit of {self.max_steps} steps was used up (at t = {t:.9g})"


@dataclass(frozen=True, eq=False)
class Samples:
    """When a run is sampled.

    Attributes
    ----------
    times
        Sample times, s.
    shown
        Which of them are outputs.
    between
        Which of them lie between those that the run was made with, and so change nothing in it.
    """

    times: FloatArray
    shown: NDArray[np.bool_]
    between: NDArray[np.bool_]

    def with_more(self, times: FloatArray) -> Samples:
        """Return the same with more in between."""
        if not len(times):
            return self
        more = np.setdiff1d(times, self.times)
        order = np.argsort(np.concatenate([self.times, more]))
        no, yes = np.zeros(len(more), dtype=bool), np.ones(len(more), dtype=bool)
        return Samples(
            np.concatenate([self.times, more])[order],
            np.concatenate([self.shown, no])[order],
            np.concatenate([self.between, yes])[order],
        )

    def until(self, t: float, limit: float) -> Samples:
        """Return those after one time up to another, which is among them."""
        ahead = slice(*self.times.searchsorted([t, limit], side="right"))
        times, shown, between = self.times[ahead], self.shown[ahead], self.between[ahead]
        if not len(times) or times[-1] != limit:
            times, no = np.concatenate([times, [limit]]), np.zeros(1, dtype=bool)
            shown, between = np.concatenate([shown, no]), np.concatenate([between, no])
        return Samples(times, shown, between)

    def without_last_shown(self) -> Samples:
        """Return the same, of which the last is no output."""
        shown = self.shown.copy()
        shown[-1:] = False
        return Samples(self.times, shown, self.between)

    def shows(self, t: float) -> bool:
        """Return whether a time is that of an output."""
        number = int(self.times.searchsorted(t))
        return number < len(self.times) and bool(self.times[number] == t and self.shown[number])

    @property
    def own(self) -> FloatArray:
        """The times that the run was made with."""
        return self.times[~self.between]

    def ends_of_blocks(self, count: int) -> NDArray[np.intp]:
        """Return where to cut them into so many blocks, which are the same whatever lies between."""
        if count == 1:
            return np.array([len(self.times)])
        if not self.between.any():
            return np.array([*range(size := -(-len(self.times) // count), len(self.times), size), len(self.times)])
        own = np.flatnonzero(~self.between)
        size = -(-len(own) // count)
        return np.append(own[size - 1 : -1 : size] + 1, len(self.times))


def sample_times(t: float, options: RunOptions) -> Samples:
    """Return all samples, the start among them."""
    asked = options.outputs
    if isinstance(asked, (int, np.integer)):
        return _samples(t, options.t_end, int(asked), options.samples)
    if asked[0] < t or asked[-1] > options.t_end:
        raise UsageError(
            f"outputs go from {asked[0]:g} to {asked[-1]:g} s",
            advice=f"Give times between {t:g} and {options.t_end:g}.",
        )
    return _samples(t, options.t_end, np.asarray(asked, dtype=np.float64).tobytes(), options.samples)


@lru_cache(maxsize=4)
def _samples(t: float, t_end: float, outputs: int | bytes, samples: int) -> Samples:
    """Return samples with so many evenly spread outputs, or with those at times; a run again has the same."""
    asked = np.linspace(t, t_end, outputs) if isinstance(outputs, int) else np.frombuffer(outputs)
    found = _filled(t, t_end, asked, samples)
    for values in (found.times, found.shown, found.between):
        values.flags.writeable = False
    return found


def _filled(t: float, t_end: float, asked: FloatArray, samples: int) -> Samples:
    """Return outputs that were asked for, with samples between them."""
    filling = np.linspace(t, t_end, samples + 1)
    near = 1e-9 * (t_end - t)
    next_asked = np.minimum(np.searchsorted(asked, filling), len(asked) - 1)
    distance = np.minimum(np.abs(asked[next_asked] - filling), np.abs(asked[np.maximum(next_asked - 1, 0)] - filling))
    filling = filling[distance > near]
    times = np.concatenate([asked, filling])
    shown = np.concatenate([np.ones(len(asked), dtype=bool), np.zeros(len(filling), dtype=bool)])
    order = np.argsort(times)
    return Samples(times[order], shown[order], np.zeros(len(times), dtype=bool))


def sizes_of(assembly: Assembly, nominal: Mapping[str, Any] | None) -> Mapping[str, float]:
    """Return what `read_nominal` makes of sizes, if any were given."""
    if not nominal:
        return {}
    return read_nominal(assembly, nominal)


def read_nominal(assembly: Assembly, given: Mapping[str, Any] | None) -> dict[str, float]:
    """Return nominal sizes in SI units."""
    found = {}
    for path, size in (given or {}).items():
        check_known(path, assembly.observables, "nominal= names no quantity of the scene", hint=suggestion_in_parts)
        unit = assembly.observables[path].unit
        try:
            value = parse_quantity(size, parse_si_unit(unit), path) if isinstance(size, str) else float(size)
        except AtwoodError as error:
            raise UsageError(f"nominal=: {error.message}", where=path, advice=error.advice) from None
        if not (np.isfinite(value) and value > 0.0):
            raise UsageError(f"its nominal size cannot be {size!r}", where=path, advice="Give a size above 0.")
        found[path] = value
    return found


def with_nominal(
    assembly: Assembly, equations: Equations, sizes: tuple[FloatArray, FloatArray], nominal: Mapping[str, float]
) -> tuple[FloatArray, FloatArray]:
    """Return the sizes of coordinates and speeds, with those that quantities give in their place.

    A quantity that is linear in one coordinate, such as the displacement of a mass or the angle of a geared shaft, says
    the size of that; one that is linear in several, such as an angle between two bodies, says that none is larger. A
    speed is sized as its coordinate in the scene's time, unless a rate is given.
    """
    places, speeds = (one.copy() for one in sizes)
    found = [(size, _slopes(assembly, equations, path)) for path, size in nominal.items()]
    for size, (by_place, by_speed) in found:
        if not by_speed:
            _take(places, by_place, size)
    for k, name in enumerate(motion_names(equations)):
        numbers = [i for i, one in enumerate(equations.names) if one.name == name]
        if numbers:
            speeds[k] *= places[numbers[0]] / sizes[0][numbers[0]]
    for size, (by_place, by_speed) in found:
        if not by_place:
            _take(speeds, by_speed, size)
    return places, speeds


def _take(sizes: FloatArray, slopes: Mapping[int, float], size: float) -> None:
    for i, slope in slopes.items():
        own = size / abs(slope)
        sizes[i] = own if len(slopes) == 1 else min(own, sizes[i])


def _slopes(assembly: Assembly, equations: Equations, path: str) -> tuple[dict[int, float], dict[int, float]]:
    """Return the derivatives of a quantity by coordinates and speeds, where they are the same everywhere."""
    value, numbers = (
        assembly.observables[path].value,
        dict(zip(assembly.parameters, assembly.parameter_values, strict=True)),
    )
    found = []
    for symbols in (equations.coordinates, equations.speeds):
        slopes = vjp([value], [value.graph.constant(1.0)], list(symbols))
        used = {i: one for i, one in enumerate(slopes) if not one.is_zero}
        if not all(one.is_parametric for one in used.values()):
            return {}, {}
        values = evaluate(list(used.values()), numbers)
        found.append({i: float(x) for i, x in zip(used, values, strict=True) if x})
    return found[0], found[1]
