"""A motion and its inputs as unknowns, and the equations of motion as equations between them.

On each interval of a mesh the states at Gauss's points are unknowns, with those at the nodes; inputs are linear between
the nodes (J. T. Betts, Practical Methods for Optimal Control, 2nd edition, 2010; E. Hairer and G. Wanner, Solving
Ordinary Differential Equations II, section IV.5). With four points the order is eight.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import block_diag, coo_array, csr_array, eye_array, hstack, kron, vstack

from atwood.arrays import FloatArray, IndexArray
from atwood.lazy_dataclasses import dataclass
from atwood.study.optimal.points import PointFunctions

POINTS = 4


def gauss(count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return nodes, weights, and the matrix of integrals up to the nodes, on an interval of length one."""
    x, w = np.polynomial.legendre.leggauss(count)
    nodes, weights = 0.5 * (x + 1.0), 0.5 * w
    powers = np.arange(count)
    integrals = nodes[:, None] ** (powers + 1) / (powers + 1)
    return nodes, weights, integrals @ np.linalg.inv(nodes[:, None] ** powers)


@dataclass(frozen=True, eq=False)
class Task:
    """What is to be least, and under which conditions; in SI units.

    Attributes
    ----------
    motion
        Rates of coordinates and speeds, and last the integrand.
    ends, along
        Functions at the end, of which the last is added to the cost; functions that are bounded along the motion.
    targets
        Least and largest values of the functions at the end, without the last, shape (functions, 2).
    limits
        The same of those along the motion.
    inputs
        The same of the inputs.
    start
        The state at the start.
    begin, duration
        Time of the start, s; the least and the largest duration, s.
    sizes
        Of the states, the inputs and the duration.
    is_held
        Whether inputs are held between the nodes, and not linear.
    guessed, courses
        Functions along the motion that the search begins from, and rows of time and value of each.
    """

    motion: PointFunctions
    ends: PointFunctions
    along: PointFunctions
    targets: FloatArray
    limits: FloatArray
    inputs: FloatArray
    start: FloatArray
    begin: float
    duration: tuple[float, float]
    sizes: tuple[FloatArray, FloatArray, float]
    is_held: bool = False
    guessed: PointFunctions | None = None
    courses: tuple[FloatArray, ...] = ()


class Collocation:
    """The problem on a mesh, in scaled unknowns.

    Parameters
    ----------
    task
        What is to be least.
    mesh
        Ends of the intervals, from 0 to 1.
    """

    def __init__(self, task: Task, mesh: FloatArray) -> None:
        self.task, self.mesh = task, mesh
        self.nodes, self.weights, self.integrals = gauss(POINTS)
        self.n, self.m, self.count = len(task.start), len(task.inputs), len(mesh) - 1
        n, m, count = self.n, self.m, self.count
        states, inner = (count + 1) * n, count * POINTS * n
        bounded = count * len(task.limits)
        ends = len(task.targets)
        cuts = np.cumsum([states, inner, (count + 1) * m, 1, bounded, ends])
        self.total, self._cuts = int(cuts[-1]), cuts[:-1]
        self._matrices()
        sizes = task.sizes
        slack = [
            np.abs(np.where(np.isfinite(one), one, 0.0)).max(axis=1, initial=0.0) for one in (task.limits, task.targets)
        ]
        slack = [np.where(one > 0.0, one, 1.0) for one in slack]
        self.scale = np.concatenate(
            [
                np.tile(sizes[0], count + 1 + count * POINTS),
                np.tile(sizes[1], count + 1),
                [sizes[2]],
                np.tile(slack[0], count),
                slack[1],
            ]
        )
        free = np.full((states + inner, 2), [-np.inf, np.inf])
        free[:n] = task.start[:, None]
        inputs = np.tile(task.inputs, (count + 1, 1))
        if task.is_held:
            inputs[count * m :] = 0.0  # nothing reads it
        every = [free, inputs, np.array([task.duration])]
        every += [np.tile(task.limits, (count, 1)), task.targets]
        bounds = np.concatenate([one.reshape(-1, 2) for one in every]) / self.scale[:, None]
        self.fixed = bounds[:, 0] == bounds[:, 1]
        self._still = np.where(self.fixed, bounds[:, 0], 0.0)
        self.lower, self.upper = bounds[~self.fixed].T
        rows = [np.tile(sizes[0], count * (POINTS + 1)), np.tile(slack[0], count), slack[1]]
        self._rows = np.concatenate(rows)
        self.cost_size = 1.0  # by which the cost is divided

    def _matrices(self) -> None:
        """Make what is constant: which unknowns each point reads, and sums over points."""
        n, m, count, size = self.n, self.m, self.count, self.n + self.m + 1
        widths, one, held = np.diff(self.mesh), eye_array(n), self.task.is_held
        states, inner, inputs, _ = self._cuts[:4]
        points = count * POINTS
        at = np.repeat(np.arange(count), POINTS)
        share = np.tile(self.nodes, count)
        moments = self.mesh[at] + share * widths[at]

        def reads(row_state: IndexArray, left: IndexArray, share: FloatArray, moments: FloatArray) -> Any:
            """Return the matrix from unknowns to the states, inputs and times of points."""
            rows, columns, data = [], [], []
            number = np.arange(len(moments)) * size
            for i in range(n):
                rows.append(number + i)
                columns.append(row_state + i)
                data.append(np.ones(len(moments)))
            for i in range(m):
                rows += [number + n + i] * 2
                first, second = np.minimum(left, count - 1) if held else left, np.minimum(left + 1, count)
                columns += [inner + first * m + i, inner + second * m + i]
                data += [np.ones(len(share)), np.zeros(len(share))] if held else [1.0 - share, share]
            rows.append(number + n + m)
            columns.append(np.full(len(moments), inputs))
            data.append(moments)
            places = np.concatenate(rows), np.concatenate(columns)
            return csr_array(coo_array((np.concatenate(data), places), shape=(len(moments) * size, self.total)))

        self.inside = reads(states + np.arange(points) * n, at, share, moments)
        nodes = np.arange(1, count + 1)
        still = np.zeros(count)
        self.at_nodes = reads(nodes * n, nodes, still, self.mesh[1:])
        self.at_end = reads(nodes[-1:] * n, nodes[-1:], still[:1], self.mesh[-1:])
        stages = block_diag([kron(csr_array(width * self.integrals), one) for width in widths])
        sums = block_diag([kron(csr_array(width * self.weights[None, :]), one) for width in widths])
        self.sums = csr_array(vstack([stages, sums]))
        begins = kron(csr_array((np.ones(points), (np.arange(points), at)), shape=(points, count + 1)), one)
        steps = csr_array((count, count + 1)) + eye_array(count, count + 1, k=1) - eye_array(count, count + 1)
        rest = self.total - states - points * n
        self.linear = csr_array(
            vstack(
                [
                    hstack([-begins, eye_array(points * n), csr_array((points * n, rest))]),
                    hstack([kron(steps, one), csr_array((count * n, points * n + rest))]),
                ]
            )
        )
        self.quadrature = (widths[:, None] * self.weights).ravel()
        self.duration = int(inputs)
        slacks = np.arange(self._cuts[3], self.total)
        self.slacks = csr_array(
            (np.ones(len(slacks)), (np.arange(len(slacks)), slacks)), shape=(len(slacks), self.total)
        )

    def full(self, x: FloatArray) -> FloatArray:
        """Return all unknowns in SI units."""
        every = self._still.copy()
        every[~self.fixed] = x
        every *= self.scale
        return every

    def free(self, every: FloatArray) -> FloatArray:
        """Return the scaled unknowns that are free."""
        return np.asarray((every / self.scale)[~self.fixed])

    def parts(self, every: FloatArray) -> list[FloatArray]:
        """Return states at nodes and inside, inputs, duration, and slacks along the motion and at the end."""
        states, inner, inputs, *rest = np.split(every, self._cuts)
        driven = inputs.reshape(-1, self.m).copy()
        if self.task.is_held:
            driven[-1] = driven[-2]
        return [states.reshape(-1, self.n), inner.reshape(self.count, POINTS, self.n), driven, *rest]

    def points(self, reads: Any, every: FloatArray) -> FloatArray:
        """Return states, inputs and times of points, shape (points, size)."""
        found: FloatArray = (reads @ every).reshape(-1, self.n + self.m + 1)
        found[:, -1] += self.task.begin
        return found

    def values(self, x: FloatArray) -> tuple[float, FloatArray]:
        """Return the cost and what the equations miss, both scaled."""
        task, every = self.task, self.full(x)
        with np.errstate(all="ignore"):
            motion = task.motion.values(self.points(self.inside, every))
            ends = task.ends.values(self.points(self.at_end, every))[0]
            along = task.along.values(self.points(self.at_nodes, every)).ravel()
        span = every[self.duration]
        cost = span * float(self.quadrature @ motion[:, -1]) + ends[-1]
        misses = self.linear @ every - span * (self.sums @ motion[:, :-1].ravel())
        others = np.concatenate([along, ends[:-1]]) - self.slacks @ every
        return cost / self.cost_size, np.concatenate([misses, others]) / self._rows

    def slopes(self, x: FloatArray) -> tuple[FloatArray, Any]:
        """Return the gradient of the cost and the Jacobian of the equations."""
        task, every = self.task, self.full(x)
        inside, end = self.points(self.inside, every), self.points(self.at_end, every)
        motion, span = task.motion.values(inside), every[self.duration]
        first = task.motion.slopes(inside) @ self.inside
        rates, costs = self._sorted(first)
        gradient = span * (costs.T @ self.quadrature)
        gradient[self.duration] += self.quadrature @ motion[:, -1]
        ends = task.ends.slopes(end) @ self.at_end
        gradient = gradient + ends[-1:].toarray()[0]
        column = csr_array((self.sums @ motion[:, :-1].ravel())[:, None])
        along = csr_array((1, self.total)).tolil()
        along[0, self.duration] = 1.0
        misses = self.linear - span * (self.sums @ rates) - column @ csr_array(along)
        others = vstack([task.along.slopes(self.points(self.at_nodes, every)) @ self.at_nodes, ends[:-1]]) - self.slacks
        jacobian = csr_array(vstack([misses, others])).multiply(self.scale[None, :]).multiply(1.0 / self._rows[:, None])
        free = ~self.fixed
        return (gradient * self.scale / self.cost_size)[free], csr_array(jacobian)[:, free]

    def _sorted(self, rows: Any) -> tuple[Any, Any]:
        """Return rows of rates, and those of integrands."""
        rows = csr_array(rows)
        width = self.n + 1
        last = np.arange(rows.shape[0]) % width == width - 1
        return rows[~last], rows[last]

    def bends(self, x: FloatArray, multipliers: FloatArray) -> Any:
        """Return the second derivatives of the cost with the equations, each times its multiplier."""
        task, every = self.task, self.full(x)
        weights = multipliers / self._rows
        count = len(self.linear.indptr) - 1
        motion, along, ends = np.split(weights, [count, count + self.count * len(task.limits)])
        inside, span = self.points(self.inside, every), every[self.duration]
        own = np.empty((len(inside), self.n + 1))
        own[:, :-1] = -(self.sums.T @ motion).reshape(-1, self.n)
        own[:, -1] = self.quadrature / self.cost_size
        total = span * (self.inside.T @ task.motion.bends(inside, own) @ self.inside)
        mixed = self.inside.T @ (task.motion.slopes(inside).T @ own.ravel())
        place = np.full(self.total, self.duration), np.arange(self.total)
        cross = csr_array((mixed, place), shape=(self.total, self.total))
        total = total + cross + cross.T
        for functions, reads, given in (
            (task.along, self.at_nodes, along.reshape(self.count, -1)),
            (task.ends, self.at_end, np.append(ends, 1.0 / self.cost_size)[None, :]),
        ):
            total = total + reads.T @ functions.bends(self.points(reads, every), given) @ reads
        total = csr_array(total).multiply(self.scale[None, :]).multiply(self.scale[:, None])
        return csr_array(total)[:, ~self.fixed][~self.fixed]
