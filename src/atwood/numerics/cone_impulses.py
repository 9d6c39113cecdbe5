"""Impulses of many contacts: a normal one that only pushes, and friction within Coulomb's cone.

Each contact has ``0 <= p_n``, ``w_n - b >= 0``, ``p_n (w_n - b) = 0`` and ``|p_t| <= mu p_n`` with p_t against w_t:
they are zeros of ``p - P(p - (w - b)/D)`` with the projection P onto the cone and any D > 0 (P. Alart, A. Curnier,
Computer Methods in Applied Mechanics and Engineering 92, 1991). They are solved one after the other, there and back:
Gauss and Seidel's method, projected (M. Jean 1999; V. Acary, B. Brogliato 2008, section 13.7), as machine code. Of few
contacts Newton's method then finds the zero, with slopes of P on either side of its edges, where it leads nearer. In a
plane a body has three speeds and a contact one direction of slip, in space six and two.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import Built, RoutineSource, build_code, once
from atwood.codegen.llvm.module import CodeOptions
from atwood.codegen.routines import ADDRESS, INTEGER, NUMBER, Routine, Value
from atwood.numerics.matrices import least_norm, or_one

_SWEEPS, _EACH = 5, 2000
"""What is missing is looked at after so many sweeps, there and back, or so many contacts."""

_LEAST, _WORK, _TURNS = 200_000, 2_000_000, 50
"""Contacts that are solved at least, unless nothing is missing, and at most, or so many looks."""

_ROUTINE = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_int64, ctypes.c_int64, ctypes.c_double, *[ctypes.c_void_p] * 5)

_FEW, _TRIES, _HALVED = 24, 20, 6
"""Of so many contacts at most Newton's method is tried, with so many steps, each halved so often at most."""

_SHAPES = ((2, 3), (3, 6))
"""Rows of a contact and speeds of a body, in a plane and in space."""

_ROUNDED = 1e-13
"""Of a speed: what is missed by less is rounding."""


class Touches(NamedTuple):
    """Contacts of bodies with each other and with walls.

    Attributes
    ----------
    bodies
        Of each contact the numbers of the body and of what it touches, shape (2, contacts); the last is the world.
    slopes
        How the rates of each contact, that of opening first and then those of slip, follow from the speeds of both,
        shape (2, contacts, rows, speeds of a body).
    inverse
        Inverse mass matrices of each body and of the world, shape (bodies + 1, speeds, speeds).
    friction
        Coefficient of friction.
    """

    bodies: NDArray[np.intp]
    slopes: FloatArray
    inverse: FloatArray
    friction: float

    def rates(self, v: FloatArray) -> FloatArray:
        """Return how fast contacts open, and slip, at speeds of all bodies, shape (rows, contacts)."""
        return np.asarray(np.einsum("scrk,sck->rc", self.slopes, v[self.bodies]))

    @property
    def moves(self) -> FloatArray:
        """The speeds of both bodies by a unit of each impulse, shaped as the slopes."""
        return np.asarray(self.slopes @ self.inverse[self.bodies])

    def compliance(self, moves: FloatArray) -> FloatArray:
        """Return how the rates change by a unit of their own impulses, and slips at most, shape (2, contacts)."""
        own = np.einsum("scrk,scqk->crq", self.slopes, moves)
        slip = own[:, 1:, 1:]
        largest = slip[:, 0, 0] if slip.shape[1] == 1 else np.linalg.eigvalsh(slip)[:, -1]
        return or_one(np.array([own[:, 0, 0], largest]))


def _projected(p: FloatArray, friction: float) -> FloatArray:
    normal = np.maximum(p[0], 0.0)
    size, most = np.sqrt(np.sum(p[1:] ** 2, axis=0)), friction * normal
    return np.concatenate([normal[None], p[1:] * np.where(size > most, most / or_one(size), 1.0)])


def impulses(
    touches: Touches, free: FloatArray, least: FloatArray, guess: FloatArray, small: float, large: float
) -> tuple[FloatArray, FloatArray, float]:
    """Return the speeds of all bodies, the impulses, and by which speed the laws are missed.

    Parameters
    ----------
    touches
        The contacts.
    free
        Speeds without impulses, shape (bodies + 1, speeds).
    least
        With which speeds contacts open at least.
    guess
        Impulses to begin with, shape (rows, contacts).
    small, large
        A speed that is as good as none, and one for which ten times as much is done before it is left.
    """
    moves = touches.moves
    compliance = touches.compliance(moves)
    nothing = _ROUNDED * float(np.max(np.abs(free)))
    own, (_, count, rows, speeds) = _projected(guess, touches.friction).T.copy(), touches.slopes.shape
    both = [np.moveaxis(one, 0, 1).reshape(count, -1) for one in (touches.slopes, moves)]
    table = np.concatenate([np.stack([least, *compliance], axis=1), *both], axis=1)
    index = np.ascontiguousarray(speeds * touches.bodies.T, dtype=np.int64)
    sweep, look = (_ROUTINE(_code().code.addresses[f"{name}_{rows}"]) for name in ("sweeps", "look"))
    v, squares = np.empty_like(free), np.empty(1)

    def missed_by(p: FloatArray) -> float:
        """Return by which speed the laws are missed, in quadratic mean over the contacts; v are the speeds then."""
        v[:] = free
        look(count, 1, touches.friction, *(one.ctypes.data for one in (index, table, v, p, squares)))
        return float(np.sqrt(squares[0] / count))

    missed = missed_by(own)
    done, looks, sweeps = 0, 0, max(_SWEEPS, _EACH // count)
    most = max(_WORK, 2 * _TURNS * sweeps * count)
    while missed > nothing and not (missed <= small and done >= _LEAST):
        sweep(count, sweeps, touches.friction, *(one.ctypes.data for one in (index, table, v, own, squares)))
        missed, done, looks = missed_by(own), done + 2 * sweeps * count, looks + 1
        if missed > nothing and count <= _FEW and looks & (looks - 1) == 0:  # ever more seldom
            wanted = touches.rates(free)
            wanted[0] -= least
            nearer = _nearer(touches, moves, wanted, own.T, compliance).T.copy()
            found = missed_by(nearer)
            own, missed = (nearer, found) if found < missed else (own, missed_by(own))
        if done >= most * (1 if missed <= large else 10):
            break
    return v, own.T, missed


def _nearer(touches: Touches, moves: FloatArray, free: FloatArray, p: FloatArray, compliance: FloatArray) -> FloatArray:
    """Return impulses by Newton's method, of least norm where contacts repeat each other."""
    rows, count = p.shape
    size, mu = rows * count, touches.friction
    bodies, numbers = np.unique(touches.bodies, return_inverse=True)
    speeds = moves.shape[3]
    both = np.zeros((2, count, rows, len(bodies), speeds))
    for k, (slope, move) in enumerate(zip(touches.slopes, moves, strict=True)):
        place = numbers.reshape(2, count)[k]
        both[0, np.arange(count), :, place] += slope
        both[1, np.arange(count), :, place] += move
    one, other = both.reshape(2, size, -1)
    response, start = (one @ other.T).reshape(count, rows, size), free.T
    each = compliance[[0] + [1] * (rows - 1)].T
    unit = np.eye(size).reshape(count, rows, size)

    def missed(given: FloatArray) -> tuple[FloatArray, FloatArray]:
        ahead = given - (response @ given.ravel() + start) / each
        return (given - _projected(ahead.T, mu).T) * each, ahead

    now, (gap, ahead) = p.T.copy(), missed(p.T)
    for _ in range(_TRIES):
        slopes = unit - response / each[:, :, None]
        normal, slip = ahead[:, 0], ahead[:, 1:]
        length = np.sqrt(np.sum(slip**2, axis=1))
        pressed, slides = normal > 0.0, length > mu * np.maximum(normal, 0.0)
        way = slip / or_one(length)[:, None]
        turned = slopes[:, 1:] - way[:, :, None] * np.einsum("cr,crs->cs", way, slopes[:, 1:])[:, None]
        along = mu * (way[:, :, None] * slopes[:, :1] + (normal / or_one(length))[:, None, None] * turned)
        taken = np.concatenate([slopes[:, :1], np.where(slides[:, None, None], along, slopes[:, 1:])], axis=1)
        matrix = (unit - np.where(pressed[:, None, None], taken, 0.0)) * each[:, :, None]
        step = least_norm(matrix.reshape(size, size), -gap.ravel(), errors=1e-12).reshape(count, rows)
        found = next(
            (
                (now + share * step, there)
                for share in 0.5 ** np.arange(_HALVED)
                if np.linalg.norm((there := missed(now + share * step))[0]) < np.linalg.norm(gap)
            ),
            None,
        )
        if found is None:
            break
        now, (gap, ahead) = found
    return np.asarray(_projected(now.T, mu))


@once
def _code() -> Built:
    """Return the code of the sweeps, and of the looks at what they leave."""
    names = [f"{name}_{rows}" for name in ("sweeps", "look") for rows, _ in _SHAPES]
    return build_code([], CodeOptions(level=2), exports=names, routines=RoutineSource("numerics.cone_impulses"))


def write_routines() -> list[Routine]:
    """Write the sweeps and the looks, in a plane and in space."""
    return [routine for shape in _SHAPES for routine in (*_sweeps(*shape), *_look(*shape))]


_OF_CONTACTS = {
    "friction": NUMBER,
    "index": ADDRESS,
    "table": ADDRESS,
    "v": ADDRESS,
    "p": ADDRESS,
    "squares": ADDRESS,
}


class _Contact:
    """One contact within a routine: its least rate of opening, its compliances, impulses, and speeds of its bodies."""

    def __init__(self, routine: Routine, rows: int, speeds: int) -> None:
        i, self.friction, index, table, v, p, self.squares = routine.arguments
        self.rows, self.speeds, self.routine = rows, speeds, routine
        self.row = table.at(i * (3 + 4 * rows * speeds))
        self.least, self.gives, self.yields = (self.row[k] for k in range(3))
        bodies, self.p = [v.at(index.read(i * 2 + k, INTEGER)) for k in (0, 1)], p.at(i * rows)
        self._entries = [(bodies[s], s * rows * speeds, k) for s in (0, 1) for k in range(speeds)]

    def _turns(self, r: int, k: int) -> bool:
        return self.rows > 2 or r > 0 or k < 2  # the normals of discs go through their centres

    def rate(self, r: int) -> Value:
        """Return how fast it opens, or slips."""
        terms = [(3 + at + r * self.speeds + k, v[k]) for v, at, k in self._entries if self._turns(r, k)]
        first, *rest = (self.row[place] * speed for place, speed in terms)
        return sum(rest, first)

    def push(self, by: Mapping[int, Value]) -> None:
        """Change the speeds of its bodies by impulses."""
        for body, at, k in self._entries:
            first = 3 + 2 * self.rows * self.speeds + at + k
            moves = (self.row[first + r * self.speeds] * x for r, x in by.items() if self._turns(r, k))
            body[k] = sum(moves, body[k])

    def within(self, slips: list[Value], normal: Value) -> list[Value]:
        """Return impulses of friction, shortened to what a normal one allows."""
        most, choose = self.friction * normal, self.routine.choose
        if self.rows == 2:
            return [choose(slips[0] > most, most, choose(slips[0] < 0.0 - most, 0.0 - most, slips[0]))]
        size = self.routine.sqrt(sum((x * x for x in slips[1:]), slips[0] * slips[0]))
        share = choose(size > most, most / choose(size > 0.0, size, 1.0), 1.0)
        return [slip * share for slip in slips]


def _sweeps(rows: int, speeds: int) -> list[Routine]:
    one = Routine(f"contact_{rows}", {"i": INTEGER, **_OF_CONTACTS})
    at = _Contact(one, rows, speeds)
    old, before = at.p[0], [at.p[r] for r in range(1, rows)]
    normal = old - (at.rate(0) - at.least) / at.gives
    normal = one.choose(normal > 0.0, normal, 0.0)
    pushed = {0: normal - old}
    if rows > 2:
        at.push(pushed)
    slips = at.within([one_before - at.rate(r) / at.yields for r, one_before in enumerate(before, 1)], normal)
    rubbed = {r: slip - was for r, (slip, was) in enumerate(zip(slips, before, strict=True), 1)}
    at.push(rubbed if rows > 2 else pushed | rubbed)
    at.p[0] = normal
    for r, slip in enumerate(slips, 1):
        at.p[r] = slip
    one.give(0)
    every = Routine(f"sweeps_{rows}", {"count": INTEGER, "sweeps": INTEGER, **_OF_CONTACTS}, exported=True)
    count, sweeps, *rest = every.arguments
    with every.count(sweeps):
        with every.count(count) as i:
            every.call(one, i, *rest)
        with every.count(count) as i:
            every.call(one, count - 1 - i, *rest)
    every.give(0)
    return [one, every]


def _look(rows: int, speeds: int) -> list[Routine]:
    """Write what pushes bodies by all impulses, and then sums the squares of what is missed."""
    pushed = Routine(f"pushed_{rows}", {"i": INTEGER, **_OF_CONTACTS})
    at = _Contact(pushed, rows, speeds)
    at.push({r: at.p[r] for r in range(rows)})
    pushed.give(0)
    missed = Routine(f"missed_{rows}", {"i": INTEGER, **_OF_CONTACTS})
    at = _Contact(missed, rows, speeds)
    normal = at.p[0] - (at.rate(0) - at.least) / at.gives
    normal = missed.choose(normal > 0.0, normal, 0.0)
    slips = at.within([at.p[r] - at.rate(r) / at.yields for r in range(1, rows)], normal)
    misses = [(at.p[0] - normal) * at.gives, *((at.p[r] - slip) * at.yields for r, slip in enumerate(slips, 1))]
    at.squares[0] = sum((x * x for x in misses), at.squares[0])
    missed.give(0)
    every = Routine(f"look_{rows}", {"count": INTEGER, "sweeps": INTEGER, **_OF_CONTACTS}, exported=True)
    count, _, *rest = every.arguments
    rest[-1][0] = 0.0
    for one in (pushed, missed):
        with every.count(count) as i:
            every.call(one, i, *rest)
    every.give(0)
    return [pushed, missed, every]
