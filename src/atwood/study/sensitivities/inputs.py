"""Inputs of parts as values at nodes of time, and what a run is differentiated by them.

Between two nodes an input is linear, or is held. So a change of the value at one node changes the input by a hat, or
by a value for a while (J. T. Betts, Practical Methods for Optimal Control, 2nd ed., 2010). A run stops at each node.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from atwood.arguments import BY_PATH, PATHS, either
from atwood.arrays import FloatArray
from atwood.errors import UsageError, suggestion
from atwood.expr import depends_on
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import Model
from atwood.model.declare.component import Component
from atwood.model.declare.field_functions import discrete_state, parameter
from atwood.model.declare.laws import observable, update
from atwood.model.values.units import parse_quantity
from atwood.pipeline import assembly_of, scene_of
from atwood.study.sensitivities.columns import Column

LINEAR, HELD = "linear", "held"
INPUTS = either(BY_PATH, PATHS)


def _number_at(times: Sequence[float], t: float) -> int:
    """Return the piece at a time; at its very beginning, the one that begins."""
    number = int(np.searchsorted(times, t + 32.0 * float(np.spacing(abs(t))), side="right"))
    return max(number, 1) - 1


def _piece_at(known: Mapping[str, Any], t: float) -> tuple[float, float, float]:
    """Return where a piece begins, the value there, and the slope."""
    times, values = zip(*known["rows"], strict=True)
    k = _number_at(times, t)
    is_last = k + 1 == len(times) or known["between"] == HELD
    return times[k], values[k], 0.0 if is_last else (values[k + 1] - values[k]) / (times[k + 1] - times[k])


class InputNodes(Component):
    """An input by its values at nodes."""

    rows: Any = parameter(((0.0, 0.0),), array=True, doc="Times and values.")
    between: str = parameter(LINEAR, choices=(LINEAR, HELD), doc="What it is between two nodes.")
    piece: Any = discrete_state(
        _piece_at, unit="any", count=lambda known: 3, doc="Where the present piece begins, its value, its slope."
    )

    def nodes(self) -> list[float]:
        """Return the times of the nodes."""
        return [row[0] for row in self.rows]

    @update(sets=("piece",), when="nodes", reads=(), pure=True)
    def enter(self) -> Sequence[float]:
        """Return the piece that begins now."""
        return _piece_at({"rows": self.rows, "between": self.between}, float(self.time))

    @observable(unit="any", doc="Value, in the unit of the input.")
    def value(self) -> Any:
        """Return the value."""
        begin, value, slope = self.piece
        return value + slope * (self.time - begin)


@dataclass(frozen=True)
class Driven:
    """An input that is given by nodes.

    Attributes
    ----------
    path, part, unit
        Of the input, of what drives it, and the unit of both.
    times, values
        The nodes.
    between
        What it is between two of them.
    is_constant
        Whether it is one number for the whole run.
    """

    path: str
    part: str
    unit: str
    times: tuple[float, ...]
    values: tuple[float, ...]
    between: str
    is_constant: bool

    def hats(self, t: float) -> FloatArray:
        """Return the change of the state of the piece at a time with the value of each node, shape (nodes, 3)."""
        found, k = np.zeros((len(self.times), 3)), _number_at(self.times, t)
        found[k, 1] = 1.0
        if self.between == LINEAR and k + 1 < len(self.times):
            inverse = 1.0 / (self.times[k + 1] - self.times[k])
            found[k, 2], found[k + 1, 2] = -inverse, inverse
        return found

    def columns(self) -> list[NodeColumn]:
        """Return one for each node."""
        size = max(map(abs, self.values)) or 1.0
        return [
            NodeColumn(self.name(k), self.unit, True, value, size, _refuse, frozenset(), True, self, k)
            for k, value in enumerate(self.values)
        ]

    def name(self, node: int) -> str:
        """Return what the value at a node is called."""
        return self.path if self.is_constant else f"{self.path}[{node}]"


def _refuse(share: float) -> Assembly:
    raise NotImplementedError  # its changes are known


@dataclass(frozen=True, eq=False)
class NodeColumn(Column):
    """The value of an input at a node.

    Attributes
    ----------
    driven, node
        The input, and which of its nodes it is.
    """

    driven: Driven
    node: int

    def pieces(self, assembly: Assembly, t: float) -> FloatArray:
        """Return the change of each discrete state where a piece begins, times its scale."""
        number = {one.path: i for i, one in enumerate(assembly.discrete_states)}
        found = np.zeros(len(number))
        places = [number[f"{self.driven.part}.piece[{i}]"] for i in range(3)]
        found[places] = self.scale * self.driven.hats(t)[self.node]
        return found


def is_nodes(assembly: Assembly, part: str) -> bool:
    """Return whether a part gives an input by nodes."""
    return isinstance(assembly.flat.parts[part].component, InputNodes)


def with_inputs(
    assembly: Assembly, inputs: Mapping[str, Any] | Iterable[str], between: str, t_end: float
) -> tuple[Assembly, tuple[Driven, ...]]:
    """Return a scene whose inputs are given by nodes, and these.

    Parameters
    ----------
    assembly
        The scene.
    inputs
        By the path of an input, its value, or rows of time and value; or paths alone, with the numbers that they have.
    between
        ``"linear"`` or ``"held"``.
    t_end
        When the run ends.
    """
    given = dict(inputs) if isinstance(inputs, Mapping) else dict.fromkeys(inputs)
    if not given:
        return assembly, ()
    scene = scene_of(assembly).copy()
    found = []
    for number, (path, nodes) in enumerate(given.items()):
        owner, name, unit = _input_at(scene, path)
        rows = _rows(owner, path, name, nodes, assembly.flat.t_start, t_end, unit)
        part = _free_name(scene, f"input_{number}")
        made = scene.add(part, InputNodes(rows=rows, between=between if len(rows) > 1 else HELD))
        scene.connect(made.output("value"), owner.input(name))
        times, values = zip(*rows, strict=True)
        found.append(Driven(path, part, unit, times, values, made.between, not isinstance(nodes, Iterable)))
    asked = {"form": assembly.form, "name": assembly.flat.name}
    driven = assembly_of(scene, **asked)
    _refuse_motions(driven, found)
    return driven, tuple(found)


def _free_name(scene: Model, name: str) -> str:
    while name in scene.parts:
        name += "_"
    return name


def _input_at(scene: Model, path: str) -> tuple[Component, str, str]:
    """Return the part that has an input, the name of this, and its unit; refuse what is none, or is connected."""
    where, _, name = path.rpartition(".")
    if where not in scene:
        raise UsageError(
            "there is no such part", where=path, advice="Give the path of an input, as 'push.value' is one."
        )
    owner: Component = scene[where]
    known = type(owner).signal_specs()
    if name not in known:
        advice = suggestion(name, known) if known else "Its parameters are differentiated by with parameters=."
        raise UsageError("it is no input", where=path, advice=advice)
    inner = owner._parent
    while isinstance(inner, Model):
        prefix = f"{inner.path}." if inner.path else ""
        if any(path == prefix + end for pair in inner.connected for end in pair):
            raise UsageError(
                "it is connected to an output",
                where=path,
                advice="Leave that connection out, or ask for derivatives by parameters of what drives it.",
            )
        inner = inner._parent
    return owner, name, known[name].unit.text


def _rows(
    owner: Component, path: str, name: str, nodes: Any, begin: float, end: float, unit: str
) -> tuple[tuple[float, float], ...]:
    """Return the times and values of an input; refuse what does not cover a run."""
    value = owner._value(name) if nodes is None else nodes
    if isinstance(value, str):
        value = parse_quantity(value, type(owner).signal_specs()[name].unit, path)
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        value = [(begin, value)]
    advice = "Give a number, or rows of time and value such as [(0.0, 1.0), (0.5, -1.0)]."
    if callable(value) or isinstance(value, bool):
        raise UsageError("it is a function of time, which has no values to change", where=path, advice=advice)
    try:
        rows = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise UsageError("its nodes are no numbers", where=path, advice=advice) from None
    if rows.ndim != 2 or rows.shape[1] != 2 or not len(rows) or not np.all(np.isfinite(rows)):
        raise UsageError(f"its nodes are no finite numbers in rows of two, {rows.shape}", where=path, advice=advice)
    if np.any(np.diff(rows[:, 0]) <= 0.0):
        raise UsageError("the times of its nodes do not rise", where=path, advice="Sort them; each stands there once.")
    room = 1e-12 * max(abs(begin), abs(end))
    if rows[0, 0] > begin + room or (len(rows) > 1 and rows[-1, 0] < end - room):
        raise UsageError(
            f"its nodes go from {rows[0, 0]:g} s to {rows[-1, 0]:g} s, and the run from {begin:g} s to {end:g} s",
            where=path,
            advice="Let the nodes cover the run.",
        )
    return tuple((float(t), float(x)) for t, x in rows)


def _refuse_motions(assembly: Assembly, found: Sequence[Driven]) -> None:
    """Refuse inputs that prescribe a motion."""
    held = {one.path: one.symbol for one in assembly.discrete_states}
    moved = assembly.own_equations.kinematics
    places = [v for some in (moved.velocities, moved.angular_velocities) for one in some.values() for v in one]
    for one in found:
        symbols = [held[f"{one.part}.piece[{i}]"] for i in range(3) if f"{one.part}.piece[{i}]" in held]
        if depends_on(places, symbols):
            raise UsageError(
                "it prescribes a motion, which has no corners",
                where=one.path,
                advice="Derivatives are by inputs that are forces, torques or set points of controllers.",
            )
