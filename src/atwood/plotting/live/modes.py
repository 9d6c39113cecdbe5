"""The modes that a scene can get into, each with programs of its own, and how a state passes from one to another."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError
from atwood.forms.assembly import Assembly
from atwood.mechanics.constraints.knots import BALANCES
from atwood.mechanics.outputs.event_functions import CONTACT, UPDATE
from atwood.pipeline import simulate
from atwood.plotting.live.mode import ModeText, NotLiveError, bodies_of, nodes_of, plan_of
from atwood.plotting.live.start import add_tangent
from atwood.simulation.dynamics.kinematic_map import reference_coordinates
from atwood.simulation.dynamics.reactions import maximal_state
from atwood.simulation.dynamics.scales import motion_scales
from atwood.simulation.events.impacts_in_time import switching
from atwood.simulation.events.mode_change import maximal_places, refusing
from atwood.simulation.events.sides import SIDE
from atwood.simulation.initialization.start import Start, actual_line_signs, find_start, settle
from atwood.simulation.problem.problem import SceneProblem

_MOST = 16
"""So many modes are prepared; what leads to another one ends the motion of a page."""

Modes = tuple[tuple[str, str], ...]


def add_modes(first: ModeText, given: Assembly, start: Start, quantities: Sequence[str] | None) -> list[ModeText]:
    """Return the modes that events lead to, the first among them, with what passes a state between them."""
    found = {_key(first.assembly.modes): first}
    waiting = [first]
    met: dict[Modes, tuple[SceneProblem, FloatArray]] | None = None
    while waiting and len(found) < _MOST:
        for modes in _ahead(waiting.pop(0)):
            if _key(modes) in found or len(found) >= _MOST:
                continue
            met = _met(given, start.length) if met is None else met
            state = met.get(_key(modes)) or _started(first, given, start, modes)
            if state is None or not len(state[1]):  # nothing is free to move there
                continue
            made = found[_key(modes)] = ModeText(*state, quantities)
            if bodies_of(made) != bodies_of(first):
                raise NotLiveError("its parts make other bodies in other modes, which pages do not draw")
            waiting.append(made)
    every = list(found.values())
    for one in every:
        switches = switching(one.assembly)
        if any(
            constraint.key[0] in switches and constraint.key[1] in BALANCES for constraint in one.equations.constraints
        ):
            raise NotLiveError(f"{switches[0]} jumps where forces on it balance, which pages do not follow")
        if one is not first:
            add_tangent(one)
        if switches or len(every) > 1:
            _add_passage(one, start.length)
            one.data["passage"]["switches"] = bool(switches)
    return every


def _key(modes: Mapping[str, str]) -> Modes:
    return tuple(sorted(modes.items()))


def _ahead(mode: ModeText) -> Iterator[dict[str, str]]:
    """Yield the modes that events of a mode lead to."""
    for one in mode.data["events"]:
        if one["target"] not in ("", "stop", UPDATE, SIDE, *CONTACT):
            yield {**mode.assembly.modes, one["part"]: one["target"]}


def _met(assembly: Assembly, length: float) -> dict[Modes, tuple[SceneProblem, FloatArray]]:
    """Return the modes that a run of the scene gets into, each with a state there."""
    try:
        segments = simulate(assembly).run.segments
    except AtwoodError as error:
        segments = getattr(getattr(error, "run", None), "segments", ())
    found: dict[Modes, tuple[SceneProblem, FloatArray]] = {}
    for one in segments:
        key, (t, q, u) = _key(one.assembly.modes), (float(one.time[0]), one.coordinates[:, 0], one.speeds[:, 0])
        if key not in found and len(q):
            found[key] = plan_of(one.assembly, t, q, u, length), np.concatenate([q, u])
    return found


def _started(
    first: ModeText, assembly: Assembly, start: Start, modes: Mapping[str, str]
) -> tuple[SceneProblem, FloatArray] | None:
    """Return a state of a mode in which no run has been: the start that the scene would have in it."""
    q, u = first.plan.program.split(np.array(first.data["state"]))
    signs = actual_line_signs(assembly, start.time, q, u, assembly.form)
    try:
        after = assembly.other_mode(modes, signs)
        after, q, u = settle(after, find_start(after), after.other_mode)
        plan = plan_of(after, start.time, q, u, start.length)
    except AtwoodError:
        return None
    return plan, np.concatenate([q, u])


def _add_passage(mode: ModeText, length: float) -> None:
    """Add what takes a state into a mode through maximal coordinates, and velocities through an impact there."""
    assembly, equations = mode.assembly, mode.assembly.own_equations
    maximal, t = assembly.maximal, mode.flat.t_start
    data: dict[str, Any] = {"sizes": motion_scales(maximal, length).tolist()}
    data["reference"] = reference_coordinates(equations).tolist()
    data["turned"] = []
    if assembly.form == "reduced":
        mode.programs["maximal"], rows, columns = maximal_places(assembly)
        data["slopes"] = [list(rows), list(columns)]
        bodies = {one.body: list(one.coordinates) for one in maximal.orientation_coordinates}
        for one in equations.orientation_coordinates:
            data["turned"] += zip(one.coordinates, bodies.get(one.body, ()), strict=False)
    data["counts"] = [len(maximal.coordinates), len(maximal.speeds)]
    data["turns"] = [list(one.coordinates) for one in maximal.orientation_coordinates]
    data["spins"] = [list(one.speeds) for one in maximal.orientation_coordinates]
    speeds = {symbol: j for j, symbol in enumerate(maximal.speeds)}
    data["along"] = [(i, speeds[rate]) for i, rate in enumerate(maximal.rates) if rate in speeds]
    balance = assembly.balance("dae")
    mode.programs["impact"] = balance.program
    data["mass"] = [balance.mass_rows.tolist(), balance.mass_columns.tolist()]
    data["slopes_of_constraints"] = [balance.jacobian_rows.tolist(), balance.jacobian_columns.tolist()]
    q, u = mode.plan.program.split(np.array(mode.data["state"]))
    big_q, big_u = (one[:, 0] for one in maximal_state(assembly, np.array([t]), q[:, None], u[:, None]))
    state = t, big_q, big_u
    refused = [
        [(one.sign * sign, refusing(assembly, one, state, sign)) for sign in (1.0, -1.0)] for one in maximal.constraints
    ]
    names = ("part", "law", "message", "target")
    data["refused"] = [
        [(sign, {name: getattr(by, name) for name in names}) for sign, by in each if by is not None] for each in refused
    ]
    data["labels"] = [one.label for one in maximal.constraints]
    data["laws"] = [one.key[:2] for one in maximal.constraints]
    data["signs"] = list(_signs(mode))
    mode.data["passage"] = data


def _signs(mode: ModeText) -> Iterator[tuple[int, int, float]]:
    """Yield pairs of nodes on a line, by their places, and on which side of the first the second is taken to be."""
    order = {node: i for i, node in enumerate(nodes_of(mode))}
    node_of = mode.assembly.mechanism.graph.node_of
    for path, local in mode.assembly.mechanism.locals_.items():
        for (a, b), sign in (local.binding.line_signs or {}).items():
            yield order[node_of[path, a]], order[node_of[path, b]], sign
