"""Kind `sets`: bodies with up to six places at zero gaps, at rest, sliding or in collision, against all sets there are.

The oracle has its own mass matrices and rows (no code of Atwood's). Whatever Atwood takes must meet every inequality of
contact, friction and impact; what it says that velocities jump to must follow from impulses that do (a linear program);
a start at rest stays at rest where it can; what it refuses must have no set among all 2 or 4 states of each place; and
no impact makes energy.
"""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares, linprog

import atwood as aw
from atwood import Scene, simulate
from atwood.errors import AtwoodError
from atwood_library import Ground, Pivot, RigidBody, VertexContact

from .trial import Finding, Trial

G = 9.81
SMALL = 1e-7
"""Share of the largest rate or force by which an inequality may be missed."""
SIDES = 48
"""A cone of friction in space is held within a pyramid of so many sides around it, where impulses are looked for."""
TINY = 1e-15
"""Energy of what begins to slip with a speed that only tells its direction, beside that of a fall by 1 m."""
END = 0.03


@dataclass(frozen=True)
class Body:
    """A body with its axes along the world's: mass, moments, centre, the origin of its frame from there, motion."""

    mass: float
    moments: np.ndarray
    centre: np.ndarray
    origin: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    hinged: bool


@dataclass(frozen=True)
class Touch:
    """A place of a body on a plane of another one, or of the ground (-1)."""

    body: int
    carrier: int
    place: np.ndarray
    normal: np.ndarray
    friction: float
    static: float | None
    restitution: float
    belt: float

    @property
    def most(self) -> float:
        """The coefficient of friction while it sticks."""
        return self.friction if self.static is None else self.static


@dataclass(frozen=True)
class Draft:
    """A scene."""

    space: str
    bodies: tuple[Body, ...]
    touches: tuple[Touch, ...]


def draw(seed: int) -> Draft:
    """Return the scene of a seed."""
    random = np.random.default_rng(seed)
    space = "space" if random.random() < 0.2 else "plane"
    flat = np.array([1.0, 1.0, 1.0]) if space == "space" else np.array([1.0, 0.0, 1.0])
    motion = random.choice(["rest", "slides", "collides"])
    bodies = []
    for _ in range(int(random.integers(1, 4))):
        origin = random.uniform(-0.3, 0.3, 3) * flat
        bodies.append(
            Body(
                random.uniform(0.5, 2.0),
                random.uniform(0.05, 0.2) * random.uniform(1.0, 1.4, 3),
                random.uniform(-1.0, 1.0, 3) * flat,
                origin,
                random.uniform(-1.0, 1.0, 3) * flat,
                random.uniform(-1.0, 1.0, 3) * (1.0 if space == "space" else np.array([0.0, 1.0, 0.0])),
                bool(space == "plane" and random.random() < 0.2),
            )
        )
    most = 7 if space == "plane" else 4
    touches = [_touch(random, bodies, flat) for _ in range(int(random.integers(1, most)))]
    if random.random() < 0.25:  # all places of a body in a row on one floor: their shares are not determined
        floor = np.array([0.0, 0.0, 1.0])
        touches = [
            Touch(0, -1, np.array([x, 0.0, 0.0]), floor, one.friction, one.static, one.restitution, one.belt)
            for x, one in zip(np.linspace(-0.5, 0.5, len(touches)), touches, strict=True)
        ]
    return _set_going(Draft(space, tuple(bodies), tuple(touches)), str(motion))


def _touch(random: np.random.Generator, bodies: list[Body], flat: np.ndarray) -> Touch:
    body = int(random.integers(len(bodies)))
    others = [-1, *(k for k in range(len(bodies)) if k != body)]
    carrier = int(random.choice(others)) if random.random() < 0.4 else -1
    normal = random.normal(size=3) * flat + (np.array([0.0, 0.0, 0.8]) if carrier < 0 else 0.0)
    normal = normal / np.linalg.norm(normal)
    friction = random.uniform(0.0, 1.0) if random.random() < 0.8 else 0.0
    place = random.uniform(-0.5, 0.5, 3) * flat
    if carrier >= 0:  # the plane goes through the origin of its carrier's frame
        there, own = (bodies[k].centre + bodies[k].origin for k in (carrier, body))
        place = place - normal * (normal @ (own + place - there))
    return Touch(
        body,
        carrier,
        place,
        normal,
        friction,
        friction * random.uniform(1.0, 1.5) if random.random() < 0.3 else None,
        random.uniform(0.0, 0.9) if random.random() < 0.5 else 0.0,
        random.uniform(-1.0, 1.0) if carrier < 0 and flat[1] == 0.0 and random.random() < 0.15 else 0.0,
    )


class Oracle:
    """Newton's and Euler's equations of the bodies, and the rows of their places, for coordinates that are free."""

    def __init__(self, draft: Draft) -> None:
        self.draft = draft
        plane = draft.space == "plane"
        count, free = len(draft.bodies), [0, 2, 4] if plane else list(range(6))
        columns: list[np.ndarray] = []
        for k, body in enumerate(draft.bodies):
            for j in [4] if body.hinged else free:
                column = np.zeros(6 * count)
                column[6 * k + j] = 1.0
                if body.hinged:  # its centre goes round the origin of its frame
                    column[6 * k : 6 * k + 3] = np.cross([0.0, 1.0, 0.0], -body.origin)
                columns.append(column)
        self.moves = np.array(columns).T
        whole = np.zeros(6 * count)
        for k, body in enumerate(draft.bodies):
            whole[6 * k : 6 * k + 6] = [*[body.mass] * 3, *body.moments]
        self.masses = whole
        self.inverse = np.linalg.inv(self.moves.T @ (whole[:, None] * self.moves))
        self.rows = np.array([row for one in draft.touches for row in self._rows(one)]).reshape(-1, 6 * count)
        self.response = self.rows @ self.moves @ self.inverse @ self.moves.T @ self.rows.T
        self._falls: dict[bytes, np.ndarray] = {}  # accelerations without forces, by speeds
        self.sets: dict[bytes, list[np.ndarray]] = {}  # what `every_set` gives, by speeds to rounding: forms share it

    def directions(self, one: Touch) -> np.ndarray:
        """Return the normal and the directions across it."""
        n = one.normal
        if self.draft.space == "plane":
            return np.array([n, [n[2], 0.0, -n[0]]])
        first = np.cross(n, np.eye(3)[int(np.argmin(np.abs(n)))])
        first = first / np.linalg.norm(first)
        return np.array([n, first, np.cross(n, first)])

    def _rows(self, one: Touch) -> list[np.ndarray]:
        found = []
        place = self._place(one)
        for way in self.directions(one):
            row = np.zeros(6 * len(self.draft.bodies))
            for k, sign in ((one.body, 1.0), (one.carrier, -1.0)):
                if k >= 0:
                    row[6 * k : 6 * k + 3] = sign * way
                    row[6 * k + 3 : 6 * k + 6] = sign * np.cross(place - self.draft.bodies[k].centre, way)
            found.append(row)
        return found

    def _place(self, one: Touch) -> np.ndarray:
        body = self.draft.bodies[one.body]
        return body.centre + body.origin + one.place

    def rates(self, speeds: np.ndarray) -> np.ndarray:
        """Return the rates of gaps and slips, a line for each place."""
        found = (self.rows @ speeds).reshape(len(self.draft.touches), -1)
        found[:, 1] -= [one.belt for one in self.draft.touches]
        return found

    def accelerations(self, speeds: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """Return those of gaps and slips by forces, at speeds of the bodies."""
        known = speeds.tobytes()
        if known not in self._falls:
            self._falls[known] = self._fall(speeds)
        return self._falls[known] + (self.response @ forces.ravel()).reshape(len(self.draft.touches), -1)

    def _fall(self, speeds: np.ndarray) -> np.ndarray:
        gone, push = self._turning(speeds), np.zeros(len(speeds))
        for k, body in enumerate(self.draft.bodies):
            spin = speeds[6 * k + 3 : 6 * k + 6]
            push[6 * k + 2] -= body.mass * G
            push[6 * k + 3 : 6 * k + 6] -= np.cross(spin, body.moments * spin)
        full = self.moves @ (self.inverse @ (self.moves.T @ (push - self.masses * gone))) + gone
        return (self.rows @ full).reshape(len(self.draft.touches), -1) + self._curved(speeds)

    def _turning(self, speeds: np.ndarray) -> np.ndarray:
        """Return the accelerations of centres that go round a hinge."""
        found = np.zeros(len(speeds))
        for k, body in enumerate(self.draft.bodies):
            if body.hinged:
                spin = speeds[6 * k + 3 : 6 * k + 6]
                found[6 * k : 6 * k + 3] = np.cross(spin, np.cross(spin, -body.origin))
        return found

    def _curved(self, speeds: np.ndarray) -> np.ndarray:
        """Return the accelerations of gaps and slips that come of speeds alone."""
        found = []
        for one in self.draft.touches:
            body = self.draft.bodies[one.body]
            v, w = speeds[6 * one.body : 6 * one.body + 3], speeds[6 * one.body + 3 : 6 * one.body + 6]
            arm, place = body.origin + one.place, self._place(one)
            moves, bends = v + np.cross(w, arm), np.cross(w, np.cross(w, arm))
            turn, corner, there, bent = (np.zeros(3) for _ in range(4))
            if one.carrier >= 0:
                other = self.draft.bodies[one.carrier]
                there, turn = speeds[6 * one.carrier : 6 * one.carrier + 3], speeds[6 * one.carrier + 3 :][:3]
                corner = other.centre + other.origin
                there = there + np.cross(turn, other.origin)
                bent = np.cross(turn, np.cross(turn, other.origin))
            apart = place - corner if one.carrier >= 0 else np.zeros(3)
            ways = self.directions(one)
            n, past = ways[0], moves - there - np.cross(turn, apart)
            rate = np.cross(turn, n)
            line = [np.cross(turn, rate) @ apart + 2.0 * rate @ (moves - there) + n @ (bends - bent)]
            for way in ways[1:]:
                line.append(np.cross(turn, way) @ past + way @ (bends - bent - np.cross(turn, moves - there)))
            found.append(line)
        return np.array(found)

    def energy(self, speeds: np.ndarray) -> float:
        """Return the kinetic energy."""
        return 0.5 * float(speeds @ (self.masses * speeds))

    def speeds(self) -> np.ndarray:
        """Return the velocities and spins of all bodies at the start."""
        return np.concatenate([np.concatenate([one.velocity, one.spin]) for one in self.draft.bodies])


def _set_going(draft: Draft, motion: str) -> Draft:
    """Return the scene at rest, or with velocities by which no gap moves, or any."""
    oracle = Oracle(draft)
    free = np.linalg.lstsq(oracle.moves, oracle.speeds(), rcond=None)[0]
    if motion == "rest":
        free = 0.0 * free
    elif motion == "slides":
        width = len(oracle.rows) // len(draft.touches)
        gaps = oracle.rows[::width] @ oracle.moves
        free = free - np.linalg.pinv(gaps, rcond=1e-10) @ (gaps @ free)
        free = free if np.linalg.norm(free) > 1e-6 else 0.0 * free
    speeds = (oracle.moves @ free).reshape(-1, 6)
    bodies = [
        Body(one.mass, one.moments, one.centre, one.origin, speed[:3], speed[3:], one.hinged)
        for one, speed in zip(draft.bodies, speeds, strict=True)
    ]
    return Draft(draft.space, tuple(bodies), draft.touches)


def make(draft: Draft, law: str = "newton") -> Scene:
    """Return the scene of a draft, with a law of impact."""
    scene, plane = Scene(space=draft.space, gravity=G), draft.space == "plane"
    for k, one in enumerate(draft.bodies):
        body = scene.add(
            f"b{k}", RigidBody(mass=one.mass, moments=tuple(one.moments), center=tuple(float(-x) for x in one.origin))
        )
        if one.hinged:
            ground = scene.add(f"hinge_ground{k}", Ground(position=tuple(map(float, one.centre + one.origin))))
            hinge = scene.add(f"hinge{k}", Pivot())
            scene.connect(ground.frame, hinge.a)
            scene.connect(hinge.b, body.frame)
            scene.start[f"hinge{k}.angle"] = 0.0
        for i, axis in enumerate("xyz"):
            if not one.hinged and not (plane and axis == "y"):
                scene.start[f"b{k}.position.{axis}"] = float(one.centre[i])
                scene.start[f"b{k}.velocity.{axis}"] = float(one.velocity[i])
            if not plane or axis == "y":
                scene.start[f"b{k}.angular_velocity.{axis}"] = float(one.spin[i])
        if plane and not one.hinged:
            scene.start[f"b{k}.angle"] = 0.0
    for i, touch in enumerate(draft.touches):
        body = draft.bodies[touch.body]
        contact = scene.add(
            f"c{i}",
            VertexContact(
                place=tuple(map(float, touch.place)),
                normal=tuple(map(float, touch.normal)),
                friction=touch.friction,
                static_friction=touch.static,
                restitution=touch.restitution,
                impact_law=law,
                surface_velocity=touch.belt,
            ),
        )
        scene.connect(getattr(scene, f"b{touch.body}").frame, contact.body)
        if touch.carrier < 0:
            carrier = scene.add(f"g{i}", Ground(position=tuple(map(float, body.centre + body.origin + touch.place))))
        else:
            carrier = getattr(scene, f"b{touch.carrier}")
        scene.connect(carrier.frame, contact.plane)
    return scene


def force_missed(oracle: Oracle, speeds: np.ndarray, forces: np.ndarray) -> tuple[float, str]:
    """Return the largest share by which forces contradict a law at some speeds, and which law."""
    rates, falls = oracle.rates(speeds), oracle.accelerations(speeds, forces)
    fast, most = _size(speeds), _size(forces, _weight(oracle))
    steep = _size(falls, G)
    worst, law = 0.0, ""
    for one, rate, fall, force in zip(oracle.draft.touches, rates, falls, forces, strict=True):
        across, slip = force[1:], float(np.linalg.norm(rate[1:]))
        if rate[0] > SMALL * fast:
            some = [(float(np.linalg.norm(force)) / most, "what opens bears")]
        else:
            some = [
                (-force[0] / most, "a force pulls"),
                (-fall[0] / steep, "a gap closes"),
                (min(force[0] / most, fall[0] / steep), "what opens bears"),
            ]
        if slip > SMALL * fast:
            missed = np.linalg.norm(across + one.friction * force[0] * rate[1:] / slip)
            some.append((float(missed) / most, "what slips rubs otherwise"))
        else:
            rubs, moves = float(np.linalg.norm(across)), float(np.linalg.norm(fall[1:]))
            some.append(((rubs - one.most * force[0]) / most, "friction is larger than it may be"))
            if force[0] > SMALL * most and moves > SMALL * steep:
                missed = np.linalg.norm(across + one.friction * force[0] * fall[1:] / moves)
                some.append((min(float(missed) / most, moves / steep), "what begins to slip rubs otherwise"))
        now = max(some)
        if now[0] > worst:
            worst, law = now
    return worst, law


def impact_missed(oracle: Oracle, before: np.ndarray, after: np.ndarray) -> float:
    """Return the largest share by which no impulses that meet the laws of impact lead from speeds to others."""
    rates, now = oracle.rates(before), oracle.rates(after)
    fast = _size(np.concatenate([before, after]))
    least = np.array([one.restitution for one in oracle.draft.touches]) * np.maximum(-rates[:, 0], 0.0)
    missed = max(0.0, float(np.max(least - now[:, 0]))) / fast
    # What impulses do, sums of pushes along edges of cones that are at hand: each at least zero.
    edges = [
        edge
        for k in range(len(rates))
        if now[k, 0] - least[k] <= SMALL * fast
        for edge in _edges(oracle, k, now[k], fast)
    ]
    change = oracle.moves.T @ (oracle.masses * (after - before))
    if not edges:
        return max(missed, float(np.max(np.abs(change))) / (fast * float(np.max(oracle.masses))))
    pushes = np.array([oracle.moves.T @ edge for edge in edges]).T
    # The least t with -t <= pushes x - change <= t.
    one = np.ones((len(change), 1))
    above, below = np.hstack([pushes, -one]), np.hstack([-pushes, -one])
    cost = np.zeros(pushes.shape[1] + 1)
    cost[-1] = 1.0
    scale = fast * float(np.max(oracle.masses))
    found = linprog(
        cost, A_ub=np.vstack([above, below]), b_ub=np.concatenate([change, -change]) / scale, method="highs"
    )
    assert found.status == 0, found.message
    return max(missed, float(found.fun))


def _edges(oracle: Oracle, k: int, rate: np.ndarray, fast: float) -> list[np.ndarray]:
    """Return impulses of one place, on all speeds, of which each that it may exert is a sum."""
    one, width = oracle.draft.touches[k], len(rate)
    rows = oracle.rows[k * width : (k + 1) * width]
    slip = float(np.linalg.norm(rate[1:]))
    if slip > SMALL * fast:
        ways = [-one.friction * rate[1:] / slip]
    elif width == 2:
        ways = [np.array([one.most]), np.array([-one.most])]
    else:
        turns = 2.0 * math.pi * np.arange(SIDES) / SIDES
        ways = [one.most / math.cos(math.pi / SIDES) * np.array([math.cos(x), math.sin(x)]) for x in turns]
    return [rows[0] + way @ rows[1:] for way in ways]


def every_set(oracle: Oracle, speeds: np.ndarray) -> list[np.ndarray]:
    """Return the accelerations of all gaps and slips in each set of states that contradicts nothing, in a plane.

    Of forces that are not determined the least are looked at, and others where a linear program finds them.
    """
    rates = oracle.rates(speeds)
    fast = _size(speeds)
    free = oracle.accelerations(speeds, np.zeros_like(rates)).ravel()
    found: list[np.ndarray] = []
    for states in itertools.product(*_choices(oracle, rates, fast)):
        forces = _forces_in(oracle, states, free, _weight(oracle))
        if forces is not None and force_missed(oracle, speeds, forces.reshape(-1, 2))[0] <= SMALL:
            fall = oracle.accelerations(speeds, forces.reshape(-1, 2)).ravel()
            if not any(np.max(np.abs(fall - other)) <= 1e-5 * _size(free, G) for other in found):
                found.append(fall)
    return found


def _choices(oracle: Oracle, rates: np.ndarray, fast: float) -> list[list[tuple[str, float]]]:
    choices: list[list[tuple[str, float]]] = []
    for one, rate in zip(oracle.draft.touches, rates, strict=True):
        if rate[0] > SMALL * fast:
            choices.append([("open", 0.0)])
        elif abs(rate[1]) > SMALL * fast:
            choices.append([("open", 0.0), ("slips", math.copysign(1.0, rate[1]))])
        elif not one.most:
            choices.append([("open", 0.0), ("slips", 1.0)])
        else:
            choices.append([("open", 0.0), ("sticks", 0.0), ("slips", 1.0), ("slips", -1.0)])
    return choices


def every_set_in_space(oracle: Oracle, speeds: np.ndarray) -> list[np.ndarray]:
    """Return the same in space, of forces that are determined: directions of what begins to slip are roots."""
    rates = oracle.rates(speeds)
    fast, random, found = _size(speeds), np.random.default_rng(0), list[np.ndarray]()
    free = oracle.accelerations(speeds, np.zeros_like(rates)).ravel()
    choices: list[list[str]] = []
    for one, rate in zip(oracle.draft.touches, rates, strict=True):
        moves = bool(np.linalg.norm(rate[1:]) > SMALL * fast)
        rubs = ["moves"] if moves else ["sticks", "begins"] if one.most else ["begins"]
        choices.append(["open"] if rate[0] > SMALL * fast else ["open", *rubs])
    for states in itertools.product(*choices):
        begin = [k for k, state in enumerate(states) if state == "begins"]

        def forces(angles: np.ndarray, states: tuple[str, ...] = states, begin: list[int] = begin) -> np.ndarray:
            ways = np.array([rate[1:] / (np.linalg.norm(rate[1:]) or 1.0) for rate in rates])
            ways[begin] = np.array([np.cos(angles), np.sin(angles)]).T
            return _forces_in_space(oracle, states, ways, free)

        def turned(angles: np.ndarray, forces: Callable = forces, begin: list[int] = begin) -> np.ndarray:
            across = (free + oracle.response @ forces(angles)).reshape(-1, 3)[begin, 1:]
            turn = across[:, 1] * np.cos(angles) - across[:, 0] * np.sin(angles)
            return turn / (np.linalg.norm(across, axis=1) + 1e-12)

        for _ in range(4 * 6 ** len(begin) if begin else 1):
            angles = random.uniform(0.0, 2.0 * math.pi, len(begin))
            angles = least_squares(turned, angles, xtol=1e-14, ftol=1e-14, gtol=1e-14).x if begin else angles
            pushes = forces(angles).reshape(-1, 3)
            fall = oracle.accelerations(speeds, pushes).ravel()
            is_new = not any(np.max(np.abs(fall - other)) <= 1e-5 * _size(free, G) for other in found)
            if is_new and force_missed(oracle, speeds, pushes)[0] <= SMALL:
                found.append(fall)
    return found


def _forces_in_space(oracle: Oracle, states: tuple[str, ...], ways: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Return the forces of a set of states, the least where some are not determined; `ways` are directions of slips."""
    held, columns = [], []
    for k, state in enumerate(states):
        push = np.zeros(len(free))
        push[3 * k] = 1.0
        if state in ("moves", "begins"):
            push[3 * k + 1 : 3 * k + 3] = -oracle.draft.touches[k].friction * ways[k]
        rows = {"open": 0, "sticks": 3}.get(state, 1)
        columns += [push, *np.eye(len(free))[3 * k + 1 : 3 * k + 3]][:rows]
        held += range(3 * k, 3 * k + rows)
    by = np.array(columns).reshape(-1, len(free)).T
    solved: np.ndarray = by @ np.linalg.lstsq((oracle.response @ by)[held], -free[held], rcond=1e-11)[0]
    return solved


def every_impact(oracle: Oracle, speeds: np.ndarray) -> list[np.ndarray]:
    """Return the speeds after each impact that meets the laws, in a plane."""
    rates = oracle.rates(speeds)
    fast, found = _size(speeds), list[np.ndarray]()
    least = np.array([one.restitution for one in oracle.draft.touches]) * np.maximum(-rates[:, 0], 0.0)
    free = rates.copy()
    free[:, 0] -= least
    by = oracle.moves @ oracle.inverse @ oracle.moves.T @ oracle.rows.T
    for states in itertools.product(*_choices(oracle, np.zeros_like(rates), fast)):
        pushes = _forces_in(oracle, states, free.ravel(), fast * float(np.max(oracle.masses)))
        if pushes is not None:
            after = speeds + by @ pushes
            if impact_missed(oracle, speeds, after) <= SMALL:
                found.append(after)
    return found


def _forces_in(
    oracle: Oracle, states: tuple[tuple[str, float], ...], free: np.ndarray, most: float
) -> np.ndarray | None:
    """Return forces, or impulses, of a set of states; None where there are none that push and hold."""
    held, columns = [], []
    for k, (state, way) in enumerate(states):
        if state == "open":
            continue
        push = np.zeros(len(free))
        push[2 * k], push[2 * k + 1] = 1.0, -oracle.draft.touches[k].friction * way
        columns.append(push)
        held.append(2 * k)
        if state == "sticks":
            held.append(2 * k + 1)
            columns.append(np.eye(len(free))[2 * k + 1])
    if not held:
        return np.zeros(len(free))
    by = np.array(columns).T
    matrix = (oracle.response @ by)[held]
    x, _, rank, _ = np.linalg.lstsq(matrix, -free[held], rcond=1e-11)
    if rank == len(held):
        return by @ x
    # Equations hold to rounding only: rows that depend on each other would contradict each other by it.
    room = np.full(len(held), 1e-9 * _size(free))
    if np.linalg.norm(matrix @ x + free[held]) > np.linalg.norm(room):
        return None  # whatever the limits
    limits, k = [], 0
    for i, (state, _) in enumerate(states):
        if state == "open":
            continue
        line = np.zeros((3, len(x)))
        line[:, k] = [-1.0, -oracle.draft.touches[i].most, -oracle.draft.touches[i].most]
        k += 1
        if state == "sticks":
            line[1:, k] = [1.0, -1.0]
            k += 1
        limits += list(line if state == "sticks" else line[:1])
    scale = _size(x, most)
    found = linprog(
        np.zeros(len(x)),
        A_ub=np.vstack([np.array(limits), matrix, -matrix]),
        b_ub=np.concatenate([np.full(len(limits), 1e-9 * scale), -free[held] + room, free[held] + room]),
        bounds=(None, None),
        method="highs",
    )
    return by @ found.x if found.status == 0 else None


def _weight(oracle: Oracle) -> float:
    return G * sum(one.mass for one in oracle.draft.bodies)


def _size(values: np.ndarray, least: float = 1.0) -> float:
    return max(least, float(np.max(np.abs(values), initial=0.0)))


def check(seed: int) -> Trial:
    """Make the trial of a seed."""
    draft = draw(seed)
    oracle = Oracle(draft)
    tried = [draft.space, f"{len(draft.touches)} places"]
    findings: list[Finding] = []
    for form in ("reduced", "dae"):
        words, found = _looked_at(draft, oracle, form)
        tried += words
        findings += [Finding(one.gravity, f"{form}: {one.what}", f"{one.detail}\n{draft}") for one in found]
    return Trial(tuple(tried), tuple(findings))


def _looked_at(draft: Draft, oracle: Oracle, form: str) -> tuple[list[str], list[Finding]]:
    before = oracle.speeds()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result = simulate(make(draft), form=form, t_end=END, rtol=1e-9, outputs=7)
    except AtwoodError as error:
        return _refused(oracle, before, error, form)
    if result.status != "finished":
        return ["not finished"], [Finding("hang", str(result.status))]
    energy = _read(draft, result)
    after, forces = _taken(draft, oracle, result)
    at_start = [one.kind for one in result.events if one.time == 0.0]
    words, found = [f"start {kind}" for kind in sorted(set(at_start)) if kind in ("impact", "jams")], []
    missed, law = force_missed(oracle, after, forces)
    if missed > SMALL:
        found.append(Finding("wrong", f"at the start {law}", f"{missed:.3g}"))
    if "jams" not in at_start:
        missed = impact_missed(oracle, before, after)
        if missed > SMALL:
            found.append(Finding("wrong", "velocities jump otherwise than by an impact", f"{missed:.3g}"))
        if not any(one.belt for one in draft.touches) and oracle.energy(after) > oracle.energy(before) * (
            1.0 + 1e-9
        ) + TINY * _weight(oracle):
            found.append(
                Finding("wrong", "an impact makes energy", f"{oracle.energy(before)} J, {oracle.energy(after)} J then")
            )
    if draft.space == "plane":
        words += _among_all(
            oracle, before if "jams" in at_start and "impact" not in at_start else after, forces, at_start, found
        )
    found += _later(draft, result, energy)
    return [*words, "compared"], found


def _among_all(
    oracle: Oracle, speeds: np.ndarray, forces: np.ndarray, at_start: list[str], found: list[Finding]
) -> list[str]:
    known = (np.round(speeds, 11) + 0.0).tobytes()
    if known not in oracle.sets:
        oracle.sets[known] = every_set(oracle, speeds)
    every = oracle.sets[known]
    if "jams" in at_start:
        if every and "impact" not in at_start:
            found.append(Finding("wrong", "it jams though a set contradicts nothing", f"{len(every)} of them"))
        return ["none"]
    fall = oracle.accelerations(speeds, forces).ravel()
    steep = _size(fall, G)
    if not any(np.max(np.abs(fall - one)) <= 1e-5 * steep for one in every):
        found.append(Finding("wrong", "its set is none of all", f"{len(every)} of them"))
    rests = [one for one in every if np.max(np.abs(one)) <= SMALL * steep]
    if not np.any(speeds) and rests and np.max(np.abs(fall)) > 1e-5 * steep:
        found.append(Finding("wrong", "it leaves its rest though it could stay", f"{len(every)} sets"))
    return ["one set" if len(every) == 1 else "several sets"]


def _refused(oracle: Oracle, before: np.ndarray, error: AtwoodError, form: str) -> tuple[list[str], list[Finding]]:
    said = str(error)
    if "t = 0 " not in said and "impact_law='poisson'" in said and _runs_by_poisson(oracle.draft, form):
        return ["refused: Newton's law has no impulses, Poisson's has"], []
    for words in ("how forces are shared", "would make energy"):
        if words in said:
            return [f"refused: {words}"], []
    if " at t = 0 " not in f" {said}" and "t = 0 " not in said:
        return ["refused later"], [Finding("refused", f"later: {type(error).__name__}", said)]
    is_impact = np.min(oracle.rates(before)[:, 0]) < -SMALL * _size(before)
    if oracle.draft.space == "space":
        if not is_impact and not every_set_in_space(oracle, before):
            return ["refused in space: no set"], []
        return ["refused in space"], [Finding("refused", f"{type(error).__name__} in space", said)]
    every = every_impact(oracle, before) if is_impact else every_set(oracle, before)
    if not every:
        return ["refused: no impact" if is_impact else "refused: no set"], []
    if is_impact and "impulses" not in said:
        return ["refused after an impact"], [Finding("refused", f"{type(error).__name__} after an impact", said)]
    return ["refused"], [Finding("refused", f"{type(error).__name__} though a set contradicts nothing", said)]


def _runs_by_poisson(draft: Draft, form: str) -> bool:
    """Return whether a scene, that Newton's law of impact leaves without impulses, runs by Poisson's."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return simulate(make(draft, "poisson"), form=form, t_end=END, rtol=1e-9, outputs=7).status == "finished"
    except AtwoodError:
        return False


def _read(draft: Draft, result: aw.Result) -> np.ndarray:
    """Work out all that is looked at in one pass; return the energy."""
    plane = draft.space == "plane"
    axes, spins = ("xz", "y") if plane else ("xyz", "xyz")
    moving = [f"velocity.{axis}" for axis in axes] + [f"angular_velocity.{axis}" for axis in spins]
    energies = ["kinetic_energy", "potential_energy"]
    bodies, places = range(len(draft.bodies)), range(len(draft.touches))
    touching = ["gap", "normal_force", *(f"force.{axis}" for axis in axes)]
    values = result.table(
        [f"b{k}.{name}" for k in bodies for name in moving + energies]
        + [f"c{i}.{name}" for i in places for name in touching]
    )
    return np.sum([values[f"b{k}.{name}"] for k in bodies for name in energies], axis=0)


def _taken(draft: Draft, oracle: Oracle, result: aw.Result) -> tuple[np.ndarray, np.ndarray]:
    """Return the speeds and the forces that Atwood has found for the start."""
    plane = draft.space == "plane"
    speeds = np.zeros((len(draft.bodies), 6))
    for k in range(len(draft.bodies)):
        for i, axis in enumerate("xyz"):
            if not (plane and axis == "y"):
                speeds[k, i] = result[f"b{k}.velocity.{axis}"][0]
            if not plane or axis == "y":
                speeds[k, 3 + i] = result[f"b{k}.angular_velocity.{axis}"][0]
    forces = []
    for i, one in enumerate(draft.touches):
        force = np.array([0.0 if plane and axis == "y" else result[f"c{i}.force.{axis}"][0] for axis in "xyz"])
        forces.append(oracle.directions(one) @ force)
    return speeds.ravel(), np.array(forces)


def _later(draft: Draft, result: aw.Result, energy: np.ndarray) -> list[Finding]:
    """Return what is wrong soon after the start."""
    found = []
    gap = min(float(np.min(result[f"c{i}.gap"])) for i in range(len(draft.touches)))
    if gap < -SMALL:
        found.append(Finding("wrong", "later a gap is negative", f"{gap:.3g}"))
    pull = min(float(np.min(result[f"c{i}.normal_force"])) for i in range(len(draft.touches)))
    if pull < -1e-6 * G * sum(one.mass for one in draft.bodies):
        found.append(Finding("wrong", "later a force pulls", f"{pull:.3g}"))
    if not any(one.belt for one in draft.touches) and np.max(np.diff(energy)) > 1e-7 * _size(energy):
        found.append(Finding("wrong", "later energy is made", f"{np.max(np.diff(energy)):.3g} J"))
    return found
