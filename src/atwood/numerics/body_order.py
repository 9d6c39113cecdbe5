"""In which order unknowns leave a sparse linear system, and bodies of a mechanism, with which constraints.

A body that hangs on one other alone couples nothing anew when it is eliminated together with the constraints of its
joint: its inertia is added to that of the other (R. Featherstone, *Rigid Body Dynamics Algorithms*, chapter 8). From
the ends of a tree to its root nothing is filled in. A constraint of a joint goes after the body that hangs on it, whose
masses then give it a pivot that is positive wherever the body is; one that closes a loop goes after all bodies of that
loop.
"""

from __future__ import annotations

import heapq
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import IndexArray
from atwood.lazy_dataclasses import dataclass


def neighbours_of(places: Iterable[tuple[int, int]], size: int) -> list[set[int]]:
    """Return for each unknown the others with which it has an entry of a matrix."""
    around: list[set[int]] = [set() for _ in range(size)]
    for i, j in places:
        if i != j:
            around[i].add(j)
            around[j].add(i)
    return around


def eliminated(around: Sequence[set[int]], i: int) -> set[int]:
    """Return the neighbours of an unknown that goes, which become neighbours of each other."""
    others = around[i]
    for a in others:
        around[a] |= others
        around[a] -= {a, i}
    return others


def by_least(around: Sequence[set[int]], key: Callable[[int], Any]) -> Iterator[int]:
    """Yield unknowns, which then go: always that of the least key.

    Parameters
    ----------
    around
        The neighbours of each, which change on the way; those of what has gone stay as they were when it went.
    key
        Says of an unknown, whenever it has got other neighbours, when its turn is; None if that has to wait.
    """
    heap = [(at, i) for i in range(len(around)) if (at := key(i)) is not None]
    heapq.heapify(heap)
    gone = set[int]()
    while heap:
        at, i = heapq.heappop(heap)
        if i in gone or at != key(i):
            continue
        gone.add(i)
        others = eliminated(around, i)
        yield i
        for a in others:
            if (at := key(a)) is not None:
                heapq.heappush(heap, (at, a))


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
    couples = {(i, j) for i, j in np.unique(np.sort(np.stack([a[apart], b[apart]]), axis=0), axis=1).T.tolist()}
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


def _order(joints: Sequence[_Joint], couples: set[tuple[int, int]], depth: Sequence[int], count: int) -> list[int]:
    """Return the bodies by how many others they are coupled with when their turn comes, the world included."""
    held = [0] * count
    for joint in joints:
        if len(joint.bodies) == 1:
            held[next(iter(joint.bodies))] = 1
        couples.update(combinations(sorted(joint.bodies), 2))
    around = neighbours_of(couples, count)
    order: list[int] = []
    for body in by_least(around, lambda one: (len(around[one]) + held[one], -depth[one])):
        order.append(body)
        if len(around[body]) == 1:
            held[next(iter(around[body]))] |= held[body]
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
