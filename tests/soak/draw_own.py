"""What a random mechanism has beside plain parts: a user's components, stops, feedback at sample times, kinks, wheels.

These come from random numbers of their own, so that the mechanism of a seed is the same without them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from .description import Mount, Signal, normals, rotation
from .draft import Draft
from .oracle_own import GAPS

SHARE = 0.4
"""Share of the mechanisms that have any of this."""

MOST = 3

SORTS = {
    "space": "own_spring own_swirl own_surface own_wire own_flywheel own_leak gap sampled kink wheel",
    "plane": "own_spring own_swirl own_wire own_flywheel own_leak gap sampled kink wheel",
    "line": "own_spring own_leak gap sampled kink",
}


def add_own(draft: Draft, coordinate_of: Any) -> None:
    """Add some of this, or nothing, to a mechanism in the making.

    Parameters
    ----------
    draft
        The mechanism.
    coordinate_of
        Returns the value of a joint's coordinate where the mechanism starts, from the joint's tie and the name.
    """
    random = draft.chance.random
    if random.random() > SHARE:
        return
    for sort in random.choice(SORTS[draft.chance.space].split(), random.integers(1, MOST + 1), replace=False):
        if sort == "gap":
            _gap(draft, coordinate_of)
        elif sort == "own_flywheel":
            _flywheel(draft)
        elif sort == "kink":
            _kink(draft)
        elif sort == "wheel":
            _wheel(draft)
        elif sort in ("own_surface", "own_wire"):
            _on_curve(draft, str(sort))
        else:
            _pushed(draft, str(sort))


def _pushed(draft: Draft, sort: str) -> None:
    """Add a force, a mass that changes, or a feedback."""
    chance, random = draft.chance, draft.chance.random
    names = ["", *(body.name for body in draft.bodies)]
    own = draft.random_mount(str(random.choice(names[1:])))
    if sort == "own_leak":
        if any(tie.sort == "central_gravity" for tie in draft.ties):
            return  # it would attract what leaks, too
        mass = chance.size(0.5)
        part = Signal(
            mass, 0.0, 0.4 * mass * float(random.uniform(-1, 1)), chance.size(4.0), float(random.uniform(0, 6))
        )
        draft.add(sort, (own,), {"mass": part})
        return
    if sort == "sampled":
        # All gains are of forces, so that the mechanism stays as soft as it is.
        axis = chance.up() if random.random() < 0.5 or chance.space == "line" else np.array([1.0, 0.0, 0.0])
        gains = {"stiffness": chance.size(4.0), "damping": chance.size(0.4)}
        draft.add(sort, (own,), {**gains, "axis": axis, "period": float(random.uniform(0.03, 0.12))})
        return
    other = draft.random_mount(str(random.choice([name for name in names if name != own.body])))
    gap = float(np.linalg.norm(draft.placed(own)[0] - draft.placed(other)[0]))
    if gap < 0.3:
        return
    if sort == "own_swirl":
        values = {"twisting": chance.size(0.3), "pulling": chance.size(1.0), "axis": chance.turning_axis()}
        draft.add(sort, (other, own), values)
        return
    growth = Signal(1.0, 0.0, 0.5 * float(random.uniform(-1, 1)), chance.size(5.0), float(random.uniform(0.0, 6.0)))
    values = {"stiffness": chance.size(6.0), "natural_length": gap * float(random.uniform(0.7, 1.3)), "growth": growth}
    draft.add(sort, (other, own), values)


def _on_curve(draft: Draft, sort: str) -> None:
    """Hold a point of a body on a paraboloid or a parabola that goes through where it is."""
    chance, random = draft.chance, draft.chance.random
    names = ["", *(body.name for body in draft.bodies if not body.is_point)]
    carrier = str(random.choice(names))
    held = draft.random_mount(str(random.choice([body.name for body in draft.bodies if body.name != carrier] or [""])))
    if not held.body:
        return
    x, y = (float(value) for value in random.uniform(-0.6, 0.6, 2))
    bends = chance.size(1.0), chance.size(1.0) * chance.sign()
    if sort == "own_wire":
        at, values = np.array([x, 0.0, 0.5 * x * x / bends[0]]), {"radius": bends[0]}
    else:
        at = np.array([x, y, 0.5 * (x * x / bends[0] + y * y / bends[1])])
        values = {"radius_1": bends[0], "radius_2": bends[1]}
    turned = chance.turn()
    draft.add(sort, (draft.mount_at(carrier, draft.placed(held)[0] - turned @ at, turned), held), values)


def _flywheel(draft: Draft) -> None:
    hinges = [tie.name for tie in draft.ties if tie.sort == "pivot" and "axis" in tie.values]
    if hinges:
        chance = draft.chance
        mean = chance.size(0.4)
        values = {"mean": mean, "swing": 0.8 * mean * float(chance.random.uniform(-1.0, 1.0))}
        draft.add("own_flywheel", (), values, [(str(chance.random.choice(hinges)), "angle")])


def _gap(draft: Draft, coordinate_of: Any) -> None:
    """Add stops to a hinge or to a slider, one of which it comes to soon if it moves."""
    chance, random = draft.chance, draft.chance.random
    held = {"slider": ("displacement", GAPS[0]), "pivot": ("angle", GAPS[1])}
    joints = [tie for tie in draft.ties if tie.sort in held and "axis" in tie.values]
    if not joints:
        return
    tie = joints[random.integers(len(joints))]
    name, sort = held[tie.sort]
    value = coordinate_of(tie, name)
    below, above = random.uniform(0.01, 0.25, 2)
    values = {"stiffness": chance.size(60.0), "lower": float(value - below), "upper": float(value + above)}
    draft.add(sort, (), values, [(tie.name, name)])


def _kink(draft: Draft) -> None:
    """Let what a drive prescribes, or a force, bend at a time: a jump of an acceleration."""
    random = draft.chance.random
    places = [
        (i, name)
        for i, tie in enumerate(draft.ties)
        for name, value in tie.values.items()
        if isinstance(value, Signal) and not tie.sort.startswith("own")
    ]
    if places:
        i, name = places[random.integers(len(places))]
        tie = draft.ties[i]
        bent = replace(
            tie.values[name], kink=float(random.uniform(0.03, 0.27)), jump=float(random.uniform(-20.0, 20.0))
        )
        draft.ties[i] = replace(tie, values={**tie.values, name: bent})


def _wheel(draft: Draft) -> None:
    """Let a wheel on a body roll on a plane in the world or on another body: in a loop with what it hangs on."""
    chance, random = draft.chance, draft.chance.random
    rigid = [body.name for body in draft.bodies if not body.is_point]
    if not rigid:
        return
    own = str(random.choice(rigid))
    carrier = str(random.choice(["", *(name for name in rigid if name != own)]))
    hub = Mount(own, chance.place(0.3), np.eye(3))
    center, turned = draft.placed(hub)
    axis = chance.turning_axis()
    n1, n2 = normals(turned @ axis)
    angle = float(random.uniform(-np.pi, np.pi))
    normal = np.cos(angle) * n1 + np.sin(angle) * n2
    lean = 0.0
    if chance.space == "space":
        lean = float(random.uniform(-0.5, 0.5))
        normal = rotation(np.cross(turned @ axis, normal), lean) @ normal
    radius = chance.size(0.4)
    height = radius * np.sqrt(1.0 - float(normal @ turned @ axis) ** 2)
    ground_turned = chance.turn()
    ground = draft.mount_at(carrier, center - height * normal, ground_turned)
    draft.add("rolling_disc", (ground, hub), {"radius": radius, "normal": ground_turned.T @ normal, "axis": axis})
