"""The oracle: Newton's and Euler's equations of all bodies in maximal coordinates, dense, with multipliers.

It shares no code with Atwood. Constraints enter by their rows on the speeds; second derivatives come from complex steps
along the motion; accelerations and multipliers are the least-norm solution of the linear system, so that redundant
constraints need no care; motions are integrated by DOP853 and projected at the times that are looked at.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import count, pairwise

import numpy as np
from scipy.integrate import solve_ivp

from .description import Array, Mechanism, Mount, Signal, Tie, cross_matrix, rotation
from .oracle_own import ALL_ROWS, GAPS, beyond, own_energy, own_force, wheel_inertia
from .oracle_parts import (
    GEARS,
    LOADED,
    FrameState,
    Row,
    applied,
    coordinates,
    friction,
    meshing,
    spring_energy,
    twist_in_plane,
)
from .trial import Discarded

STEP = 1e-30
"""The complex step; its square is nothing."""

CLEAR = 1e-7
"""Singular values of the scaled rows are zero below this, as a share of the largest; up to `POOR` they are unclear."""

POOR = 2e-3

AWAY = 1e-2
"""How far away a place is that tells whether the start is singular, in units of the open directions of the speeds."""

MOST_CALLS = 6_000
"""Evaluations of a motion beyond which it is too stiff for an explicit method: some forty times the ordinary."""


@dataclass(frozen=True)
class Place:
    """Where everything is: centres of mass and rotations, body by body; and angles with their turns, where known."""

    centers: Array
    rotations: Array
    turns: Mapping[tuple[str, str], float] | None = None


@dataclass
class Oracle:
    """The equations of a mechanism.

    Speeds are velocities of the centres of mass and angular velocities in world axes, as far as the mechanism's space
    has them. Angles that joints count are followed from one evaluation to the next.
    """

    mechanism: Mechanism
    _turns: dict[tuple[str, str], float] = field(default_factory=dict)
    _samples: list[tuple[float, dict[str, float]]] = field(default_factory=list)

    # -- what there is ----------------------------------------------------------------------------------------------

    @cached_property
    def _index(self) -> dict[str, int]:
        return {body.name: i for i, body in enumerate(self.mechanism.bodies)}

    @cached_property
    def columns(self) -> dict[str, tuple[slice, slice]]:
        """Where the speeds of a body are: its velocity, and its angular velocity."""
        found, n = {}, 0
        shifts, turns = self.directions.shape[1], self.turns.shape[1]
        for body in self.mechanism.bodies:
            more = 0 if body.is_point else turns
            found[body.name] = slice(n, n + shifts), slice(n + shifts, n + shifts + more)
            n += shifts + more
        return found

    @cached_property
    def size(self) -> int:
        """Number of speeds."""
        return max(turn.stop for _, turn in self.columns.values())

    @cached_property
    def directions(self) -> Array:
        """Directions in which bodies move, as columns."""
        eye = np.eye(3)
        return {"space": eye, "plane": eye[:, [0, 2]], "line": self.mechanism.line[:, None]}[self.mechanism.space]

    @cached_property
    def turns(self) -> Array:
        """Axes about which bodies turn, as columns."""
        eye = np.eye(3)
        return {"space": eye, "plane": eye[:, [1]], "line": eye[:, :0]}[self.mechanism.space]

    def start(self) -> tuple[Place, Array]:
        """Return where everything is at the start, and the speeds."""
        bodies = self.mechanism.bodies
        centers = np.array([body.position + body.rotation @ body.center for body in bodies])
        speeds = np.zeros(self.size)
        for body in bodies:
            shift, turn = self.columns[body.name]
            arm = body.rotation @ body.center
            speeds[shift] = self.directions.T @ (body.velocity + np.cross(body.spin, arm))
            if not body.is_point:
                speeds[turn] = self.turns.T @ body.spin
        return Place(centers, np.array([body.rotation for body in bodies])), speeds

    # -- motion of frames -------------------------------------------------------------------------------------------

    def velocities(self, speeds: Array) -> tuple[Array, Array]:
        """Return velocities of the centres and angular velocities, body by body."""
        v = np.array([self.directions @ speeds[shift] for shift, _ in self.columns.values()])
        spins = (speeds[turn] for _, turn in self.columns.values())
        return v, np.array([self.turns @ spin if len(spin) else np.zeros(3) for spin in spins])

    def frame(self, mount: Mount, place: Place) -> FrameState:
        """Return a mount's frame; what `place` holds may be complex."""
        if not mount.body:
            nothing = np.zeros((3, self.size))
            return FrameState(mount.position, mount.rotation, nothing, nothing)
        i = self._index[mount.body]
        shift, turn = self.columns[mount.body]
        arm = place.rotations[i] @ (mount.position - self.mechanism.bodies[i].center)
        v, w = np.zeros((3, self.size), dtype=arm.dtype), np.zeros((3, self.size))
        v[:, shift] = self.directions
        if turn.stop > turn.start:
            w[:, turn] = self.turns
            v[:, turn] = -cross_matrix(arm) @ self.turns
        return FrameState(place.centers[i] + arm, place.rotations[i] @ mount.rotation, v, w)

    # -- constraints ------------------------------------------------------------------------------------------------

    def _count(self, tie: str, name: str, angle: float, place: Place) -> float:
        """Return an angle with its turns: near where it was last, or near what is known of the place."""
        near = (self._turns if place.turns is None else place.turns).get((tie, name), angle)
        counted = float(angle + 2.0 * np.pi * np.round((near - angle) / (2.0 * np.pi)))
        if place.turns is None:
            self._turns[tie, name] = counted
        return counted

    def count_from(self, tie: str, name: str, angle: float) -> None:
        """Say how often a joint has been turned at the start."""
        self._turns[tie, name] = angle

    def coordinate(self, tie: Tie, name: str, place: Place) -> tuple[Array, Array]:
        """Return a coordinate of a joint, turns counted, and the row of its rate."""
        value, row = coordinates(tie, [self.frame(mount, place) for mount in tie.mounts])[name]
        return (self._count(tie.name, name, value, place) if "angle" in name else value), row

    def rows_of(self, tie: Tie, place: Place, t: complex) -> list[Row]:
        """Return the constraints of a tie in the directions that the space has."""
        if tie.sort in ALL_ROWS:
            return ALL_ROWS[tie.sort](tie, [self.frame(mount, place) for mount in tie.mounts], t)
        if tie.sort in GEARS:
            held = [self.coordinate(self.mechanism.tie(joint), name, place) for joint, name in tie.grips]
            return [meshing(tie, held)]
        return []

    @cached_property
    def _kept(self) -> dict[str, list[int]]:
        """Which constraints of each tie there are in the mechanism's space: in a plane many hold by themselves."""
        place, _ = self.start()
        rows = {tie.name: self.rows_of(tie, place, 0.0) for tie in self.mechanism.ties}
        return {
            name: [i for i, (_, row, _) in enumerate(own) if np.max(np.abs(row), initial=0.0) > 1e-9]
            for name, own in rows.items()
        }

    def owners(self) -> list[tuple[str, int]]:
        """Return the tie and the number of each constraint."""
        return [(name, i) for name, kept in self._kept.items() for i in kept]

    def constraints(self, place: Place, t: complex) -> tuple[Array, Array, Array]:
        """Return values, rows and derivatives by time of all constraints."""
        found = []
        for tie in self.mechanism.ties:
            kept = self._kept[tie.name]
            rows = self.rows_of(tie, place, t) if kept else []
            found += [rows[i] for i in kept]
        values = np.array([value for value, _, _ in found])
        matrix = np.array([row for _, row, _ in found]).reshape(len(found), self.size)
        return values, matrix, np.array([rate for _, _, rate in found])

    # -- forces -----------------------------------------------------------------------------------------------------

    def _energy_force(self, tie: Tie, frames: Sequence[FrameState], place: Place) -> Array | None:
        """Return the generalized force of a potential, by complex steps of both frames."""
        a, b = frames[0], frames[-1]
        if spring_energy(tie, a.p, a.axes, b.p, b.axes) is None:
            return None
        near, along = self._twist_near(tie, frames, place), self._sides.get(tie.name)
        total = np.zeros(self.size)
        for k in range(3):
            e = 1j * STEP * np.eye(3)[k]
            turn = np.eye(3) + cross_matrix(e)
            total -= spring_energy(tie, a.p + e, a.axes, b.p, b.axes, near, along).imag / STEP * a.v[k]
            total -= spring_energy(tie, a.p, a.axes, b.p + e, b.axes, near, along).imag / STEP * b.v[k]
            total -= np.imag(spring_energy(tie, a.p, turn @ a.axes, b.p, b.axes, near, along)) / STEP * a.w[k]
            total -= np.imag(spring_energy(tie, a.p, a.axes, b.p, turn @ b.axes, near, along)) / STEP * b.w[k]
        return total

    def _twist_near(self, tie: Tie, frames: Sequence[FrameState], place: Place) -> float | None:
        """Return the angle of a torsion spring or a bushing in a plane, turns counted; None elsewhere."""
        if self.mechanism.space != "plane" or tie.sort not in ("torsion_spring", "bushing"):
            return None
        return self._count(tie.name, "twist", twist_in_plane(tie, frames[0].axes, frames[1].axes), place)

    @cached_property
    def _sides(self) -> dict[str, Array]:
        """The direction from one end to the other of each spring on a line, at the start, which tells its sign."""
        if self.mechanism.space != "line":
            return {}
        place, line = self.start()[0], self.mechanism.line
        ends = {
            tie.name: [self.frame(mount, place).p for mount in tie.mounts]
            for tie in self.mechanism.ties
            if tie.sort == "spring"
        }
        return {name: line * np.sign(line @ (b - a)) for name, (a, b) in ends.items()}

    def _load(self, tie: Tie, place: Place, speeds: Array, t: float) -> Array:
        """Return what acts on the coordinates of a joint."""
        total = np.zeros(self.size)
        for name, (stiffness, natural, damping, motor) in LOADED.get(tie.sort, {}).items():
            push = tie.values[motor].at(t) if motor in tie.values else 0.0
            k, c = tie.values.get(stiffness, 0.0), tie.values.get(damping, 0.0)
            if k or c or push:
                value, row = self.coordinate(tie, name, place)
                total += (push - k * (value - tie.values.get(natural, 0.0)) - c * (row @ speeds)) * row
        if tie.sort in GAPS:
            value, row = self._gripped(tie, place)
            total -= tie.values["stiffness"] * beyond(tie, float(np.real(value))) * row
        return total

    def _gripped(self, tie: Tie, place: Place) -> tuple[Array, Array]:
        """Return the joint coordinate that a part holds, and the row of its rate."""
        joint, name = tie.grips[0]
        return self.coordinate(self.mechanism.tie(joint), name, place)

    def _command(self, tie: Tie, t: float) -> float:
        """Return what a feedback puts out, since the last sample that it took."""
        return next((held[tie.name] for since, held in reversed(self._samples) if since <= t), 0.0)

    def _sample(self, place: Place, speeds: Array, t: float) -> None:
        """Take up the commands of all feedbacks that are due."""
        held = dict(self._samples[-1][1]) if self._samples else {}
        v, _ = self.velocities(speeds)
        for tie in self.mechanism.ties:
            if tie.sort == "sampled" and abs(t / tie.values["period"] - round(t / tie.values["period"])) < 1e-9:
                i, axis = self._index[tie.mounts[0].body], tie.values["axis"]
                position = axis @ place.centers[i]
                held[tie.name] = -float(tie.values["stiffness"] * position + tie.values["damping"] * (axis @ v[i]))
        self._samples.append((t, held))

    def forces(self, place: Place, speeds: Array, t: float) -> Array:
        """Return the generalized forces of all that acts, weight included, constraints not."""
        total = np.zeros(self.size)
        down = np.array([0.0, 0.0, -self.mechanism.gravity])
        for body in self.mechanism.bodies:
            total[self.columns[body.name][0]] += body.mass * (self.directions.T @ down)
        for tie in self.mechanism.ties:
            frames = [self.frame(mount, place) for mount in tie.mounts]
            mass = tie.values.get("mass", 0.0) if tie.sort == "rod" else 0.0
            total += 0.5 * mass * sum((frame.v.T @ down for frame in frames), np.zeros(self.size)) if mass else 0.0
            total += self._load(tie, place, speeds, t)
            if tie.sort == "own_leak":
                total += tie.values["mass"].at(t) * (frames[0].v.T @ down)
            if tie.sort == "sampled":
                total += self._command(tie, t) * (frames[0].v.T @ tie.values["axis"])
            if frames:
                for one in (
                    friction(tie, frames, speeds),
                    applied(tie, frames, t),
                    own_force(tie, frames, speeds, t),
                    self._energy_force(tie, frames, place),
                ):
                    total += 0.0 if one is None else one
        return total

    def energy(self, place: Place, speeds: Array, t: float) -> tuple[float, float]:
        """Return the kinetic and the potential energy; that of springs on joints included."""
        mass, _ = self._inertia(place, speeds, t)
        potential = 0.0
        for i, body in enumerate(self.mechanism.bodies):
            potential += body.mass * self.mechanism.gravity * place.centers[i][2]
        for tie in self.mechanism.ties:
            frames = [self.frame(mount, place) for mount in tie.mounts]
            if tie.sort == "rod":
                potential += 0.5 * tie.values.get("mass", 0.0) * self.mechanism.gravity * sum(f.p[2] for f in frames)
            for name, (stiffness, natural, _, _) in LOADED.get(tie.sort, {}).items():
                if tie.values.get(stiffness):
                    stretch = self.coordinate(tie, name, place)[0] - tie.values.get(natural, 0.0)
                    potential += 0.5 * tie.values[stiffness] * stretch**2
            if tie.sort == "own_leak":
                potential += tie.values["mass"].at(t) * self.mechanism.gravity * frames[0].p[2]
            if tie.sort in GAPS:
                depth = beyond(tie, float(np.real(self._gripped(tie, place)[0])))
                potential += 0.5 * tie.values["stiffness"] * depth**2
            if frames:
                potential += own_energy(tie, frames, t)
                a, b = frames[0], frames[-1]
                near, along = self._twist_near(tie, frames, place), self._sides.get(tie.name)
                potential += spring_energy(tie, a.p, a.axes, b.p, b.axes, near, along) or 0.0
        return 0.5 * float(speeds @ mass @ speeds), float(potential)

    # -- equations of motion ----------------------------------------------------------------------------------------

    def _moving(self, place: Place, speeds: Array) -> Place:
        """Return a place that goes on by a complex step of time."""
        v, w = self.velocities(speeds)
        turned = [now + 1j * STEP * (cross_matrix(spin) @ now) for spin, now in zip(w, place.rotations, strict=True)]
        return Place(place.centers + 1j * STEP * v, np.array(turned), place.turns)

    def _inertia(self, place: Place, speeds: Array, t: float) -> tuple[Array, Array]:
        """Return the mass matrix and the inertial forces that depend on speeds."""
        mass, bias = np.zeros((self.size, self.size)), np.zeros(self.size)
        _, spins = self.velocities(speeds)
        for i, body in enumerate(self.mechanism.bodies):
            shift, turn = self.columns[body.name]
            mass[shift, shift] = body.mass * np.eye(self.directions.shape[1])
            if body.inertia is not None and turn.stop > turn.start:
                tensor = place.rotations[i] @ body.inertia @ place.rotations[i].T
                mass[turn, turn] = self.turns.T @ tensor @ self.turns
                bias[turn] = self.turns.T @ np.cross(spins[i], tensor @ spins[i])
        moving = self._moving(place, speeds)
        for tie in self.mechanism.ties:
            if tie.sort == "rod" and tie.values.get("mass"):
                a, b = (self.frame(mount, moving).v for mount in tie.mounts)
                for one, other, share in ((a, a, 3), (a, b, 6), (b, a, 6), (b, b, 3)):
                    m = tie.values["mass"] / share
                    mass += m * one.real.T @ other.real
                    bias += m * one.real.T @ (np.imag(other) / STEP @ speeds)
            if tie.sort == "own_leak":
                m, v = tie.values["mass"].at(t), self.frame(tie.mounts[0], moving).v
                mass += m * v.real.T @ v.real
                bias += m * v.real.T @ (np.imag(v) / STEP @ speeds)
            if tie.sort == "own_flywheel":
                angle, row = self._gripped(tie, moving)
                moment, slope = wheel_inertia(tie, float(np.real(angle)))
                rate = float(row.real @ speeds)
                mass += moment * np.outer(row.real, row.real)
                bias += (moment * float(np.imag(row) / STEP @ speeds) + 0.5 * slope * rate * rate) * row.real
        return mass, bias

    def accelerations(self, place: Place, speeds: Array, t: float) -> tuple[Array, Array]:
        """Return accelerations and multipliers, both of least norm where they are not unique."""
        mass, bias = self._inertia(place, speeds, t)
        _, rows, rates = self.constraints(self._moving(place, speeds), t + 1j * STEP)
        matrix = rows.real
        n, m = self.size, len(matrix)
        missing = np.imag(rows) / STEP @ speeds + np.imag(rates) / STEP
        whole = np.block([[mass, -matrix.T], [matrix, np.zeros((m, m))]])
        right = np.concatenate([self.forces(place, speeds, t) - bias, -missing])
        scale = 1.0 / np.sqrt(np.concatenate([np.diag(mass), np.ones(m)]))
        scaled = scale[:, None] * whole * scale
        if self.rank == m:
            found = np.linalg.solve(scaled, scale * right) * scale
        else:
            found = np.linalg.lstsq(scaled, scale * right, rcond=1e-9)[0] * scale
        return found[:n], found[n:]

    def _finite_accelerations(self, place: Place, speeds: Array, t: float) -> Array:
        """Return accelerations, or discard the trial where a law has no value, as a twist of opposed axes."""
        with np.errstate(divide="ignore", invalid="ignore"), contextlib.suppress(np.linalg.LinAlgError):
            found, _ = self.accelerations(place, speeds, t)
            if np.all(np.isfinite(found)):
                return found
        raise Discarded("the oracle has no value on the way")

    # -- rank -------------------------------------------------------------------------------------------------------

    def singular_values(self, place: Place, t: float = 0.0) -> Array:
        """Return the singular values of the rows, each row and each speed scaled by its own size."""
        _, rows, _ = self.constraints(place, t)
        if not len(rows):
            return np.zeros(0)
        scaled = rows.real / np.sqrt(np.diag(self._inertia(place, np.zeros(self.size), t)[0]))
        return np.linalg.svd(scaled / np.linalg.norm(scaled, axis=1)[:, None], compute_uv=False)

    @cached_property
    def rank(self) -> int:
        """Rank of the constraints at the start."""
        values = self.singular_values(self.start()[0])
        return int(np.sum(values > CLEAR * values[0])) if len(values) else 0

    @cached_property
    def is_clear(self) -> bool:
        """Whether the rank at the start is beyond doubt."""
        values = self.singular_values(self.start()[0])
        return not np.any((values > 1e-3 * CLEAR) & (values < POOR))

    @cached_property
    def starts_singular(self) -> bool:
        """Whether the start is a singular position: where rows depend on others there that do not near by."""
        place, speeds = self.start()
        _, rows, _ = self.constraints(place, 0.0)
        if self.rank == len(rows) or self.rank == self.size:
            return False
        open_ways = np.linalg.svd(rows.real)[2][self.rank :]
        way = np.sin(np.arange(1.0, len(open_ways) + 1.0)) @ open_ways
        nearby = self._stepped(place, AWAY * way / np.linalg.norm(way))
        nearby, _ = self.project(nearby, speeds, 0.0)
        values = self.singular_values(nearby)
        missed = np.max(np.abs(self.constraints(nearby, 0.0)[0]), initial=0.0)
        return bool(missed > 1e-10 or np.sum(values > CLEAR * values[0]) != self.rank)

    def is_singular_on_the_way(self, times: Array) -> bool:
        """Return whether the motion comes to a singular position, as far as steps at these times tell."""
        try:
            states = self.run(times, 1e-10)
        except (ArithmeticError, Discarded):
            return True
        least = [self.singular_values(place, t)[self.rank - 1] for (place, _), t in zip(states, times, strict=True)]
        return bool(self.rank and min(least) < 0.1 * least[0])

    def missed(self) -> float:
        """Return by how much the start misses a constraint at most, in position or in velocity."""
        place, speeds = self.start()
        values, rows, rates = self.constraints(place, 0.0)
        return float(np.max(np.abs([values, rows @ speeds + rates]), initial=0.0))

    def contradiction(self, later: tuple[float, ...]) -> float:
        """Return by how much constraints that follow from others ask for other velocities or accelerations than these.

        Where the mechanism is at its start, and at later times as if it were still there: prescribed motions may bend.
        """
        place, speeds = self.start()
        _, rows, rates = self.constraints(self._moving(place, speeds), 1j * STEP)
        directions, sizes, _ = np.linalg.svd(rows.real)
        follow = directions[:, int(np.sum(sizes > CLEAR * np.max(sizes, initial=0.0))) :].T
        asked = [follow @ (np.imag(rows) @ speeds + np.imag(rates)) / STEP]
        asked += [follow @ np.real(self.constraints(place, t)[2]) for t in later]
        return max(float(np.max(np.abs(one), initial=0.0)) for one in asked)

    # -- motion -----------------------------------------------------------------------------------------------------

    def project_speeds(self, place: Place, speeds: Array, t: float = 0.0) -> Array:
        """Return the nearest speeds that meet the constraints."""
        _, rows, rates = self.constraints(place, t)
        if not len(rows):
            return speeds
        missed = rows.real @ speeds + rates.real
        return speeds - np.linalg.lstsq(rows.real, missed, rcond=CLEAR)[0]

    def project(self, place: Place, speeds: Array, t: float) -> tuple[Place, Array]:
        """Return the nearest state that meets the constraints."""
        for _ in range(4):
            values, rows, _ = self.constraints(place, t)
            if not len(values) or np.max(np.abs(values)) < 1e-13:
                break
            place = self._stepped(place, -np.linalg.lstsq(rows.real, values.real, rcond=CLEAR)[0])
        return place, self.project_speeds(place, speeds, t)

    def _stepped(self, place: Place, step: Array) -> Place:
        v, w = self.velocities(step)
        turned = [turn(spin) @ now for spin, now in zip(w, place.rotations, strict=True)]
        return Place(place.centers + v, np.array(turned), place.turns)

    def reactions(self, place: Place, speeds: Array, t: float) -> dict[str, tuple[Array, Array, Array]]:
        """Return, for each joint, its multipliers, the force and torque on frame b, and which of these are unique.

        The torque is about the origin of frame b. Multipliers and what is unique of them are by number of constraint,
        with nan for those that the space does not have. Uniqueness is of force (3), torque (3), multipliers.
        """
        _, multipliers = self.accelerations(place, speeds, t)
        _, rows, _ = self.constraints(place, t)
        u, values, _ = np.linalg.svd(rows.real) if len(rows) else (np.zeros((0, 0)), np.zeros(0), None)
        free = u[:, int(np.sum(values > CLEAR * values[0])) :] if len(values) else u
        found, n = {}, 0
        for tie in self.mechanism.ties:
            kept = self._kept[tie.name]
            if kept and tie.sort in ALL_ROWS:
                loads = self._loads_on_b(tie, place, t)
                whole = np.zeros((len(loads), len(kept)))
                whole[kept] = np.eye(len(kept))
                stack = np.vstack([loads.T @ whole, whole])
                own = multipliers[n : n + len(kept)]
                is_unique = np.max(np.abs(stack @ free[n : n + len(kept)]), axis=1, initial=0.0) < 1e-6
                said = np.full(len(loads), np.nan)
                said[kept] = own
                found[tie.name] = said, stack[:6] @ own, is_unique
            n += len(kept)
        return found

    def _loads_on_b(self, tie: Tie, place: Place, t: float) -> Array:
        """Return the force and torque on frame b, in a row of six for each constraint, of a multiplier of one."""
        frames, six = [self.frame(mount, place) for mount in tie.mounts], np.eye(6)
        none = [FrameState(frame.p, frame.axes, six[:3] * 0.0, six[3:] * 0.0) for frame in frames]
        none[-1] = FrameState(frames[-1].p, frames[-1].axes, six[:3], six[3:])
        return np.array([np.real(row) for _, row, _ in ALL_ROWS[tie.sort](tie, none, t)])

    def _pieces(self, since: float, until: float) -> list[float]:
        """Return the times between which the motion is smooth, first and last included."""
        marks = {time for tie in self.mechanism.ties for time in _marks(tie, until)}
        return [since, *sorted(time for time in marks if since < time < until), until]

    def run(self, times: Array, rtol: float = 1e-11) -> list[tuple[Place, Array]]:
        """Return the states at given times, of which the first is the start's; at an event a time is there twice."""
        times, places = np.unique(times, return_inverse=True)
        place, speeds = self.start()
        shape = place.centers.shape

        calls = count()

        def rates(t: float, y: Array) -> Array:
            if next(calls) > MOST_CALLS:
                raise Discarded("too stiff for the oracle")
            here, speeds = _unpack(y, shape)
            v, w = self.velocities(speeds)
            turning = np.array([cross_matrix(spin) @ now for spin, now in zip(w, here.rotations, strict=True)])
            a = self._finite_accelerations(here, speeds, t)
            return np.concatenate([v.ravel(), turning.ravel(), a])

        began = dict(self._turns)
        fine = np.unique(np.concatenate([np.linspace(p, q, 11) for p, q in pairwise(times)]))
        y = np.concatenate([place.centers.ravel(), place.rotations.ravel(), speeds])
        columns = [y]
        self._samples = []
        for since, until in pairwise(self._pieces(float(times[0]), float(times[-1]))):
            self._sample(*_unpack(y, shape), since)
            inside = fine[(fine > since) & (fine <= until)]
            at = np.unique(np.append(inside, until))
            done = solve_ivp(rates, (since, until), y, method="DOP853", t_eval=at, rtol=rtol, atol=rtol)
            if not done.success:
                raise ArithmeticError(f"the oracle's integration fails: {done.message}")
            y = done.y[:, -1]
            columns += list(done.y.T[: len(inside)])
        states = []
        self._turns = began
        for i, (t, column) in enumerate(zip(fine, columns, strict=True)):
            place, speeds = _unpack(column, shape)
            self.forces(place, speeds, float(t))  # counts turns
            if i % 10 == 0:
                place = replace(_orthogonal(place), turns=dict(self._turns))
                states.append(self.project(place, speeds, float(t)))
        return [states[k] for k in places]


def _marks(tie: Tie, until: float) -> list[float]:
    """Return the times before which something of a part is smooth: kinks of functions, and samples."""
    found = [value.kink for value in tie.values.values() if isinstance(value, Signal) and value.jump]
    if tie.sort == "sampled":
        found += [float(time) for time in np.arange(0.0, until, tie.values["period"])]
    return found


def _unpack(y: Array, shape: tuple[int, ...]) -> tuple[Place, Array]:
    n = shape[0]
    return Place(y[: 3 * n].reshape(n, 3), y[3 * n : 12 * n].reshape(n, 3, 3)), y[12 * n :]


def _orthogonal(place: Place) -> Place:
    u, _, v = np.linalg.svd(place.rotations)
    return replace(place, rotations=u @ v)


def turn(vector: Array) -> Array:
    """Return the rotation of a rotation vector."""
    angle = float(np.linalg.norm(vector))
    return rotation(vector / angle, angle) if angle > 0.0 else np.eye(3)
