"""Why there is no start: a loop that cannot close, or values that contradict each other."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import KernelEvaluationError, StartError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import Equations
from atwood.numerics.matrices import scaled
from atwood.numerics.rank import independent_rows
from atwood.simulation.initialization.closure_error import ClosureError, find_closure_errors
from atwood.simulation.initialization.loop_closure import Nearest, closest, closest_of_all, units_of_rows
from atwood.simulation.initialization.system import Level, System, Target, as_said
from atwood.tolerances import tolerances

_SHOWN = 6

_HELD = 1e-4
"""What is to hold all but exactly while something else is made small counts so much more."""


@dataclass(frozen=True)
class Failed:
    """A start that was not found.

    Attributes
    ----------
    assembly, equations
        The scene.
    level
        What is said of positions.
    scales
        Size of a displacement along each speed.
    length
        Extent of the scene, m.
    time
        Of the start, s.
    rough
        Where bodies were placed by what is said of them.
    nearest
        Where Newton's method came to rest.
    residual
        What each condition misses there, scaled.
    """

    assembly: Assembly
    equations: Equations
    level: Level
    scales: FloatArray
    length: float
    time: float
    rough: FloatArray
    nearest: FloatArray
    residual: FloatArray


def explain_positions(failed: Failed) -> StartError:
    """Return the error that says whether a loop cannot close or the start contradicts itself."""
    fixed = failed.level.fixed
    own = failed.residual[len(failed.residual) - len(fixed) :]
    held = _missed_most(failed)
    if not any(one.value is not None for one in failed.equations.constraints):
        return contradiction(fixed, own, _freedom(failed), _as_near_as_it_gets(failed), held)
    system, _, best = _misses_least(failed, [])
    if best is not None and best.size > tolerances.CLOSED:
        return _open_loop(failed, system, best)
    return contradiction(fixed, own, _freedom(failed), _what_stays_open(failed), held)


def _misses_least(
    failed: Failed, fixed: Sequence[Target], share: float = 1.0
) -> tuple[System, FloatArray, Nearest | None]:
    """Return the constraints with fixed values, what counts as one in each, and the place that misses least.

    What is fixed counts as missed by one where it is by a share of its unit: with a small one it all but holds.
    """
    system = System(failed.assembly, failed.equations, fixed, True)
    units = units_of_rows(failed.assembly, failed.equations, system, failed.length)
    units[system.constraints :] *= share
    return system, units, closest_of_all(system, units, failed.scales, failed.time, failed.nearest)


def _missed_most(failed: Failed) -> str:
    """Return the label of the constraint on positions that is missed most; empty if there is none."""
    labels = [one.label for one in failed.equations.constraints if one.value is not None]
    missed = np.abs(failed.residual[: len(labels)])
    return labels[int(np.argmax(missed))] if len(labels) and np.any(missed > 0.0) else ""


def _as_near_as_it_gets(failed: Failed) -> str:
    """Return, in words, the values of all that is fixed where they are met best."""
    fixed = failed.level.fixed
    _, units, best = _misses_least(failed, fixed)
    if best is None:
        return ""
    off = [
        f"{target.path} = {target.value + miss:.4g}"
        for target, miss, unit in zip(fixed, best.residual, units, strict=True)
        if abs(miss) > 1e-6 * unit
    ]
    more = "" if len(off) <= _SHOWN else ", ..."
    return f"; the nearest there is has {', '.join(off[:_SHOWN])}{more}" if off else ""


def _what_stays_open(failed: Failed) -> str:
    """Return, in words, how near loops come to closing while all that is fixed holds; empty where that says nothing."""
    fixed = failed.level.fixed
    if not fixed:
        return ""
    system, units, best = _misses_least(failed, fixed, _HELD)
    if best is None:
        return ""
    if np.any(np.abs(best.residual[system.constraints :]) > 1e-6 / _HELD * units[system.constraints :]):
        return ""
    worst = _largest(_closure_errors(failed, best.coordinates), failed.length)
    by = worst.describe(failed.length)
    ways = _other_ways_to_start(failed.assembly, worst.part)
    return f"; with {'it' if len(fixed) == 1 else 'them'}, {worst.part} stays open by {by} at least{ways}"


def _other_ways_to_start(assembly: Assembly, path: str) -> str:
    """Return, in words, in which other modes a part can start, such as a rope that is slack."""
    component = assembly.flat.parts[path].component
    others = [mode for mode in component.modes if mode != assembly.modes.get(path)]
    if not others or not component.mode_parameter:
        return ""
    return f" (it can also start {' or '.join(others)}: {component.mode_parameter}={others[0]!r})"


def _closure_errors(failed: Failed, q: FloatArray) -> list[ClosureError]:
    return find_closure_errors(failed.assembly, failed.equations, failed.time, q, failed.length)


def _largest(closure_errors: Sequence[ClosureError], length: float) -> ClosureError:
    return max(closure_errors, key=lambda closure_error: closure_error.size(length))


def _open_loop(failed: Failed, system: System, best: Nearest) -> StartError:
    """Return the error that names the loop that cannot close."""
    best = _in_one_joint(failed, system, best)
    closure_errors = _closure_errors(failed, best.coordinates)
    worst = _largest(closure_errors, failed.length)
    others = [
        one for one in closure_errors if one is not worst and one.size(failed.length) > 0.01 * worst.size(failed.length)
    ]
    loop = _loop_through(failed.assembly, worst.part)
    text = f"the loop cannot be closed here: the smallest closure error found is {worst.describe(failed.length)}"
    if others:
        text += f" (and by {', '.join(f'{one.describe(failed.length)} at {one.part}' for one in others[:4])})"
    if loop:
        text += f" (the loop of {', '.join(loop)})"
    lengths = _lengths_that_close(failed, system, best)
    advice = "Check the lengths of the loop, or guess a start nearer to a position in which it closes."
    if lengths:
        advice = f"It would about close with {' or '.join(lengths)}. {advice}"
    return StartError(text, where=worst.part, advice=advice)


def _in_one_joint(failed: Failed, system: System, best: Nearest) -> Nearest:
    """Return the place at which one joint misses least while all others close, if it can be had; else the one given.

    Among several joints the least sum of squares shares out what is missing, which is harder to read.
    """
    equations = failed.equations
    holding = [one for one in equations.constraints if one.value is not None]
    closure_errors = _closure_errors(failed, best.coordinates)
    worst = _largest(closure_errors, failed.length).part
    others = np.array([one.key[0] != worst for one in holding])
    if not np.any(others):
        return best
    units = units_of_rows(failed.assembly, equations, system, failed.length)
    try:
        found = closest(system, np.where(others, _HELD * units, units), failed.scales, failed.time, best.coordinates)
    except (KernelEvaluationError, np.linalg.LinAlgError):
        return best
    is_closed = np.all(np.abs(found.residual / units)[others] <= 1e-6 * max(best.size, tolerances.CLOSED))
    alone = float(np.linalg.norm((found.residual / units)[~others]))
    return Nearest(found.coordinates, found.residual, alone) if is_closed else best


def _lengths_that_close(failed: Failed, system: System, best: Nearest) -> list[str]:
    """Return, in words, the lengths whose change would take away what is missed, those that do most first."""
    assembly, shown = failed.assembly, 3
    units = units_of_rows(assembly, failed.equations, system, failed.length)
    program, values = system.program, assembly.parameter_values
    residual = best.residual / units
    found = []
    for j, symbol in enumerate(assembly.parameters):
        path, _, name = symbol.name.rpartition(".")
        if name in "xyz":
            path, _, name = path.rpartition(".")
        part = assembly.flat.parts.get(path)
        spec = None if part is None else part.component.parameter_specs().get(name)
        if spec is None or spec.unit.text != "m":
            continue
        h = 1e-6 * failed.length
        changed = values.copy()
        changed[j] += h
        after = assembly.compiled(program).bind(changed)(
            [failed.time], best.coordinates, np.zeros(len(failed.equations.speeds))
        )[0]
        derivative = float((np.asarray(after) / units - residual) @ residual) / (h * best.size)
        if abs(derivative) * failed.length > 0.3:
            found.append((abs(derivative), symbol.name, values[j], values[j] - best.size / derivative))
    found.sort(key=lambda one: -round(one[0] * failed.length, 6))  # in the order of declaration where they do alike
    good = [one for one in found if np.sign(one[2]) == np.sign(one[3])]
    return [f"{name} = {_unlike(new, old)} m (it is {_unlike(old, new)} m)" for _, name, old, new in good[:shown]]


def _unlike(one: float, other: float) -> str:
    """Return a number with as many digits as tell it from another one that is not zero, four at least."""
    alike = abs(other) / max(abs(one - other), 1e-15 * abs(other))
    return f"{one:.{max(4, 2 + int(np.ceil(np.log10(max(alike, 1.0)))))}g}"


def far_from_guess(failed: Failed, found: FloatArray, wrong: Sequence[str]) -> StartError:
    """Return the error that says that all fits only far from the guess."""
    equations, assembly, guessed = failed.equations, failed.assembly, failed.level.guessed
    off, _ = System(assembly, equations, guessed, False).at(failed.time, found, np.zeros_like(failed.scales))
    places = [f"{one.path} = {one.value + miss:.4g}" for one, miss in zip(guessed, off, strict=True)]
    elsewhere = f"guess near to {', '.join(places[:_SHOWN])}{', ...' if len(places) > _SHOWN else ''}."
    if wrong:
        return wrong_way_round(failed, wrong[0], f"It closes the right way elsewhere; {elsewhere}")
    closure_errors = _closure_errors(failed, failed.nearest)
    open_ones = [
        closure_error for closure_error in closure_errors if closure_error.size(failed.length) > tolerances.CLOSED
    ]
    if not open_ones:
        text, where = (
            "the fixed start values cannot be satisfied near the guess",
            (failed.level.fixed or guessed)[0].where,
        )
        return StartError(text, where=where, advice=f"It holds elsewhere; {elsewhere}")
    worst = _largest(open_ones, failed.length)
    by = worst.describe(failed.length)
    return StartError(
        f"the loop cannot be closed near the guess: the smallest closure error found there is {by}",
        where=worst.part,
        advice=f"It closes elsewhere; {elsewhere}",
    )


def wrong_way_round(failed: Failed, part: str, advice: str = "") -> StartError:
    """Return the error that says that a joint would have to be put in the wrong way round."""
    loop = _loop_through(failed.assembly, part)
    fixed = as_said(failed.level.fixed)
    return StartError(
        "the loop closes near the guess only with this joint the wrong way round: its two frames would be half a turn "
        "away from how it joins them" + (f" (the loop of {', '.join(loop)})" if loop else ""),
        where=part,
        advice=advice
        or "Turn its axis round, or the frame that it is fixed to, or guess a start in which it is the right way"
        + (f", or give up {' or '.join(fixed[:_SHOWN])}." if fixed else "."),
    )


def _loop_through(assembly: Assembly, part: str) -> list[str]:
    """Return the parts of the shortest loop through a joint, in order, with the bodies between them."""
    import networkx as nx

    graph, bodies = assembly.mechanism.graph, assembly.mechanism.bodies
    others: nx.Graph[int] = nx.Graph()
    ends: tuple[int, int] | None = None
    for joint in graph.joints:
        pair = (bodies.body_of[joint.a], bodies.body_of[joint.b])
        if joint.part == part:
            ends = pair
        elif not joint.is_rigid:
            others.add_edge(*pair, part=joint.part)
    if ends is None or not all(end in others for end in ends) or not nx.has_path(others, *ends):
        return []
    way = nx.shortest_path(others, *ends)
    found = [part]
    for here, there in pairwise(way):
        found += [*([bodies.bodies[here].name] if here else []), others.edges[here, there]["part"]]
    return [*found, *([bodies.bodies[way[-1]].name] if way[-1] else [])]


def _freedom(failed: Failed) -> int:
    return freedom_at(failed.assembly, failed.equations, failed.scales, failed.time, failed.nearest)


def freedom_at(assembly: Assembly, equations: Equations, scales: FloatArray, t: float, q: FloatArray) -> int:
    """Return how many speeds constraints leave free at a place."""
    if not equations.constraints:
        return len(scales)
    system = System(assembly, equations, [], True, of_speeds=True)
    matrix = scaled(system.at(t, q, np.zeros_like(scales))[1], scales)
    return len(scales) - len(independent_rows(matrix, system.errors.of_jacobian(t, q, scales)))


def contradicted(equations: Equations, residual: FloatArray) -> str:
    """Return the label of the constraint that is missed most; empty if there is none."""
    return equations.constraints[int(np.argmax(np.abs(residual)))].label if len(residual) else ""


def contradiction(
    fixed: Sequence[Target], residual: FloatArray, freedom: int, remark: str = "", held: str = ""
) -> StartError:
    """Return the error that says which fixed values cannot all hold."""
    if not fixed:
        return StartError(
            f"constraints contradict each other at the start{remark}",
            where=held,
            advice="Drives or lengths contradict the joints here; remove one of them.",
        )
    failing = [target for target, miss in zip(fixed, residual, strict=True) if not abs(miss) <= tolerances.MET]
    names = as_said(failing or fixed)
    count = f"The mechanism has {freedom} free coordinate{'s' if freedom != 1 else ''}"
    return StartError(
        f"the start values contradict each other or the constraints: {', '.join(names)} cannot all hold{remark}",
        where=(failing or fixed)[0].where,
        advice=f"{count if freedom else 'Nothing in the mechanism can move'}; "
        "fix fewer values, or give some as guesses (on the command line: --start PATH=free).",
    )
