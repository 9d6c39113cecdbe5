"""Shafts and slides: which joint's coordinate each part takes hold of.

A joint offers its coordinates as connectors. A part that is connected to one reads that coordinate as a function of the
joint's frames; where the coordinate is one of the mechanism's own, it takes its place (`mechanics.forces`).
"""

from __future__ import annotations

from collections.abc import Mapping

from atwood.errors import ConnectError, DeclarationError, UnsupportedError, suggestion
from atwood.late import dataclass
from atwood.model.declare.connectors import JointCoordinate
from atwood.model.local.flatten import FlatScene
from atwood.model.values.space import WHERE

__all__ = ["JointCoordinateUse", "find_joint_coordinate_uses"]


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
    """Return, for each part that takes hold of joints, what it takes hold of.

    Parameters
    ----------
    flat
        The scene.

    Raises
    ------
    ConnectError
        If such a part is connected to no joint, or joints are connected to each other.
    DeclarationError
        If a joint takes hold of joints itself, or offers a coordinate that it does not observe.
    UnsupportedError
        If the coordinate does not exist in the scene's space.
    """
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
        if not laws[coordinate].holds_in(flat.space):
            raise UnsupportedError(f"{WHERE[flat.space]} the joint {joint} has no {coordinate}", where=full)
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
