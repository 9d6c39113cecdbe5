"""In which order the bodies of a mechanism leave a sparse linear system, and which constraints go with them.

A body that hangs on one other alone couples nothing anew when it is eliminated together with the constraints of its
joint: its inertia is added to that of the other (R. Featherstone, *Rigid Body Dynamics Algorithms*, chapter 8). From
the ends of a tree to its root nothing is filled in. A constraint of a joint goes after the body that hangs on it, whose
masses then give it a pivot that is positive wherever the body is; one that closes a loop goes after all bodies of that
loop.
"""

from __future__ import annotations

import heapq
from collections import defaultdict
from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import IndexArray
from atwood.lazy_dataclasses import dataclass


@dataclass(frozen=True)
class Stage:
    """Unknowns that are eliminated together.

    Attributes
    ----------
    body
        The unknowns of a body.
    constraints
        Multipliers that go after it.
    """

    body: tuple[int, ...]
    constraints: tuple[int, ...]


class _Joint:
    """Constraints that act on the same bodies."""

    def __init__(self, bodies: frozenset[int]) -> None:
        self.bodies = bodies
        self.multipliers: list[int] = []
        self.last: int | None = None  # the body after which they go


def elimination_stages(
    rows: IndexArray, columns: IndexArray, equations: NDArray[np.intp], bodies: NDArray[np.intp]
) -> list[Stage]:
    """Return the stages of an elimination, from the ends of trees to their roots."""
    of_row = np.empty_like(bodies)
    of_row[equations] = bodies
    joints, by_multiplier = _joints(rows, columns, equations, bodies, of_row)
    a, b = of_row[rows], bodies[columns]
    apart = (a >= 0) & (b >= 0) & (a != b)
    couples = {tuple(pair) for pair in np.unique(np.sort(np.stack([a[apart], b[apart]]), axis=0), axis=1).T.tolist()}
    count = int(bodies.max(initial=-1)) + 1
    depth, parent = _hang(joints, count)
    order = _order(joints, couples, depth, count)
    place = {body: k for k, body in enumerate(order)}
    for joint in joints:
        if joint.last is None:
            joint.last = max(_loop(joint.bodies, depth, parent), key=lambda body: place[body], default=None)
    members: list[list[int]] = [[] for _ in range(count)]
    for unknown, body in enumerate(bodies.tolist()):
        if body >= 0:
            members[body].append(unknown)
    after: dict[int, list[int]] = defaultdict(list)
    for multiplier, joint in by_multiplier.items():
        if joint.last is not None:
            after[joint.last].append(multiplier)
    return [Stage(tuple(members[body]), tuple(sorted(after[body]))) for body in order]


def _joints(
    rows: IndexArray,
    columns: IndexArray,
    equations: NDArray[np.intp],
    bodies: NDArray[np.intp],
    of_row: NDArray[np.intp],
) -> tuple[list[_Joint], dict[int, _Joint]]:
    touched: dict[int, set[int]] = {unknown: set() for unknown in np.flatnonzero(bodies < 0).tolist()}
    unknown_of_row = np.empty_like(equations)
    unknown_of_row[equations] = np.arange(len(equations))
    for across, along, of_across in ((rows, columns, bodies), (columns, rows, of_row)):
        multipliers = unknown_of_row[across] if across is rows else across
        here = (bodies[multipliers] < 0) & (of_across[along] >= 0)
        for multiplier, body in zip(multipliers[here].tolist(), of_across[along][here].tolist(), strict=True):
            touched[multiplier].add(body)
    found: dict[frozenset[int], _Joint] = {}
    by_multiplier = {}
    for multiplier, around in touched.items():
        key = frozenset(around)
        joint = by_multiplier[multiplier] = found.setdefault(key, _Joint(key))
        joint.multipliers.append(multiplier)
    return list(found.values()), by_multiplier


def _hang(joints: Sequence[_Joint], count: int) -> tuple[list[int], list[int]]:
    """Say on which joint each body hangs, nearest to the world first; return depths and bodies that they hang on."""
    around: list[list[_Joint]] = [[] for _ in range(count)]
    for joint in joints:
        for body in joint.bodies:
            around[body].append(joint)
    depth, parent = [-1] * count, [-1] * count
    queue = [joint for joint in joints if len(joint.bodies) == 1]
    roots = iter(range(count))
    while True:
        for joint in queue:  # which grows
            new = [body for body in joint.bodies if depth[body] < 0]
            if len(new) != 1:
                continue
            (body,) = new
            known = joint.bodies - {body}
            parent[body] = max(known, key=lambda one: (depth[one], -one), default=-1)
            depth[body] = depth[parent[body]] + 1 if known else 1
            joint.last = body
            queue += around[body]
        root = next((body for body in roots if depth[body] < 0), None)
        if root is None:
            return depth, parent
        depth[root] = 0
        queue = list(around[root])


def _order(joints: Sequence[_Joint], couples: set[tuple[int, ...]], depth: Sequence[int], count: int) -> list[int]:
    """Return the bodies by how many others they are coupled with when their turn comes, the world included."""
    around: list[set[int]] = [set() for _ in range(count)]
    held = [0] * count
    for joint in joints:
        if len(joint.bodies) == 1:
            held[next(iter(joint.bodies))] = 1
        couples.update(combinations(sorted(joint.bodies), 2))
    for one, other in couples:
        around[one].add(other)
        around[other].add(one)
    heap = [(len(around[body]) + held[body], -depth[body], body) for body in range(count)]
    heapq.heapify(heap)
    gone, order = [False] * count, []
    while heap:
        degree, _, body = heapq.heappop(heap)
        if gone[body] or degree != len(around[body]) + held[body]:
            continue
        gone[body] = True
        order.append(body)
        others = around[body]
        for other in others:
            around[other] |= others
            around[other] -= {other, body}
            held[other] |= held[body] if len(others) == 1 else 0
            heapq.heappush(heap, (len(around[other]) + held[other], -depth[other], other))
    return order


def _loop(bodies: frozenset[int], depth: Sequence[int], parent: Sequence[int]) -> set[int]:
    """Return the bodies of the loop that a joint closes: those between its own along the tree."""
    found, ends = set(bodies), set(bodies)
    while len(ends) > 1:
        deepest = max(ends, key=lambda body: (depth[body], body))
        ends.remove(deepest)
        if parent[deepest] >= 0:
            ends.add(parent[deepest])
            found.add(parent[deepest])
    return found
