"""Operating points: the state about which a scene is looked at, from what is said of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np

from atwood.arguments import Kind, Refused
from atwood.arrays import FloatArray
from atwood.errors import ParameterError, StartError, UsageError, suggestion
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.lazy_dataclasses import dataclass, replace
from atwood.model.compose.composite import Model
from atwood.model.local.bound import variation_names
from atwood.model.local.flatten import FlatScene
from atwood.numerics.matrices import to_array
from atwood.numerics.rank import decompose, lost_rank
from atwood.pipeline import assemble, assemble_flat, scene_of
from atwood.result.result import Result
from atwood.simulation.contacts.chosen import has_contacts, in_set, refuse_border, set_at, state_in_set
from atwood.simulation.dynamics.balance import balance_of
from atwood.simulation.dynamics.orientation_coordinates import to_regular
from atwood.simulation.dynamics.redundancy import RankFinding
from atwood.simulation.initialization.start import find_start
from atwood.simulation.initialization.system import find_level
from atwood.theory.linear.variations import LinearScene

At = Mapping[str, Any] | tuple[Result, float] | None
"""Values by path; a result and a time; or the scene's own start."""


def _read_at(value: Any) -> Any:
    if value is None or isinstance(value, Mapping):
        return {} if value == {"rest": "yes"} else value
    if isinstance(value, tuple) and len(value) == 2 and isinstance(value[0], Result):
        return value[0], float(value[1])
    raise Refused


AT = Kind("values by path, or a result and a time", _read_at, "PATH=VALUE", is_many=True)

_SAME_TIME = 1e-12
"""Relative: times that differ by less are one."""


@dataclass(frozen=True)
class InputPath:
    """An input that varies.

    Attributes
    ----------
    path
        As it was named.
    unit
        Its unit.
    keys
        The inputs of parts that it feeds: (part, input).
    """

    path: str
    unit: str
    keys: tuple[tuple[str, str], ...]


@dataclass(frozen=True, eq=False)
class OperatingPoint:
    """A state of a scene with its equations.

    Attributes
    ----------
    assembly
        The scene; its start is the operating point.
    scene
        Its equations and their derivatives in generalized coordinates.
    t, q, u
        The state.
    finding
        Which constraints are independent.
    inputs
        What varies; the columns of each are three: by its value, its rate and its second derivative.
    is_from_result
        Whether it is a state of a motion, of which nothing says that it is steady.
    contacts
        State of each gap and slip in words, by path: the scene is that of this set.
    """

    assembly: Assembly
    scene: LinearScene
    t: float
    q: FloatArray
    u: FloatArray
    finding: RankFinding
    inputs: tuple[InputPath, ...]
    is_from_result: bool
    contacts: Mapping[str, str] = field(default_factory=dict)

    @property
    def kept(self) -> tuple[int, ...]:
        """Independent constraints."""
        return self.finding.kept


def find_operating_point(scene: Model | Assembly, at: At, inputs: Sequence[str]) -> OperatingPoint:
    """Find the state about which to look at a scene."""
    base = plain_assembly(scene)
    found = tuple(input_paths(base.flat, inputs))
    if isinstance(at, tuple):
        return _at_time(base, *at, found)
    assembly = _varied(base, found)
    if at is not None:
        assembly = start_at(assembly, at)
    start = find_start(assembly)
    state = start.time, start.coordinates, start.speeds
    return (
        _in_set(assembly, *state, start.length, found) if has_contacts(assembly) else point_at(assembly, *state, found)
    )


def plain_assembly(scene: Model | Assembly) -> Assembly:
    """Return a scene in generalized coordinates with quaternions."""
    if not isinstance(scene, Assembly):
        return assemble(scene)
    is_plain = scene.orientation.kind == "quaternion"
    if is_plain and scene.form == "reduced":
        return scene
    return assemble(scene_of(scene, "Give the scene itself."), name=scene.flat.name if is_plain else None)


def _in_set(
    assembly: Assembly,
    t: float,
    q: FloatArray,
    u: FloatArray,
    length: float,
    inputs: tuple[InputPath, ...],
    is_from_result: bool = False,
) -> OperatingPoint:
    """Return a state in the set of contacts that the scene is in there."""
    found = set_at(assembly, t, q, u, length, is_from_result)
    refuse_border(found)
    made = in_set(assembly, found.states)
    place, speeds = state_in_set(assembly, made, t, q, u, length)
    return point_at(made, t, place, speeds, inputs, is_from_result, found.words)


def point_at(
    assembly: Assembly,
    t: float,
    q: FloatArray,
    u: FloatArray,
    inputs: tuple[InputPath, ...] = (),
    is_from_result: bool = False,
    contacts: Mapping[str, str] | None = None,
) -> OperatingPoint:
    """Return a state of a scene as an operating point, in the set of contacts that the scene is of."""
    linear = _linear_scene(assembly, inputs)
    finding = linear.rank(t, q)
    _refuse_singular(linear, finding, t, q)
    return OperatingPoint(assembly, linear, t, q, u, finding, inputs, is_from_result, contacts or {})


def _at_time(base: Assembly, result: Result, time: float, inputs: tuple[InputPath, ...]) -> OperatingPoint:
    """Return the state of a result at one of its times, in the mode that the scene is in there."""
    if result.form != "reduced":
        raise UsageError(
            "linear models are in generalized coordinates, and this result is of the dae form",
            where=base.flat.name,
            advice="Give a result of the reduced form.",
        )
    for event in result.events:
        if abs(event.time - time) <= _SAME_TIME * max(abs(time), 1.0):
            raise UsageError(
                f"at t = {time:g} s is the event {event.part}.{event.law}, where the motion has no derivative",
                where=base.flat.name,
                advice="Look at a time beside it.",
            )
    for segment in result.run.segments:
        near = int(np.argmin(np.abs(segment.time - time)))
        if abs(segment.time[near] - time) <= _SAME_TIME * max(abs(time), 1.0):
            break
    else:
        nearest = float(result.time[np.argmin(np.abs(result.time - time))])
        raise UsageError(
            f"t = {time:g} s is no output of the result; the nearest is {nearest:.12g} s",
            where=base.flat.name,
            advice="Give `simulate` the time among its outputs.",
        )
    own, t = segment.assembly, float(segment.time[near])
    keys = frozenset(key for one in inputs for key in one.keys)
    flat = replace(own.flat, varied=keys, t_start=t)
    assembly = assemble_flat(flat, modes=own.modes, line_signs=own.mechanism.line_signs) if keys else own
    q, u = to_regular(own, segment.coordinates[:, near]), segment.speeds[:, near]
    if has_contacts(assembly):
        now = replace(assembly, held=own.held, given_relations=own.given_relations) if keys else own
        return _in_set(now, t, q, u, result.start.length, inputs, is_from_result=True)
    return point_at(assembly, t, q, u, inputs, is_from_result=True)


def moved_to(point: OperatingPoint, q: FloatArray, u: FloatArray) -> OperatingPoint:
    """Return another state of the same scene."""
    return replace(point, q=q, u=u, finding=point.scene.rank(point.t, q))


def _linear_scene(assembly: Assembly, inputs: Sequence[InputPath]) -> LinearScene:
    symbols = {symbol.name: symbol for symbol in assembly.mechanism.table.values}
    varied = [symbols[name] for one in inputs for key in one.keys for name in variation_names(".".join(key))]
    return LinearScene(assembly, "reduced", varied)


def _refuse_singular(linear: LinearScene, finding: RankFinding, t: float, q: FloatArray) -> None:
    """Refuse a position at which, or all but at which, constraints follow from the others and nowhere else."""
    constraints = linear.equations.constraints
    lost = list(finding.lost_at_start)
    if finding.kept and not lost:
        slopes = balance_of(linear.assembly, "reduced").constraints_at(t, q, np.zeros_like(linear.sizes)).jacobian
        rows = to_array(slopes)[list(finding.kept)] * linear.sizes
        largest: dict[tuple[str, str], float] = {}
        laws = [constraints[i].key[:2] for i in finding.kept]
        for law, row in zip(laws, rows, strict=True):  # components of one vector are measured by the largest of them
            largest[law] = max(largest.get(law, 1e-300), float(np.max(np.abs(row))))
        rows = rows / np.array([largest[law] for law in laws])[:, None]
        found = decompose(rows)
        if lost_rank(found.values, 1.0):
            lost = [finding.kept[int(np.argmax(np.abs(found.left[:, -1])))]]
    if lost:
        labels = [constraints[i].label for i in lost]
        raise StartError(
            f"this is a singular position: here {', '.join(labels)} all but follows from the other constraints, and "
            "nowhere else, so that no linear model tells the motions that begin here apart",
            where=linear.assembly.flat.name,
            advice="Look at a position beside it.",
        )


# -- inputs ----------------------------------------------------------------------------------------------------------


def input_paths(flat: FlatScene, paths: Sequence[str]) -> Iterator[InputPath]:
    """Yield what is meant by the paths of inputs: an input of a part, or the output of a source that feeds some."""
    own = {f"{path}.{name}": (path, name) for path, part in flat.parts.items() for name in part.signals}
    fed: dict[str, list[tuple[str, str]]] = {}
    for key, (source, name) in flat.links.items():
        fed.setdefault(f"{source}.{name}", []).append(key)
    for path in paths:
        keys = [own[path]] if path in own else fed.get(path)
        if keys is None:
            raise ParameterError(
                "there is no such input",
                where=path,
                advice=suggestion(path, [*own, *fed])
                or "Inputs are those of forces, motors and drives, and outputs that are connected to some.",
            )
        part, name = keys[0]
        unit = flat.parts[part].component.signal_specs()[name].unit.text
        yield InputPath(path, unit, tuple(keys))


_VARIED: Key[Assembly] = Key("the scene with variations of inputs")


def _varied(base: Assembly, inputs: Sequence[InputPath]) -> Assembly:
    """Return the scene with variations of inputs; made once for all scenes of a structure."""
    if not inputs:
        return base
    keys = frozenset(key for one in inputs for key in one.keys)

    def make() -> Assembly:
        made = assemble_flat(replace(base.flat, varied=keys), modes=base.modes)
        return replace(made, source=base.source)

    made = base.shared.get(_VARIED, make, keys)
    followed, _ = made.follow(replace(base.flat, varied=keys), base.source)
    return make() if followed is None else followed


# -- states ----------------------------------------------------------------------------------------------------------


def start_at(assembly: Assembly, at: Mapping[str, Any]) -> Assembly:
    """Return a scene that starts at given values; its own start positions are guesses for what is not given."""
    flat, levels = assembly.flat, {}
    for path in flat.start:
        levels[path] = find_level(assembly, assembly.regular, path) if path in assembly.start_observables else 0
    together = _said_together(assembly, levels, at)
    start: dict[str, Any] = {path: None for path in flat.start if path not in at and path not in together}
    start |= dict(at)
    guess = {path: value for path, value in flat.start.items() if path in start and path not in at and not levels[path]}
    speeds = [
        path
        for path in flat.guess
        if path in assembly.start_observables and find_level(assembly, assembly.regular, path)
    ]
    dropped = {path: None for path in flat.guess if path in at or path in speeds}
    return assembly.with_values(start=start, guess={**guess, **dropped})


def _said_together(assembly: Assembly, levels: Mapping[str, int], at: Mapping[str, Any]) -> set[str]:
    """Return start positions that parts restate together with others, such as Euler angles: they stay as they are."""
    found: set[str] = set()
    for part, one in assembly.flat.parts.items():
        own = {p.rpartition(".")[2]: v for p, v in assembly.flat.start.items() if p.rpartition(".")[0] == part}
        if own and one.component.restate_start(own, assembly.mechanism.space.name) != own:
            found |= {f"{part}.{name}" for name in own if not levels[f"{part}.{name}"]}
    return found - set(at)


def speed_name(point: OperatingPoint, number: int) -> str:
    """Return the path of a speed where some quantity of its joint is it, else its own name."""
    e = point.scene.equations
    symbol, name = e.speeds[number], e.speed_names[number].name
    part = name.rstrip("'").rpartition(".")[0]
    observables = point.assembly.start_observables
    for path in (f"{part}.{last}" for last in _SPEEDS):
        if path in observables and observables[path].value is symbol:
            return path
    return name


_SPEEDS = ("angular_velocity", "speed", "velocity.x", "velocity.y", "velocity.z", "velocity")


def values_at(point: OperatingPoint) -> dict[str, float]:
    """Return the coordinates and speeds of a state that have one number each, by path."""
    e = point.scene.equations
    charted = {i for orientation in e.orientation_coordinates for i in orientation.coordinates}
    found = {one.name: float(q) for i, (one, q) in enumerate(zip(e.names, point.q, strict=True)) if i not in charted}
    return found | {speed_name(point, k): float(u) for k, u in enumerate(point.u)}
