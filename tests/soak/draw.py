"""Random sound mechanisms: places first, and joints that fit them, so that every loop closes."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from .description import Mechanism, Mount, Tie
from .draft import Draft
from .draw_own import add_own
from .draw_values import Chance, joint_at
from .oracle import Oracle
from .trial import Discarded

TREE = {
    "space": "pivot pivot pivot slider cylindrical screw spherical spherical universal planar constant_velocity "
    "rotary_drive drive weld rolling_disc rolling_sphere point_on_line point_on_plane point_on_circle rod free",
    "plane": "pivot pivot pivot pivot slider slider rotary_drive drive weld rolling_disc rolling_sphere spherical rod "
    "free",
    "line": "slider slider slider drive weld rod free free",
}
"""Joints by which a body may hang, as often as they are wanted."""

LOOP = {
    "space": "rod rod point_on_plane spherical point_on_line universal constant_velocity rope cylindrical",
    "plane": "rod rod pivot slider rope spherical",
    "line": "rope rod",
}
"""Joints that may close a loop."""

LOADS = {
    "space": "spring damper force torque bushing torsion_damper torsion_spring drag central_gravity",
    "plane": "spring damper force torque bushing torsion_damper torsion_spring drag central_gravity",
    "line": "spring spring damper force bushing drag",
}

ON_POINTS = ("rod", "point_on_line", "point_on_plane", "point_on_circle", "free")
"""Joints by which a material point may hang."""


def draw(seed: int, own: bool = True) -> Mechanism:
    """Return the mechanism of a seed, consistent at its start.

    Parameters
    ----------
    seed
        Of all random numbers.
    own
        Whether it may have a user's components, stops, feedback at sample times, kinks and wheels in loops.

    Raises
    ------
    Discarded
        If nothing can move, or the start is (nearly) a singular position.
    """
    chance = Chance(np.random.default_rng(seed))
    draft = Draft(chance, [], [])
    for i in range(chance.number_of_bodies()):
        _hang(draft, i)
    hung = len(draft.ties)
    for _ in range(chance.random.choice([0, 1, 2], p=[0.5, 0.35, 0.15])):
        _close(draft)
    for _ in range(chance.random.integers(0, 4)):
        _load(draft)
    if chance.random.random() < 0.25:
        _gear(draft, draft.ties[:hung])  # joints that close loops may be a turn away, and turns are counted
    if own:
        _add_own(draft, seed)
    gravity = 0.0 if chance.random.random() < 0.2 else 9.81
    return settled(Mechanism(chance.space, gravity, tuple(draft.bodies), tuple(draft.ties)))


def _add_own(draft: Draft, seed: int) -> None:
    chance = draft.chance
    other = Chance(np.random.default_rng([seed, 5]))
    other.space, other.is_round = chance.space, chance.is_round

    def coordinate_of(tie: Tie, name: str) -> float:
        oracle = Oracle(Mechanism(chance.space, 0.0, tuple(draft.bodies), tuple(draft.ties)))
        return float(np.real(oracle.coordinate(tie, name, oracle.start()[0])[0]))

    draft.chance = other
    add_own(draft, coordinate_of)
    draft.chance = chance


LATER = (0.03, 0.1, 0.17, 0.24, 0.3)
"""When drives are looked at again: what they prescribe may bend at a time."""


def is_driven(mechanism: Mechanism) -> bool:
    """Whether something moves as a function of time."""
    signals = [tie.values.get("motion") or tie.values.get("rotation") for tie in mechanism.ties]
    return any(signal is not None and (signal.amplitude or signal.jump) for signal in signals)


def settled(mechanism: Mechanism) -> Mechanism:
    """Return the mechanism with speeds that meet its constraints."""
    oracle = Oracle(mechanism)
    place, speeds = oracle.start()
    if not oracle.is_clear:
        raise Discarded("nearly singular")
    if oracle.rank >= oracle.size and not is_driven(mechanism):
        raise Discarded("immobile")
    if oracle.starts_singular:
        raise Discarded("singular")
    values = oracle.constraints(place, 0.0)[0]
    assert np.max(np.abs(values), initial=0.0) < 1e-9, f"the oracle's constraints do not hold at the start: {values}"
    speeds = oracle.project_speeds(place, speeds)
    _, rows, rates = oracle.constraints(place, 0.0)
    if np.max(np.abs(rows @ speeds + rates), initial=0.0) > 1e-9:
        raise Discarded("drives contradict")
    v, w = oracle.velocities(speeds)
    bodies = []
    for i, body in enumerate(mechanism.bodies):
        arm = body.rotation @ body.center
        spin = np.zeros(3) if body.is_point else w[i]
        bodies.append(replace(body, velocity=v[i] - np.cross(spin, arm), spin=spin))
    found = replace(mechanism, bodies=tuple(bodies))
    if Oracle(found).contradiction(LATER) > 1e-7:
        raise Discarded("drives contradict later")
    return found


def _hang(draft: Draft, i: int) -> None:
    """Add a body that hangs on the world or on another body."""
    chance = draft.chance
    parents = ["", *(body.name for body in draft.bodies)]
    # Chains are more interesting than stars, but both occur.
    parent = parents[-1] if chance.random.random() < 0.5 else str(chance.random.choice(parents))
    sort = chance.pick(TREE[chance.space])
    point = chance.random.random() < 0.2 and sort in ON_POINTS
    if draft.is_point(parent) and sort not in ("rod", "free"):
        sort = "rod"
    name = f"{'bob' if point else 'body'}{i}"
    body = chance.body(name, point)
    if sort == "free":
        p, _ = draft.pose(parent)
        draft.bodies.append(replace(body, position=p + chance.place(1.5), rotation=chance.turn()))
        if chance.space == "space" and not point and not draft.is_point(parent) and chance.random.random() < 0.5:
            draft.add("free_joint", (draft.random_mount(parent), draft.random_mount(name)), {})
        return
    a = draft.random_mount(parent)
    p, r = draft.placed(a)
    values, shift, turned = joint_at(chance, sort)
    # The joint's frame b is at a place of the body that is chosen first, so the body's pose follows.
    own = (
        Mount(name, np.zeros(3))
        if point or chance.random.random() < 0.4
        else Mount(name, chance.place(0.7), chance.turn())
    )
    if sort in ("rod", "rolling_disc", "rolling_sphere") and not point:
        own = replace(own, rotation=np.eye(3))
        if sort.startswith("rolling"):
            own = replace(own, position=np.zeros(3))
    rotated = r @ turned @ own.rotation.T
    position = p + r @ shift - rotated @ own.position
    draft.bodies.append(replace(body, position=position, rotation=np.eye(3) if point else rotated))
    draft.add(sort, (a, own), values)


def _close(draft: Draft) -> None:
    """Add a joint between two bodies where they are."""
    chance = draft.chance
    sort = chance.pick(LOOP[chance.space])
    names = ["", *(body.name for body in draft.bodies)]
    if chance.random.random() < 0.3 and chance.space == "space":
        return _close_flat(draft)
    one, other = chance.random.choice(names, 2, replace=False)
    if chance.space == "line":
        sort = "rope" if len(draft.bodies) > 1 else "rod"
    if sort == "rope":
        return _add_rope(draft, str(one), str(other))
    if sort != "rod" and (draft.is_point(str(one)) or draft.is_point(str(other))):
        sort = "rod"
    a = draft.random_mount(str(one))
    p, r = draft.placed(a)
    if sort == "rod":
        b = draft.random_mount(str(other))
        gap = float(np.linalg.norm(draft.placed(b)[0] - p))
        if gap < 0.1:
            return None
        mass = float(chance.size(0.5)) if chance.random.random() < 0.3 else 0.0
        draft.add("rod", (a, b), {"length": gap, "mass": mass})
        return None
    values, shift, turned = joint_at(chance, sort)
    draft.add(sort, (a, draft.mount_at(str(other), p + r @ shift, r @ turned)), values)
    return None


def _close_flat(draft: Draft) -> None:
    """Add a four-bar linkage in space whose plane is anywhere: hinges with parallel axes, redundant constraints."""
    chance = draft.chance
    parents = ["", *(body.name for body in draft.bodies if not body.is_point)]
    parent = str(chance.random.choice(parents))
    p, r = draft.pose(parent)
    frame = r @ chance.turn()
    n = frame[:, 2]
    corners = np.array([[0.0, 0.0], [0.1, 1.0], [1.3, 1.4], [1.5, -0.1]]) + 0.2 * chance.random.uniform(-1, 1, (4, 2))
    joints = [p + frame @ np.array([x, y, 0.3]) for x, y in corners]
    count = len(draft.bodies)
    names = [parent, *(f"body{count + k}" for k in range(3)), parent]
    for k in range(3):
        middle = 0.5 * (joints[k] + joints[k + 1]) + 0.1 * chance.place(1.0)
        draft.bodies.append(replace(chance.body(names[k + 1], False), position=middle, rotation=chance.turn()))
    for k in range(4):
        turned = chance.turn()
        axis = turned.T @ n
        a, b = (draft.mount_at(name, joints[k], turned) for name in names[k : k + 2])
        draft.add("pivot", (a, b), {"axis": axis / np.linalg.norm(axis)})


def _add_rope(draft: Draft, one: str, other: str) -> None:
    chance = draft.chance
    pulleys = [Mount("", chance.place(2.0) + 2.0 * chance.up()) for _ in range(chance.random.integers(0, 3))]
    mounts = (draft.random_mount(one), *pulleys, draft.random_mount(other))
    places = [draft.placed(mount)[0] for mount in mounts]
    pieces = [float(np.linalg.norm(q - p)) for p, q in pairwise(places)]
    if min(pieces) > 0.2:
        draft.add("rope", mounts, {"length": sum(pieces)})


def _load(draft: Draft) -> None:
    """Add a force."""
    chance = draft.chance
    sort = chance.pick(LOADS[chance.space])
    names = ["", *(body.name for body in draft.bodies)]
    rigid = ["", *(body.name for body in draft.bodies if not body.is_point)]
    some = rigid if sort in ("torque", "bushing", "torsion_damper", "torsion_spring") else names
    if sort == "force" and len(rigid) > 1 and chance.random.random() < 0.5:
        some = rigid
    if len(some) < 2:
        return
    one, other = map(str, chance.random.choice(some, 2, replace=False))
    own = str(chance.random.choice(some[1:]))
    first, second = draft.random_mount(one), draft.random_mount(other)
    gap = float(np.linalg.norm(draft.placed(first)[0] - draft.placed(second)[0]))
    values, mounts = chance.load(sort, gap), (first, second)
    if sort == "drag":
        mounts = (draft.random_mount(own),)
    elif sort == "force":
        sorts = ("world",) if own not in rigid or some is names else ("world", "body")
        values["resolved_in"] = str(chance.random.choice(sorts))
        mounts = (draft.random_mount(own),)
    elif sort == "torque":
        values["resolved_in"] = str(chance.random.choice(["world", "body", "other"]))
        values["reacts_on"] = str(chance.random.choice(["world", "other"]))
        others = "other" in (values["resolved_in"], values["reacts_on"])
        one, other = (other, one) if not one else (one, other)
        mounts = (draft.random_mount(one), draft.random_mount(other)) if others else (draft.random_mount(one),)
    elif sort in ("torsion_spring", "bushing"):
        p, r = draft.placed(first)
        mounts = (first, draft.mount_at(other, p + chance.place(0.2), r @ chance.small_turn()))
    elif gap < 0.3:
        return
    if sort == "torsion_damper" and chance.space == "space":
        along_a, along_b = (draft.placed(mount)[1] @ values["axis"] for mount in mounts)
        if along_a @ along_b < -0.8:  # where they point against each other a twist has no value
            return
    if sort == "central_gravity":
        joined = Mechanism(chance.space, 0.0, tuple(draft.bodies), tuple(draft.ties)).rigidly_joined(other)
        rods = [tie for tie in draft.ties if tie.sort == "rod" and tie.values["mass"] > 0.0]
        if "" in joined or not other or any(mount.body in joined for rod in rods for mount in rod.mounts):
            return
        body = next(body for body in draft.bodies if body.name == other)
        if len(joined) == 1 and body.inertia is not None and chance.space == "space" and chance.random.random() < 0.5:
            values["attracts"] = "body"
        mass = sum(body.mass for body in draft.bodies if body.name in joined)
        turn = second.rotation.T
        tensor = None if body.inertia is None else turn @ body.inertia @ turn.T
        values["attracted"] = mass, turn @ (body.center - second.position), tensor
    draft.add(sort, mounts, values)


def _gear(draft: Draft, ties: list[Tie]) -> None:
    """Add a gear between the coordinates of two joints, if there are any."""
    chance = draft.chance
    angles = [(tie.name, "angle") for tie in ties if tie.sort in ("pivot", "screw", "cylindrical")]
    slides = [(tie.name, "displacement") for tie in ties if tie.sort in ("slider", "cylindrical")]
    if chance.space == "line":
        angles = []
    kinds = [
        kind
        for kind, enough in (
            ("gear", len(angles) > 1),
            ("slide_gear", len(slides) > 1),
            ("rack_and_pinion", slides and angles),
            ("planetary_gear", len(angles) > 2),
        )
        if enough
    ]
    if not kinds:
        return
    kind = str(chance.random.choice(kinds))
    if kind == "rack_and_pinion":
        grips = [slides[chance.random.integers(len(slides))], angles[chance.random.integers(len(angles))]]
        values = {"radius": chance.size(0.4)}
    else:
        count = 3 if kind == "planetary_gear" else 2
        of = slides if kind == "slide_gear" else angles
        grips = [of[k] for k in chance.random.choice(len(of), count, replace=False)]
        values = {"ratio": chance.size(1.5) * (1.0 if count == 3 else chance.sign())}
    bare = Tie("", kind, (), {**values, "offset": 0.0}, tuple(grips))
    probe = Mechanism(chance.space, 0.0, tuple(draft.bodies), (*draft.ties, bare))
    oracle = Oracle(probe)
    values["offset"] = float(np.real(oracle.rows_of(bare, oracle.start()[0], 0.0)[0][0]))
    draft.add(kind, (), values, grips)
