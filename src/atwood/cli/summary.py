"""What `atwood run` shows: how the run went, how accurate it is, where it ends, and the energy of each component."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from atwood.cli.command import Request
from atwood.cli.output import Writer, writer
from atwood.cli.running import degrees_of_freedom, multiplier_labels
from atwood.display import count_of, duration
from atwood.forms.assembly import Assembly
from atwood.result.about import solver_name
from atwood.result.result import Result
from atwood.stages import STAGES
from atwood.table import facts, table

if TYPE_CHECKING:  # a run that shows no energies does without files of results
    from atwood.result.part_energy import PartEnergies, PartEnergy

_ROWS = 16
_MOST = 40  # components in the table of energies
_FIRST_EVENTS, _LAST_EVENTS = 12, 4
_NARROWEST, _WIDEST = 9, 32  # of a small picture of a curve
_BARS = "▁▂▃▄▅▆▇█"

_NOTHING = 1e-7
"""Of the energy that is exchanged: by less nothing has come in, nor by less than what does not balance."""


def print_summary(result: Result, request: Request) -> None:
    """Show a run."""
    out = writer()
    out.show(facts(_facts(result), f"{result.assembly.flat.name}, {result.method}"))
    out.line()
    paths = main_quantities(result)
    hidden = len(result.paths) - min(len(paths), _ROWS)
    more = count_of(hidden, "more quantity", "more quantities")
    notes = [f"{more}: --json or --save FILE shows all"] if hidden else []
    out.show(table(*_quantities(result, paths[:_ROWS], out.width), notes=notes))
    if request.energy == "parts":
        _print_energies(result.energy.parts, out)
    if request.timings:
        out.line()
        rows = [[name, f"{1e3 * spent:.3g}", STAGES[name]] for name, spent in result.timings.items()]
        out.show(table(("stage", "ms>", "what it makes"), rows))
    out.files(saved=request.save, plotted=request.plot, drawn=request.draw)


def _print_energies(parts: PartEnergies, out: Writer) -> None:
    """Show what each component gained from start to end, and where it came from."""
    shown = {path: parts[path] for path in (*parts, *parts.models)}
    nothing = max(_NOTHING, 3.0 * parts.max_error) * parts.exchanged
    found = {path: cells for path, one in shown.items() if (cells := _cells(one, nothing))}
    heads = ["", "gained>", "supplied>", "dissipated>", "constraints>", "impacts>", "came in through"]
    lines = [[path + ("" if shown[path].is_unique else " *"), *cells] for path, cells in list(found.items())[:_MOST]]
    used = [i for i in range(len(heads)) if i < 2 or any(row[i] for row in lines)]
    hidden = len(shown) - len(lines)
    notes = [f"{count_of(hidden, 'more component')}: --json or --save FILE shows all"] if hidden else []
    notes += [*["* not unique"] * bool(parts.undetermined), *parts.describe().split("\n")]
    rows = [[row[i] for i in used] for row in lines]
    out.line()
    out.show(table([heads[i] for i in used] if lines else (), rows, "energy from start to end, J", notes))


def _cells(one: PartEnergy, nothing: float) -> list[str]:
    """Return the row of a component; nothing where it takes no part."""

    def written(value: float) -> str:
        return f"{value:.4g}" if abs(value) > nothing else ""

    sums = (one.gained, one.supplied, one.dissipated, one.constraints, one.impacts)
    cells = [written(float(values[-1])) for values in sums]
    through = ", ".join(f"{name} {text}" for name, x in one.work.items() if (text := written(float(x[-1]))))
    largest = max(float(np.max(np.abs(values), initial=0.0)) for values in (*sums, *one.work.values()))
    return [cells[0] or "0", *cells[1:], through] if largest > nothing else []


def _quantities(result: Result, paths: list[str], width: int) -> tuple[list[str], list[list[str]]]:
    """Return the table of quantities, with a small picture of each curve where there is room for it."""
    headings = ["quantity", "start>", "end>", "smallest>", "largest>", "unit"]
    rows = []
    for path in paths:
        values = result.array(path)
        low, high = float(np.min(values)), float(np.max(values))
        ends = [f"{_clean(v, values):.6g}" for v in (values[0], values[-1])]
        rows.append([path, *ends, *(f"{_clean(v, values):.4g}" for v in (low, high)), result.unit(path)])
    left = (
        width
        - 2
        - sum(max(map(len, column)) + 2 for column in zip((name.strip(">") for name in headings), *rows, strict=True))
    )
    if left >= _NARROWEST:
        headings.append("over time")
        for path, row in zip(paths, rows, strict=True):
            row.append(sparkline(result.array(path), min(left, _WIDEST)))
    return headings, rows


def _facts(result: Result) -> Iterator[tuple[str, str]]:
    """Yield how a run went, as labels and sentences."""
    plan, statistics = result.first_plan, result.statistics
    size = [count_of(degrees_of_freedom(result), "degree") + " of freedom", count_of(plan.program.size, "state")]
    multipliers = len(multiplier_labels(result))
    if multipliers:
        size.append(count_of(multipliers, "multiplier"))
    yield "mechanism", ", ".join(size)
    if result.immobile is not None:
        yield "immobile", result.immobile.describe()
    if result.initialization.summary:
        yield "assembled", result.initialization.summary
    span = f"t = {result.start.time:g} to {result.time[-1]:.6g} s"
    yield "run", f"{span}, rtol {result.run.options.relative_tolerance:g}, {len(result.time)} outputs"
    if result.status != "finished":
        why = {"stopped": "stopped", "step_limit": "out of steps", "time_limit": "out of time"}
        said = why.get(result.status, result.status)
        yield "ended early", f"{said}: {result.message}" if result.message else said
    yield from _events(result)
    yield from _passages(result)
    if result.coordinate_switches:
        times = sorted({one.time for one in result.coordinate_switches})
        often = count_of(len(result.coordinate_switches), "time")
        span = f"at t = {times[0]:.6g} s" if len(times) == 1 else f"from t = {times[0]:.6g} to {times[-1]:.6g} s"
        yield "orientation", f"{result.assembly.orientation.kind}, switched {often} {span}"
    yield (
        "solver",
        f"{solver_name(result)}, {count_of(statistics.steps, 'step')}, {statistics.residual_evaluations} residuals, "
        f"{statistics.jacobian_evaluations} Jacobians, {duration(statistics.seconds)}",
    )
    if result.run.options.solver == "auto":
        yield "chosen", result.run.why
    if result.run.options.accuracy is not None:
        yield "accuracy", result.accuracy.describe()
    yield "energy", _energy(result)
    if result.conserved is not None:
        yield "conserved", result.conserved.describe()
    if plan.balance.constraints:
        missed = result.constraint_max
        held = max(missed["held_position"], missed["held_velocity"])
        before = f" ({held:.1e} before projection)" if plan.is_projected else ""
        yield "constraints", f"missed by {max(missed['position'], missed['velocity']):.1e} of the scene's size{before}"


def _events(result: Result) -> Iterator[tuple[str, str]]:
    """Yield the events of a run by their times; of many, the first and the last."""
    found = sorted((one for one in result.events if one.target != "stop"), key=lambda one: one.time)
    hidden = found[_FIRST_EVENTS:-_LAST_EVENTS] if len(found) > _FIRST_EVENTS + _LAST_EVENTS + 1 else []
    for number, one in enumerate(found):
        if not hidden or number < _FIRST_EVENTS or number >= len(found) - _LAST_EVENTS:
            yield "event", one.describe()
        elif number == _FIRST_EVENTS:
            yield "", f"{count_of(len(hidden), 'more event')} until t = {hidden[-1].time:.6g} s: --json shows all"


def _passages(result: Result) -> Iterator[tuple[str, str]]:
    """Yield the singular positions of a run: the first of each kind, and when it came to others like it."""
    for through in (True, False):
        found = [one for one in result.singular_crossings if (one.ways > 0) == through]
        if not found:
            continue
        yield "singular" if through else "not sure", found[0].describe()
        if len(found) > 1:
            later = ", ".join(f"{one.time:.6g}" for one in found[1:6])
            more = count_of(len(found) - 6, "more time") if len(found) > 6 else ""
            yield "", f"and again at t = {later} s" + (f", and {more}" if more else "")


def _energy(result: Result) -> str:
    ledger = result.energy
    first, last = (0.0 if abs(e) <= ledger.uncertainty else e for e in (ledger.total[0], ledger.total[-1]))
    is_work = np.max(np.abs(ledger.work), initial=0.0) > ledger.uncertainty
    work = f", work {ledger.work[-1] - ledger.work[0]:.6g} J" if is_work else ""
    return f"{first:.6g} J to {last:.6g} J{work}; {ledger.describe()}"


def _clean(value: float, values: NDArray[np.float64]) -> float:
    """Return a value, or zero where it is rounding against the others."""
    return 0.0 if abs(value) <= 1e-13 * float(np.max(np.abs(values))) else float(value)


def main_quantities(result: Result) -> list[str]:
    """Return the quantities that say most: coordinates, where masses are, then what pulls and holds.

    Of a body with coordinates of its orientation its spin is shown, since no result has those coordinates themselves.
    Where something does not move comes last.
    """
    assembly = result.assembly
    names = [name for name in _shown_coordinates(assembly) if name in result]
    shown = assembly.mechanism.bodies.bodies
    masses = [f"{body.name}.position.{axis}" for body in shown if not body.is_fixed for axis in "xyz"]
    tensions = [path for path in result.paths if path.endswith(".tension")]
    forces = [one.path for one in assembly.reactions if one.path not in tensions]
    masses = [path for path in masses if path in result]
    result.table([*names, *tensions, *forces, *masses])  # all in one pass, since each needs a program
    forces = [path for path in forces if np.any(result.array(path))]
    moving = [path for path in masses if np.ptp(result.array(path)) > 0.0]
    chosen = [*names[:8], *tensions[:6], *moving, *names[8:], *tensions[6:], *forces, *masses]
    return list(dict.fromkeys(chosen))


def _shown_coordinates(assembly: Assembly) -> list[str]:
    """Return the names of the coordinates; in place of an orientation in space the spin of the body."""
    found: dict[str, None] = {}
    for one in assembly.regular.names:
        body, turn, _ = one.name.partition(".quaternion.")
        found.update(dict.fromkeys([f"{body}.spin.{axis}" for axis in "xyz"] if turn else [one.name]))
    return list(found)


def sparkline(values: NDArray[np.float64], width: int = 24) -> str:
    """Return a small picture of a curve as text."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return ""
    low, high = float(np.min(finite)), float(np.max(finite))
    if high - low <= 1e-9 * max(abs(low), abs(high)):
        return "─" * min(width, len(values))
    picked = np.interp(np.linspace(0, len(values) - 1, min(width, len(values))), np.arange(len(values)), values)
    heights = np.nan_to_num((picked - low) / (high - low)) * (len(_BARS) - 1)
    return "".join(_BARS[round(float(h))] for h in heights)
