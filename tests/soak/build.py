"""Atwood's scene of a described mechanism."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

import atwood_library as lib
from atwood import Component, Scene, select, sin

from .description import Array, Body, Mechanism, Mount, Signal, Tie, axis_and_angle, rotation
from .oracle_own import GAPS
from .oracle_parts import GEARS
from .own_parts import OWN
from .trial import Discarded

POINTS = {
    "spring": ("a", "b"),
    "damper": ("a", "b"),
    "rod": ("a", "b"),
    "drag": ("point",),
    "point_on_line": ("b",),
    "point_on_plane": ("b",),
    "point_on_circle": ("b",),
    "own_spring": ("a", "b"),
    "own_swirl": ("a", "b"),
    "own_surface": ("b",),
    "own_wire": ("b",),
}
"""Connectors that are points, which a material point can be joined to."""


def class_of(sort: str) -> type[Component]:
    """Return the part of the library, or of a user."""
    name = "".join(word.capitalize() for word in sort.split("_"))
    found: type[Component] = OWN[sort] if sort in OWN else getattr(lib, name)
    return found


def connectors(tie: Tie) -> tuple[str, ...]:
    """Return the connectors of a part in the order of the tie's mounts."""
    if tie.sort in ("drag", "own_leak"):
        return ("point",)
    if tie.sort == "force":
        return {"world": ("point",), "body": ("frame",), "other": ("point", "other")}[tie.values["resolved_in"]]
    if tie.sort == "torque":
        return ("frame", "other")[: len(tie.mounts)]
    if tie.sort == "central_gravity":
        return ("source", "frame" if tie.values["attracts"] == "body" else "point")
    return ("a", "b")


def build_scene(mechanism: Mechanism, start: str = "all") -> Scene:
    """Return the scene.

    Parameters
    ----------
    mechanism
        What to build.
    start
        ``"all"``: places and speeds of all bodies are said exactly. ``"guess"``: places are guessed, and speeds are not
        said.
    """
    scene = Scene(space=mechanism.space, gravity=mechanism.gravity, line_axis=tuple(mechanism.line))
    for body in mechanism.bodies:
        scene.add(body.name, _part_of(body))
    for tie in sorted(mechanism.ties, key=lambda tie: bool(tie.grips)):  # what takes hold of a joint needs it there
        _add_tie(scene, mechanism, tie)
    for body in mechanism.bodies:
        places, speeds = start_values(mechanism, body)
        (scene.guess if start == "guess" else scene.start).update(places)
        if start != "guess":
            scene.start.update(speeds)
    return scene


LOCKS = ("slider", "weld", "drive", "rotary_drive")
"""What says for certain by how much the angles of two bodies in a plane differ."""


def plane_angles(mechanism: Mechanism) -> dict[str, float]:
    """Return the angle of each body in a plane, counter-clockwise, with turns that fit those of the joints it hangs on.

    In a plane angles are absolute and count turns: along a joint, the angle of a body is that of the other one, plus
    what welds and the joint turn, which are within half a turn each. Around a loop hinges alone may be a turn off.
    """
    if mechanism.angles is not None:
        return mechanism.angles
    between = [tie for tie in mechanism.ties if len(tie.mounts) == 2]
    found = {"": 0.0}
    _spread(mechanism, [tie for tie in between if tie.sort in LOCKS], found)
    for body in mechanism.bodies:
        if body.name in found:
            continue
        hung = [tie for tie in between if tie.sort == "pivot" and tie.mounts[1].body == body.name][:1]
        known = [found[tie.mounts[0].body] + _apart(mechanism, tie) for tie in hung if tie.mounts[0].body in found]
        found[body.name] = known[0] if known else _counter_clockwise(body.rotation)
        _spread(mechanism, [tie for tie in between if tie.sort in LOCKS], found)
    for tie in between:
        a, b = (found[mount.body] for mount in tie.mounts)
        if tie.sort == "pivot" and tie.values.get("stiffness") and abs(b - a - _apart(mechanism, tie)) > 1.0:
            raise Discarded("a spring on a hinge that is a turn off")
    return found


def _spread(mechanism: Mechanism, locks: list[Tie], found: dict[str, float]) -> None:
    """Add the angles of all bodies that locks join to those that are found."""
    going = True
    while going:
        going = False
        for tie in locks:
            a, b = (mount.body for mount in tie.mounts)
            if (a in found) != (b in found):
                going, apart = True, _apart(mechanism, tie)
                found.update({b: found[a] + apart} if a in found else {a: found[b] - apart})


def _apart(mechanism: Mechanism, tie: Tie) -> float:
    """Return by how much the angle of the second body of a joint is larger, with welds and joint within half a turn."""
    a, b = tie.mounts
    joint = _counter_clockwise(mechanism.turned(a).T @ mechanism.turned(b))
    return _counter_clockwise(a.rotation) + joint - _counter_clockwise(b.rotation)


def _counter_clockwise(matrix: Array) -> float:
    axis, angle = axis_and_angle(matrix)
    return -angle * float(np.sign(axis[1]))


def _part_of(body: Body) -> Component:
    if body.inertia is None:
        return lib.PointMass(mass=body.mass)
    j = body.inertia
    return lib.RigidBody(
        mass=body.mass,
        center=tuple(body.center),
        moments=(j[0, 0], j[1, 1], j[2, 2]),
        products=(j[0, 1], j[0, 2], j[1, 2]),
    )


def moving_axes(mechanism: Mechanism) -> str:
    """Return the axes along which bodies can move; a line is along one of them."""
    return {"space": "xyz", "plane": "xz"}.get(mechanism.space, "xyz"[int(np.argmax(np.abs(mechanism.line)))])


def start_values(mechanism: Mechanism, body: Body) -> tuple[dict[str, float], dict[str, float]]:
    """Return the start values of a body's place and of its speeds, by path."""
    arm = body.rotation @ body.center
    center, velocity = body.position + arm, body.velocity + np.cross(body.spin, arm)
    axes = moving_axes(mechanism)
    places = {f"{body.name}.position.{a}": float(center["xyz".index(a)]) for a in axes}
    speeds = {f"{body.name}.velocity.{a}": float(velocity["xyz".index(a)]) for a in axes}
    if body.is_point or mechanism.space == "line":
        return places, speeds
    if mechanism.space == "plane":
        places[f"{body.name}.angle"] = plane_angles(mechanism)[body.name]
        speeds[f"{body.name}.angular_speed"] = -float(body.spin[1])
        return places, speeds
    for k, name in enumerate(("x_axis", "y_axis", "z_axis")):
        places.update({f"{body.name}.{name}.{a}": float(body.rotation[i, k]) for i, a in enumerate("xyz")})
    speeds.update({f"{body.name}.angular_velocity.{a}": float(body.spin[i]) for i, a in enumerate("xyz")})
    return places, speeds


def _value(value: Any) -> Any:
    if isinstance(value, Signal):
        if not value.amplitude and not value.slope and not value.jump:
            return value.offset
        return _function(value)
    return tuple(float(x) for x in value) if isinstance(value, np.ndarray) else value


def _function(signal: Signal) -> Callable[[Any], Any]:
    if signal.jump:
        smooth, at = _function(replace(signal, jump=0.0)), signal.kink
        return lambda t: smooth(t) + select(t < at, 0.0, 0.5 * signal.jump * (t - at) * (t - at))
    return lambda t: (
        signal.offset + signal.slope * t + signal.amplitude * sin(signal.frequency * t + signal.phase)
        if signal.slope
        else signal.offset + signal.amplitude * sin(signal.frequency * t + signal.phase)
    )


def _add_tie(scene: Scene, mechanism: Mechanism, tie: Tie) -> None:
    values = {name: _value(value) for name, value in tie.values.items() if name != "attracted"}
    if tie.grips:
        against = {"against": "ground"} if tie.sort in GAPS else {}
        part = scene.add(tie.name, class_of(tie.sort)(**values, **against))
        if tie.sort not in GEARS:
            (joint, coordinate), own = tie.grips[0], "b" if tie.sort in GAPS else "shaft"
            scene.connect(getattr(scene[joint], grip(coordinate)), getattr(part, own))
            return
        names = {"rack_and_pinion": ("rack", "pinion"), "planetary_gear": ("sun", "carrier", "ring")}
        for name, (joint, coordinate) in zip(names.get(tie.sort, ("a", "b")), tie.grips, strict=True):
            scene.connect(getattr(part, name), getattr(scene[joint], grip(coordinate)))
        return
    if tie.sort == "rope":
        part = scene.add(tie.name, lib.Rope(pulleys=len(tie.mounts) - 2, **values))
        ends = [part.a, *part.over, part.b]
        for i, (end, mount) in enumerate(zip(ends, tie.mounts, strict=True)):
            at = _mounted(scene, mechanism, mount, f"{tie.name}_{i}", as_point=True)
            if 0 < i < len(ends) - 1:
                pulley = scene.add(f"{tie.name}_pulley{i}", lib.Pulley())
                scene.connect(at, pulley.center)
                at = pulley.groove
            scene.connect(at, end)
        return
    if tie.sort == "sampled":
        _add_feedback(scene, mechanism, tie)
        return
    part = scene.add(tie.name, class_of(tie.sort)(**values))
    for name, mount in zip(connectors(tie), tie.mounts, strict=True):
        as_point = name in POINTS.get(tie.sort, ()) or name in ("point", "source")
        at = _mounted(scene, mechanism, mount, f"{tie.name}_{name}", as_point)
        scene.connect(at, getattr(part, name))


def _add_feedback(scene: Scene, mechanism: Mechanism, tie: Tie) -> None:
    """Add a feedback of a body's place and speed along an axis of the world, worked out at sample times."""
    values, body = tie.values, scene[tie.mounts[0].body]
    axis = "xyz"[int(np.argmax(np.abs(values["axis"])))]
    gains = values["stiffness"], values["damping"]
    control = scene.add(tie.name, lib.SampledFeedback(gains=gains, period=values["period"]))
    push = scene.add(f"{tie.name}_force", lib.Force(direction=tuple(map(float, values["axis"]))))
    for quantity, number in (("position", 1), ("velocity", 2)):
        scene.connect(body.output(f"{quantity}.{axis}"), control.input(f"u_{number}"))
    scene.connect(control.output("y"), push.input("value"))
    scene.connect(_mounted(scene, mechanism, tie.mounts[0], tie.name, as_point=True), push.point)


def grip(coordinate: str) -> str:
    """Return the connector by which a gear takes hold of a coordinate."""
    return {"angle": "shaft", "angle_a": "shaft_a", "angle_b": "shaft_b", "displacement": "carriage"}[coordinate]


def _mounted(scene: Scene, mechanism: Mechanism, mount: Mount, name: str, as_point: bool) -> Any:
    """Return the connector at a mount; what is not at a body's frame is at a weld of its own."""
    axis, angle = axis_and_angle(mount.rotation)
    if not mount.body:
        at = scene.add(f"{name}_ground", lib.Ground(position=tuple(map(float, mount.position)))).frame
        shift: Array = np.zeros(3)
    else:
        body = scene[mount.body]
        if mechanism.body(mount.body).is_point:
            return body.point
        at, shift = body.frame, mount.position
    angle = 0.0 if as_point else angle
    if angle < 1e-15 and not np.any(shift):
        return at
    weld = scene.add(
        f"{name}_weld",
        lib.Weld(displacement=tuple(map(float, shift)), **_turn(mechanism.space, axis, angle)),
    )
    scene.connect(at, weld.a)
    return weld.b


def _turn(space: str, axis: Array, angle: float) -> dict[str, Any]:
    if angle < 1e-15:
        return {}
    if space == "space":
        return {"angle": angle, "axis": tuple(map(float, axis))}
    return {"angle": _counter_clockwise(rotation(axis, angle))}
