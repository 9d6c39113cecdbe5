"""On a line: which of two points starts further along, so that lengths can be signed once and for all."""

from __future__ import annotations

from collections.abc import Mapping

from atwood.expr import Expression, evaluate
from atwood.model.local.flatten import FlatScene
from atwood.model.local.parts import LocalPart
from atwood.model.values.space import Space
from atwood.model.values.vector import Vector, dot
from atwood.topology.bodies import Bodies
from atwood.topology.graph import MechanismGraph


def find_line_signs(
    flat: FlatScene,
    mechanism: MechanismGraph,
    bodies: Bodies,
    locals_: Mapping[str, LocalPart],
    offsets: Mapping[int, Mapping[int, Vector]],
    parameters: Mapping[Expression, float],
    space: Space,
) -> dict[tuple[str, str, str], float]:
    """Return, for pairs of connectors of each part, the sign of the second's start position minus the first's."""
    assert space.line is not None
    places = {node: _number(offset, space.line, parameters) for node, offset in offsets[0].items()}
    for path, value in {**flat.guess, **flat.start}.items():
        _note(path, value, mechanism, bodies, locals_, offsets, parameters, space.line, places)
    found: dict[tuple[str, str, str], float] = {}
    for path, local in locals_.items():
        names = list(local.connectors)
        for a in names:
            for b in names:
                p, q = (places.get(mechanism.node_of[(path, name)]) for name in (a, b))
                if p is not None and q is not None and p != q:
                    found[path, a, b] = 1.0 if q > p else -1.0
    return found


def _number(vector: Vector, line: Vector, parameters: Mapping[Expression, float]) -> float:
    along = dot(vector, line)
    return evaluate([along], parameters)[0] if isinstance(along, Expression) else float(along)


def _note(
    path: str,
    value: float,
    mechanism: MechanismGraph,
    bodies: Bodies,
    locals_: Mapping[str, LocalPart],
    offsets: Mapping[int, Mapping[int, Vector]],
    parameters: Mapping[Expression, float],
    line: Vector,
    places: dict[int, float],
) -> None:
    """Take up a start value that says where the first connector of a part is, and with it the rest of its body."""
    for quantity, component in (("position.x", line.x), ("position.y", line.y), ("position.z", line.z)):
        owner, matched, _ = path.rpartition(f".{quantity}")
        if matched and owner in locals_ and component != 0.0:
            place = value / component
            break
    else:
        owner, matched, _ = path.rpartition(".displacement")
        if not matched or owner not in locals_:
            return
        place = value
    local = locals_[owner]
    if not local.connectors:
        return
    node = mechanism.node_of[(owner, next(iter(local.connectors)))]
    body = bodies.body_of[node]
    for other, offset in offsets[body].items():
        places.setdefault(other, place + _number(offset - offsets[body][node], line, parameters))
