"""Joint coordinates as functions of the joint's frames, and parts that take hold of them by shafts and slides.

A joint offers its coordinates as connectors. A part that is connected to one reads that coordinate as a function of the
joint's frames; where the coordinate is one of the mechanism's own, it takes its place (`mechanics.forces`).
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

from atwood.errors import ConnectError, DeclarationError, UnsupportedError, suggestion
from atwood.expr import Expression, Graph, live, tan
from atwood.lazy_dataclasses import dataclass
from atwood.model.declare.component import bind
from atwood.model.declare.connectors import JointCoordinate
from atwood.model.declare.law_results import call_law
from atwood.model.declare.laws import ConstraintOptions, Law
from atwood.model.local.flatten import FlatScene, Part
from atwood.model.local.parts import LocalConnector, LocalConstraint, LocalPart
from atwood.model.values.space import WHERE

Formulas = Mapping[Expression, tuple[Expression, Expression | None]]
"""For symbols of joint coordinates: the coordinate and its rate as functions of the joint's frames."""


@dataclass(frozen=True)
class JointReference:
    """A joint's coordinate that a part takes hold of.

    Attributes
    ----------
    connector
        The connector of the part.
    symbol
        The symbol of the coordinate.
    value, rate
        The coordinate and its rate as functions of the joint's frames.
    connectors
        The joint's connectors by their full paths.
    borrowed
        For these paths: the joint and the name of the connector.
    """

    connector: str
    symbol: Expression
    value: Expression
    rate: Expression | None
    connectors: Mapping[str, LocalConnector]
    borrowed: Mapping[str, tuple[str, str]]


def find_joint_references(taken: Sequence[tuple[JointCoordinateUse, LocalPart]], graph: Graph) -> list[JointReference]:
    """Return what a part takes hold of."""
    found = []
    for used, joint in taken:
        symbol = graph.symbol(f"{used.joint}.{used.coordinate}")
        if not any(symbol in one.coordinates for one in joint.joints):
            raise DeclarationError(f"it offers {used.coordinate!r}, which is no coordinate of it", where=used.joint)
        bound = bind(joint.part.component, joint.binding)
        value, rate = formulas_of(joint.part, bound, [symbol], graph)[symbol]
        connectors = {f"{used.joint}.{name}": one for name, one in joint.connectors.items()}
        borrowed = {f"{used.joint}.{name}": (used.joint, name) for name in joint.connectors}
        found.append(JointReference(used.connector, symbol, value, rate, connectors, borrowed))
    return found


def formulas_of(part: Part, bound: Any, symbols: Sequence[Expression], graph: Graph) -> Formulas:
    """Return what coordinates of a joint, and their rates, are in terms of its connectors."""
    laws = {law.name: law for law in part.component.laws("observable")}

    def formula(name: str) -> Expression:
        value: Expression = call_law(part.path, laws[name], lambda: graph.convert(getattr(bound, name)()))
        return value

    found = {}
    for symbol in symbols:
        name = symbol.name.rpartition(".")[2]
        if name in laws and laws[name].holds_in(bound._binding().space):
            rate = laws[name].options.rate
            found[symbol] = formula(name), formula(rate) if rate in laws else None
    return found


def turns_read(part: Part, formulas: Formulas, functions: Sequence[Expression]) -> tuple[Expression, ...]:
    """Return those of a joint's coordinates whose turns count for what the joint does or passes on."""
    periodic = {f"{part.path}.{law.name}" for law in part.component.laws("observable") if law.options.periodic}
    turning = {symbol: formula for symbol, (formula, _) in formulas.items() if symbol.name in periodic}
    if not turning or part.component.laws("event"):
        return tuple(turning)
    read = {node.index for node in live(functions)}
    return tuple(symbol for symbol, formula in turning.items() if formula.index in read)


def counting_constraints(
    part: Part, counted: Collection[str], formulas: Formulas, graph: Graph
) -> Iterator[LocalConstraint]:
    """Yield constraints that tie joint coordinates, which count turns, to orientations, which do not.

    They hold where nothing hangs on the joint. ``2 tan((phi - formula)/2)`` has slope one at each of its zeros, which
    are whole turns apart, and no jump where the formula has one.
    """
    for law in part.component.laws("observable"):
        symbol = graph.symbol(f"{part.path}.{law.name}") if law.name in counted else None
        if symbol is None or symbol not in formulas or not law.options.periodic:
            continue
        doc = "Torque that gears pass on to the frames of the joint."
        options = ConstraintOptions((law.name,), "N*m", 1.0, doc, (), ("space",))
        value = 2.0 * tan(0.5 * (symbol - formulas[symbol][0]))
        counting = Law("constraint", f"count_{law.name}", options)
        yield LocalConstraint(counting, 0, graph.convert(value), law.name, 1.0, symbol)


@dataclass(frozen=True)
class JointCoordinateUse:
    """A joint's coordinate that a part takes hold of.

    Attributes
    ----------
    connector
        The connector of the part.
    joint
        Path of the joint.
    coordinate
        Name of its coordinate.
    """

    connector: str
    joint: str
    coordinate: str


def find_joint_coordinate_uses(flat: FlatScene) -> dict[str, tuple[JointCoordinateUse, ...]]:
    """Return, for each part that takes hold of joints, what it takes hold of."""
    offered: dict[str, tuple[str, str]] = {}
    wanted: dict[str, tuple[str, str]] = {}
    for path, part in flat.parts.items():
        for spec in part.component.connector_specs().values():
            if issubclass(spec.kind, JointCoordinate):
                for name in spec.names(part.component):
                    (offered if spec.of else wanted)[f"{path}.{name}"] = (path, spec.of or name)
    if not offered and not wanted:
        return {}
    beside: dict[str, list[str]] = {}
    for a, b in flat.connections:
        beside.setdefault(a, []).append(b)
        beside.setdefault(b, []).append(a)
    found: dict[str, list[JointCoordinateUse]] = {path: [] for path, _ in wanted.values()}
    for full, (path, name) in wanted.items():
        joint, coordinate = _joint_at(full, beside, offered)
        laws = {law.name: law for law in flat.parts[joint].component.laws("observable")}
        if coordinate not in laws:
            raise DeclarationError(
                f"it offers its coordinate {coordinate!r}, which is none of its observables",
                where=joint,
                advice=suggestion(coordinate, laws) or f"Give it an @observable of the name {coordinate!r}.",
            )
        if not laws[coordinate].holds_in(flat.space.name):
            raise UnsupportedError(f"{WHERE[flat.space.name]} the joint {joint} has no {coordinate}", where=full)
        if joint in found:
            raise DeclarationError("a part that takes hold of joints cannot be one", where=joint)
        found[path].append(JointCoordinateUse(name, joint, coordinate))
    for full in offered:
        _joint_at(full, beside, offered)
    return {path: tuple(used) for path, used in found.items()}


def _joint_at(full: str, beside: Mapping[str, list[str]], offered: Mapping[str, tuple[str, str]]) -> tuple[str, str]:
    """Return the joint, and the name of its coordinate, that a connector is connected to."""
    met = {full: None}
    waiting = [full]
    for one in waiting:  # grows while it is walked
        new = [other for other in beside.get(one, ()) if other not in met]
        met.update(dict.fromkeys(new))
        waiting += new
    joints = [one for one in met if one in offered]
    if len(joints) > 1:
        raise ConnectError(
            f"the joints {offered[joints[0]][0]} and {offered[joints[1]][0]} are connected to each other by it",
            where=joints[0],
            advice="Put a gear with ratio 1 between them.",
        )
    if not joints:
        raise ConnectError(
            "it is connected to no joint",
            where=full,
            advice="Connect it to one that a joint offers, like hinge.shaft; between a gear and a spring that may be a "
            "joint without inertia.",
        )
    return offered[joints[0]]
