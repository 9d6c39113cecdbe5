"""The variational equations of a scene along its motion, solved step by step by collocation.

Deviations ``z = (ds, du)`` of displacements and speeds from a motion move by ``z' = A(t) z``, with A the derivative of
the equations of motion along the motion (Hairer, Norsett and Wanner, Solving ODEs I, section I.14). Collocation at the
s points of Gauss and Legendre has order 2 s (theorem II.7.8); steps are as long as the solver's are, or shorter. The
motion is taken apart where neighbouring motions do not move smoothly beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.errors import SolveError, UsageError
from atwood.forms.assembly import Assembly
from atwood.integrators.symplectic.gauss import tableau
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import Model
from atwood.pipeline import simulate, smooth_assembly_of
from atwood.result.result import Result
from atwood.simulation.dynamics.orientation_coordinates import to_regular
from atwood.simulation.run.recorder import SegmentRecord
from atwood.theory.linear.displacements import Minimal, find_minimal
from atwood.theory.linear.steady import pace_of
from atwood.theory.linear.variations import LinearScene

_SHARE = 0.1
"""Steps are begun with so many for each of the solver; they are halved where they are too long."""

_LOOKS = 20
"""The pace of a motion is that at so many times."""

_BLOCK = 5_000
"""The equations are evaluated at so many states at a time."""


@dataclass(frozen=True, eq=False)
class Deviations:
    """What the steps over a motion do to deviations from it.

    Attributes
    ----------
    motion
        The motion.
    scene
        The scene's equations at the start; names and sizes are the same all along.
    minimal
        Independent deviations at the start, and what follows from them.
    sizes
        What deviations of displacements and speeds are compared with: the scene's extent in m, 1 rad, and these times
        the pace at which things happen along the motion.
    edges, propagators
        The steps, s; and what they do, shape (steps, m, m).
    """

    motion: SmoothMotion
    scene: LinearScene
    minimal: Minimal
    sizes: FloatArray
    edges: FloatArray
    propagators: FloatArray

    @property
    def start(self) -> FloatArray:
        """Deviations of all displacements and speeds at the start by the independent ones, shape (m, columns)."""
        return self.minimal.state[:, : self.minimal.states]

    def equations(self) -> VariationalEquations:
        """Return the variational equations at the edges of the steps."""
        stretches = self.motion.stretches
        found = []
        for number, one in enumerate(stretches):
            last = number == len(stretches) - 1
            inside = (self.edges >= one.begin) & ((self.edges <= one.end) if last else (self.edges < one.end))
            found.append(_evaluated(self.motion, number, self.edges[inside]))
        names = [one.name for one in fields(VariationalEquations)]
        return VariationalEquations(**{name: np.concatenate([getattr(v, name) for v in found]) for name in names})


def _evaluated(motion: SmoothMotion, number: int, times: FloatArray) -> VariationalEquations:
    one = motion.stretches[number]
    return variational_equations(one.scene, one.kept, motion.states(number, times))


def find_deviations(scene: Model | Assembly, outputs: Any, tolerance: float, options: dict[str, Any]) -> Deviations:
    """Choose steps over the motion of a scene, and find what they do."""
    motion = SmoothMotion(scene, outputs, options)
    first = motion.stretches[0]
    states = motion.states(0, np.linspace(first.begin, first.end, _LOOKS))
    flows = [first.scene.flow(t, q, u, first.kept) for t, q, u in zip(states.time, states.q.T, states.u.T, strict=True)]
    pace = float(np.sqrt(np.mean([pace_of(first.scene, flow) ** 2 for flow in flows])))
    sizes = np.concatenate([first.scene.displacement_sizes, first.scene.sizes * pace])
    minimal = find_minimal(first.scene, flows[0], first.kept)
    steps = [_steps(motion, number, sizes, tolerance) for number in range(len(motion.stretches))]
    return Deviations(
        motion=motion,
        scene=first.scene,
        minimal=minimal,
        sizes=sizes,
        edges=np.concatenate([steps[0].edges, *(one.edges[1:] for one in steps[1:])]),
        propagators=np.concatenate([one.propagators for one in steps]),
    )


def _steps(motion: SmoothMotion, number: int, sizes: FloatArray, tolerance: float) -> Steps:
    """Return the steps over one stretch: begun with those that the solver took, cut at outputs."""
    one, result = motion.stretches[number], motion.result
    share = (one.end - one.begin) / (motion.stretches[-1].end - motion.stretches[0].begin)
    count = max(1, round(_SHARE * result.statistics.steps * share))
    times = result.time[(result.time > one.begin) & (result.time < one.end)]
    even = np.linspace(one.begin, one.end, count + 1)
    near = np.min(np.abs(even[1:-1, None] - times), axis=1, initial=np.inf) if count > 1 else np.zeros(0)
    edges = np.concatenate([[one.begin], times, even[1:-1][near > 0.25 * (one.end - one.begin) / count], [one.end]])

    def field(at: FloatArray) -> FloatArray:
        states: States = motion.states(number, at)
        blocks = range(0, len(at), _BLOCK)
        found = [variational_equations(one.scene, one.kept, states[k : k + _BLOCK]).matrix for k in blocks]
        return np.concatenate(found)

    return find_steps(field, np.unique(edges), sizes, tolerance, motion.assembly.flat.name)


@dataclass(frozen=True, eq=False)
class States:
    """States of a motion in generalized coordinates, one column for each time.

    Attributes
    ----------
    time
        s, shape (states,).
    q, u
        Coordinates and speeds, shape (number, states); orientations are quaternions.
    """

    time: FloatArray
    q: FloatArray
    u: FloatArray

    def __len__(self) -> int:
        return len(self.time)

    def __getitem__(self, index: slice | NDArray[np.intp]) -> States:
        return States(self.time[index], self.q[:, index], self.u[:, index])


@dataclass(frozen=True, eq=False)
class VariationalEquations:
    """The variational equations at some states.

    Attributes
    ----------
    matrix
        A, shape (states, displacements and speeds, displacements and speeds).
    mass
        The mass matrix, shape (states, speeds, speeds).
    by_displacement
        The derivative of the independent constraints on positions by displacements, shape (states, rows,
        displacements).
    rate_by_displacement, rate_by_speed
        Of all independent constraints on velocities by displacements and speeds, shape (states, rows, displacements)
        and (states, rows, speeds).
    """

    matrix: FloatArray
    mass: FloatArray
    by_displacement: FloatArray
    rate_by_displacement: FloatArray
    rate_by_speed: FloatArray


def variational_equations(scene: LinearScene, kept: Sequence[int], states: States) -> VariationalEquations:
    """Return the variational equations at some states."""
    flow, rows = scene.flow(states.time, states.q.T, states.u.T, kept), list(kept)
    now, size = flow.variation, flow.field.shape[-1]
    holding = [i for i in rows if scene.equations.constraints[i].holonomic]
    return VariationalEquations(
        matrix=flow.matrix[..., :size],
        mass=now.by["force", "a"],
        by_displacement=now.by["value", "q"][:, holding] @ now.basis,
        rate_by_displacement=now.by["rate", "q"][:, rows] @ now.basis,
        rate_by_speed=now.by["rate", "u"][:, rows],
    )


_HALVINGS = 16
"""A step is halved at most so often."""

_ROUNDING = 1e-13
"""Relative: what one step does is known no better."""


@dataclass(frozen=True, eq=False)
class Steps:
    """Steps one after another.

    Attributes
    ----------
    edges
        Where they begin and end, s, shape (steps + 1,).
    propagators
        What they do to deviations, shape (steps, m, m).
    """

    edges: FloatArray
    propagators: FloatArray


def find_steps(
    field: Callable[[FloatArray], FloatArray], edges: FloatArray, sizes: FloatArray, tolerance: float, where: str
) -> Steps:
    """Choose steps so that each does the same, within a tolerance, as two of half its length."""

    def taken(pieces: FloatArray) -> FloatArray:
        matrices = field(node_times(pieces).ravel())
        size = matrices.shape[-1]
        return propagators(matrices.reshape(len(pieces), POINTS, size, size), np.diff(pieces, axis=1)[:, 0])

    pending = np.stack([edges[:-1], edges[1:]], axis=1)
    whole = taken(pending)
    begun, done = [np.zeros(0)], [whole[:0]]
    for _ in range(_HALVINGS):
        middle = np.mean(pending, axis=1, keepdims=True)
        pieces = np.stack([np.hstack([pending[:, :1], middle]), np.hstack([middle, pending[:, 1:]])], axis=1)
        halves = taken(pieces.reshape(-1, 2)).reshape(len(pending), 2, *whole.shape[1:])
        composed = halves[:, 1] @ halves[:, 0]
        scaled = composed / sizes[:, None] * sizes
        missed = np.max(np.abs((composed - whole) / sizes[:, None] * sizes), axis=(1, 2))
        fine = missed <= max(tolerance, _ROUNDING) * np.max(np.abs(scaled), axis=(1, 2))
        begun.append(pending[fine, 0])
        done.append(composed[fine])
        if np.all(fine):
            break
        pending, whole = pieces[~fine].reshape(-1, 2), halves[~fine].reshape(-1, *whole.shape[1:])
    else:
        raise SolveError(
            f"neighbouring motions move too fast beside this one at t = {pending[0, 0]:.9g} s",
            where=where,
            advice="Let the motion end before, or ask for a larger rtol.",
        )
    order = np.argsort(np.concatenate(begun))
    return Steps(np.append(np.concatenate(begun)[order], edges[-1]), np.concatenate(done)[order])


POINTS = 6
"""In each step."""

_ENTRIES = 4_000_000
"""So many numbers of the equations of steps are held at a time."""


@cache
def _method() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the points c in a step from 0 to 1, the matrix a and the weights b of the method."""
    found = tableau(2 * POINTS)
    weights = np.array(found.weights)
    return np.array(found.nodes), np.array(found.shares) * weights, weights


def node_times(edges: FloatArray) -> FloatArray:
    """Return the times at which steps want to know A, shape (steps, points)."""
    points, _, _ = _method()
    return edges[:, :1] + np.diff(edges, axis=1) * points


def propagators(matrices: FloatArray, steps: FloatArray) -> FloatArray:
    """Return what steps do: z at the end of each from z at its start, shape (steps, m, m)."""
    _, a, b = _method()
    count, points, size, _ = matrices.shape
    found = np.empty((count, size, size))
    block = max(1, _ENTRIES // (points * size) ** 2)
    for first in range(0, count, block):
        own, length = matrices[first : first + block], steps[first : first + block]
        # K_i = A_i (1 + h sum_j a_ij K_j)
        whole = -(length[:, None, None, None, None] * a[:, None, :, None] * own[:, :, :, None, :])
        whole = whole.reshape(len(own), points * size, points * size)
        whole[:, range(points * size), range(points * size)] += 1.0
        rates = np.linalg.solve(whole, own.reshape(len(own), points * size, size)).reshape(own.shape)
        found[first : first + block] = np.eye(size) + length[:, None, None] * np.einsum("j,kjab->kab", b, rates)
    return found


@dataclass(frozen=True, eq=False)
class Stretch:
    """A part of a motion in which nothing jumps.

    Attributes
    ----------
    scene
        The scene's equations and their derivatives there.
    kept
        Independent constraints.
    begin, end
        s.
    """

    scene: LinearScene
    kept: tuple[int, ...]
    begin: float
    end: float


class SmoothMotion:
    """The motion of a scene, simulated again with other output times whenever states are asked for.

    Parameters
    ----------
    scene
        The scene, or an assembly of it.
    outputs
        Output times, or their number.
    options
        What else `atwood.simulate` is given.

    Raises
    ------
    UsageError
        If the form is not the reduced one, or the motion jumps on its way.
    SolveError
        If it does not get to its end.
    """

    def __init__(self, scene: Model | Assembly, outputs: Any, options: Mapping[str, Any]) -> None:
        self.assembly = smooth_assembly_of(scene)
        self._options = dict(options)
        if self.assembly.form != "reduced":
            raise UsageError(
                "deviations are those of generalized coordinates, and this assembly is of the dae form",
                where=self.assembly.flat.name,
                advice="Give the scene, or an assembly of the reduced form.",
            )
        self.result: Result = simulate(self.assembly, outputs=outputs, **self._options)
        _refuse_jumps(self.result)

    @cached_property
    def stretches(self) -> tuple[Stretch, ...]:
        """The stretches, in order; between two of them is a time event, at which the state does not jump."""
        found = []
        for segment in self.result.run.segments:
            scene = LinearScene(segment.assembly, "reduced")
            q = to_regular(segment.assembly, segment.coordinates[:, 0])
            begin, end = float(segment.time[0]), float(segment.time[-1])
            found.append(Stretch(scene, scene.rank(begin, q).kept, begin, end))
        return tuple(found)

    def states(self, number: int, times: FloatArray) -> States:
        """Return states in a stretch."""
        wanted, places = np.unique(times, return_inverse=True)
        result = simulate(self.assembly, outputs=wanted, samples=1, **self._options)
        _refuse_jumps(result)
        segment = result.run.segments[number]
        found = np.searchsorted(segment.time, wanted)
        if found[-1] >= len(segment.time) or not np.array_equal(segment.time[found], wanted):
            raise SolveError(
                "the motion did not come to the same times when it was simulated again",
                where=self.assembly.flat.name,
                advice="Run on one thread, or with a limit of steps that does not depend on time.",
            )
        q = _regular(segment)[:, found]
        return States(wanted, q, segment.speeds[:, found])[places]


def _regular(segment: SegmentRecord) -> FloatArray:
    """Return the coordinates of a segment with quaternions for orientations."""
    if segment.assembly.own_equations is segment.assembly.regular:
        return segment.coordinates
    return np.stack([to_regular(segment.assembly, q) for q in segment.coordinates.T], axis=1)


def _refuse_jumps(result: Result) -> None:
    where = result.assembly.flat.name
    if result.status != "finished":
        raise SolveError(f"the motion does not get to its end: {result.message}", where=where)
    jumps = [(one.time, one.describe()) for one in result.events if one.target or one.impact]
    jumps += [(one.time, f"at t = {one.time:.9g} s, a singular position") for one in result.singular_crossings]
    told = {time for time, _ in jumps}
    for one in result.run.segments[1:]:
        time = float(one.time[0])
        if (one.impact or not one.after_time_event) and time not in told:
            jumps.append((time, f"at t = {time:.9g} s, {'an impact' if one.impact else 'another mode'}"))
    if jumps:
        time, what = min(jumps)
        raise UsageError(
            f"neighbouring motions do not move smoothly beside this one: {what}",
            where=where,
            advice=f"Let it end before, with t_end below {time:.9g}.",
        )
