"""The mechanism report as text."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby, islice
from typing import TYPE_CHECKING

from atwood.display import count_of
from atwood.table import Table, facts, table

if TYPE_CHECKING:
    from atwood.reporting.mechanism import MechanismReport


_SHOWN = 12
"""Of a long list, so many are named."""

_ARRAY = 4

_ROWS = 16
"""So many parameters are shown."""


def described(report: MechanismReport) -> Table:
    """Return a mechanism report as labels and sentences."""
    return facts(_facts(report), title(report))


def parameters(report: MechanismReport) -> Table:
    """Return the numbers among the parameters, those that are alike in one row."""
    groups: dict[tuple[str, float, str, str], list[str]] = {}
    for one in report.parameters:
        if isinstance(one.value, (int, float)):
            alike = (re.sub(r"\[\d+\]", "[]", one.path), one.value, one.unit, one.meaning)
            groups.setdefault(alike, []).append(one.path)
    rows = (
        (shorten(paths, 3, least=2), f"{value:g}", "" if unit == "1" else unit, meaning)
        for (_, value, unit, meaning), paths in islice(groups.items(), _ROWS)
    )
    more = [f"... and {len(groups) - _ROWS} more; --json shows all"] if len(groups) > _ROWS else []
    return table(("parameter", "value>", "unit", "meaning~"), rows, notes=more)


def title(report: MechanismReport) -> str:
    """Return the heading of a mechanism report."""
    gravity = f"gravity {report.gravity:g} m/s^2" if report.gravity else "without gravity"
    where = {"line": "on a line", "plane": "in the plane", "space": "in space"}[report.space]
    return f"{report.scene}: a mechanism {where}, {gravity}"


def overview(report: MechanismReport) -> str:
    """Return what a mechanism is in one line."""
    counts = (
        count_of(report.degrees_of_freedom, "degree") + " of freedom",
        count_of(len(report.bodies), "body", "bodies"),
        count_of(len(report.joints), "joint"),
        count_of(report.loops, "loop"),
        count_of(len(report.redundant), "redundant constraint"),
    )
    return f"{title(report)}; {', '.join(counts)}"


def shorten(names: Iterable[str], shown: int = _SHOWN, least: int = _ARRAY) -> str:
    """Return names with commas, and of a long list the first ones, the last, and how many."""
    listed = list(names)
    short = list(_arrays(list(_vectors(listed)), least))
    if len(short) <= shown:
        return ", ".join(short)
    return f"{', '.join(short[: shown - 2])}, ... {short[-1]} ({len(listed)} in all)"


def _vectors(names: Sequence[str]) -> Iterator[str]:
    """Yield names with three or four components that follow each other as one."""
    keyed = [(match[1], match[3]) if (match := _COMPONENT.match(name)) else (name, "") for name in names]
    for _, group in groupby(range(len(names)), key=keyed.__getitem__):
        found = [names[i] for i in group]
        if len(found) == len(set(found)) >= _IN_SPACE:
            yield "/".join([found[0], *(name.rpartition(".")[2] for name in found[1:])])
        else:
            yield from found


_COMPONENT = re.compile(r"(.*)\.([wxyz])('?)$")
_IN_SPACE = 3


def _arrays(names: Sequence[str], least: int) -> Iterator[str]:
    """Yield names with the elements of an array that follow each other as one."""
    run: list[tuple[str, int, str]] = []
    for name in [*names, ""]:
        match = _ELEMENT.match(name)
        entry = (match[1], int(match[2]), match[3]) if match else None
        if run and entry != (run[0][0], run[0][1] + len(run), run[0][2]):
            if len(run) >= least:
                yield f"{run[0][0]}[{run[0][1]}..{run[-1][1]}]{run[0][2]}"
            else:
                yield from (f"{before}[{number}]{after}" for before, number, after in run)
            run = []
        if entry is not None:
            run.append(entry)
        elif name:
            yield name


_ELEMENT = re.compile(r"(.*?)\[(\d+)\](.*)$")


def _facts(report: MechanismReport) -> Iterator[tuple[str, str]]:
    """Yield a mechanism report as labels and sentences."""
    yield "freedom", count_of(report.degrees_of_freedom, "degree") + " of freedom"
    yield "coordinates", shorten(report.coordinates) or "none: everything is fixed or prescribed"
    yield "bodies", shorten(f"{one.path} ({one.mass:g} kg)" for one in report.bodies) or "nothing that moves has mass"
    if report.massless:
        yield "without mass", f"{shorten(report.massless)}; no state of its own"
    if report.joints:
        yield "joints", shorten(f"{one.path} ({one.kind})" for one in report.joints)
    if report.ties:
        yield "held by", shorten(report.ties)
    yield from _what_became(report)
    yield from _loops(report)
    yield from _warnings(report)
    yield from _forms(report)
    yield from _offers(report)


def _what_became(report: MechanismReport) -> Iterator[tuple[str, str]]:
    if report.merged:
        yield "merged", shorten(f"{one.path} is one with {_world(one.into)}" for one in report.merged)
    if report.dropped:
        yield "dropped", shorten(f"{one.path} ({one.why})" for one in report.dropped)
    if report.integrated:
        one = "it holds" if len(report.integrated) == 1 else "they hold"
        yield "integrated", f"{shorten(report.integrated)}: {one} positions too, where the start has put them"
    if report.on_surfaces:
        text = "integrable, so that motions stay on surfaces, but no simple integral was found"
        yield "on surfaces", f"{shorten(report.on_surfaces)}: {text}"
    if report.idle_spins:
        yield (
            "without inertia",
            f"the spin of {shorten(report.idle_spins)} about its own axis, on which nothing acts: left at rest",
        )
    if report.solved_speeds:
        rates = (f"{name}'" for name in report.solved_speeds)
        yield "rolling", f"{shorten(rates)}: given by the other speeds, so no states of their own"
    if report.eliminated:
        yield "eliminated", f"{shorten(report.eliminated)}: a linear constraint gives it from the other coordinates"


def _world(name: str) -> str:
    return "the ground" if name == "world" else name


def _loops(report: MechanismReport) -> Iterator[tuple[str, str]]:
    if not report.loops:
        return
    closing = f", closed by {shorten(report.loop_joints)}" if report.loop_joints else ""
    yield "loops", count_of(report.loops, "loop") + closing
    if report.dependent:
        yield (
            "dependent",
            f"{shorten(report.dependent)}: dependent coordinates, determined by the loop constraints; the "
            "partitioning changes during a run where needed",
        )


def _warnings(report: MechanismReport) -> Iterator[tuple[str, str]]:
    if report.redundant:
        follow = "it follows" if len(report.redundant) == 1 else "they follow"
        left = "is" if len(report.redundant) == 1 else "are"
        text = f"{shorten(report.redundant)}: {follow} from the other constraints and {left} left out"
        if report.not_unique:
            text += (
                f"; the reactions {shorten(report.not_unique)} are then not unique; those of least norm are reported"
            )
        yield "redundant", text
    if report.immobile is not None:
        yield "immobile", report.immobile.describe()
    if report.initialization.summary:
        yield "assembled", report.initialization.summary
    if report.starts_singular:
        yield "singular start", "the constraints are rank deficient there; the motion from this position is not unique"
    if report.repeated:
        follow = "follows" if len(report.repeated) == 1 else "follow"
        yield "start", f"{shorten(report.repeated)} {follow} from the other start values"
    own = set(report.coordinates)
    free = [*report.free_coordinates, *(f"{name}'" if name in own else name for name in report.free_speeds)]
    if free:
        yield (
            "start",
            f"no start value for {shorten(_by_their_names(free))}: the guess, or zero, is taken as far as "
            "constraints allow",
        )


def _by_their_names(free: Sequence[str]) -> list[str]:
    """Return what a start leaves free, each once; orientations as such, since no start gives their coordinates."""
    named = (f"the orientation of {match[1]}" if (match := _TURN.match(name)) else name for name in free)
    return list(dict.fromkeys(named))


_TURN = re.compile(r"(.*)\.quaternion\.[wxyz]$")


def _forms(report: MechanismReport) -> Iterator[tuple[str, str]]:
    notes = {
        "reduced": "",
        "dae": f" with {count_of(len(report.constraints), 'constraint')}" if report.constraints else "",
    }
    for form, states in report.states.items():
        counts = report.operations[form]
        total = count_of(sum(counts.values()), "operation")
        yield f"{form} form", f"{count_of(states, 'state')}{notes[form]}; {total}{_kinds(counts)} a residual"


def _offers(report: MechanismReport) -> Iterator[tuple[str, str]]:
    """Say where the motion stays by symmetry, and of the smallest space what it would save."""
    ready = [one for one in report.offers if one.states]
    for one in ready[:1]:
        forms = []
        for form, states in one.states.items():
            there, here = (sum(of[form].values()) for of in (one.operations, report.operations))
            forms.append(
                f"{form} form {count_of(states, 'state')} instead of {report.states[form]}, "
                f"{count_of(there, 'operation')} instead of {here}"
            )
        yield "symmetry", f"the motion stays {one.where}; with space={one.space!r} it would have: {'; '.join(forms)}"
    for one in [] if ready else report.offers:
        yield "symmetry", f"the motion stays {one.where}, and cannot be offered there: {one.why_not}"


def _kinds(counts: object) -> str:
    """Return the most frequent kinds of operations, in brackets."""
    if not isinstance(counts, dict) or not counts:
        return ""
    ordered: Sequence[tuple[str, int]] = sorted(counts.items(), key=lambda entry: -entry[1])
    return f" ({', '.join(f'{number} {kind}' for kind, number in ordered)})"
