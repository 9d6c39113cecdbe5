"""Impulses of many contacts in a plane: a normal one that only pushes, and friction within Coulomb's cone.

Each contact has ``0 <= p_n``, ``w_n - b >= 0``, ``p_n (w_n - b) = 0`` and ``|p_t| <= mu p_n`` with p_t against w_t:
they are zeros of ``p - P(p - (w - b)/D)`` with the projection P onto the cone and any D > 0 (P. Alart, A. Curnier,
Computer Methods in Applied Mechanics and Engineering 92, 1991). They are solved one after the other, there and back:
Gauss and Seidel's method, projected (M. Jean 1999; V. Acary, B. Brogliato 2008, section 13.7), as machine code.
"""

from __future__ import annotations

import ctypes
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import Built, RoutineSource, build_code, once
from atwood.codegen.llvm.module import CodeOptions
from atwood.codegen.routines import ADDRESS, INTEGER, NUMBER, Routine

_SWEEPS, _EACH = 5, 2000
"""What is missing is looked at after so many sweeps, there and back, or so many contacts."""

_LEAST, _WORK, _TURNS = 200_000, 2_000_000, 50
"""Contacts that are solved at least, unless nothing is missing, and at most, or so many looks."""

_SWEEP = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_int64, ctypes.c_int64, ctypes.c_double, *[ctypes.c_void_p] * 4)

_ENTRIES = 11
"""Numbers of each contact: normal, arms, least rate, compliances, inverse masses and moments of inertia of both."""

_ROUNDED = 1e-13
"""Of a speed: what is missed by less is rounding."""


class Touches(NamedTuple):
    """Contacts of discs with each other and with walls.

    Attributes
    ----------
    bodies
        Of each contact the numbers of the disc and of what it touches, shape (2, contacts); the last is the world.
    normal
        From the first to the second, alike.
    arms
        Radii of both, shape (2, contacts); a wall has none.
    inverse
        Inverse masses along x and z, and moments of inertia, of each disc and of the world, shape (bodies + 1, 3).
    friction
        Coefficient of friction.
    """

    bodies: NDArray[np.intp]
    normal: FloatArray
    arms: FloatArray
    inverse: FloatArray
    friction: float

    def rates(self, v: FloatArray) -> FloatArray:
        """Return how fast they open, and slip to the left of the normal, at speeds of all bodies."""
        (a, b), (x, z), (r, s) = self.bodies, self.normal, self.arms
        one, other = v[a], v[b]
        dx, dz = (other - one)[:, :2].T
        return np.array([x * dx + z * dz, x * dz - z * dx - (r * one[:, 2] + s * other[:, 2])])

    @property
    def compliance(self) -> FloatArray:
        """How the rates change by a unit of their own impulses, shape (2, contacts)."""
        (a, b), (r, s) = self.bodies, self.arms
        straight, turn = self.inverse[a, 0] + self.inverse[b, 0], self.inverse[:, 2]
        return np.array([straight, straight + r * r * turn[a] + s * s * turn[b]])


def _projected(p: FloatArray, friction: float) -> FloatArray:
    normal = np.maximum(p[0], 0.0)
    return np.array([normal, np.clip(p[1], -friction * normal, friction * normal)])


def missing(touches: Touches, v: FloatArray, p: FloatArray, least: FloatArray, compliance: FloatArray) -> float:
    """Return by which speed the laws are missed, in quadratic mean over the contacts."""
    rates = touches.rates(v)
    rates[0] -= least
    misses = (p - _projected(p - rates / compliance, touches.friction)) * compliance
    return float(np.sqrt(np.mean(misses[0] ** 2 + misses[1] ** 2)))


def impulses(
    touches: Touches, free: FloatArray, least: FloatArray, guess: FloatArray, small: float, large: float
) -> tuple[FloatArray, FloatArray, float]:
    """Return the speeds of all bodies, the impulses, and by which speed the laws are missed.

    Parameters
    ----------
    touches
        The contacts.
    free
        Speeds without impulses, shape (bodies + 1, 3).
    least
        With which speeds contacts open at least.
    guess
        Impulses to begin with, shape (2, contacts).
    small, large
        A speed that is as good as none, and one for which ten times as much is done before it is left.
    """
    compliance = touches.compliance
    p = _projected(guess, touches.friction)
    v = _moved(touches, free, p)
    missed = missing(touches, v, p, least, compliance)
    nothing = _ROUNDED * float(np.max(np.abs(free)))
    (a, b), own = touches.bodies, np.ascontiguousarray(p.T)
    masses = (touches.inverse[a, 0], touches.inverse[a, 2], touches.inverse[b, 0], touches.inverse[b, 2])
    table = np.stack([*touches.normal, *touches.arms, least, *compliance, *masses], axis=1)
    index = np.ascontiguousarray(3 * touches.bodies.T, dtype=np.int64)
    sweep = _SWEEP(_code().code.addresses["sweeps"])
    count, done = len(a), 0
    sweeps = max(_SWEEPS, _EACH // count)
    most = max(_WORK, 2 * _TURNS * sweeps * count)
    while missed > nothing and not (missed <= small and done >= _LEAST):
        sweep(count, sweeps, touches.friction, *(one.ctypes.data for one in (index, table, v, own)))
        p = own.T
        v = _moved(touches, free, p)
        missed, done = missing(touches, v, p, least, compliance), done + 2 * sweeps * count
        if done >= most * (1 if missed <= large else 10):
            break
    return v, p, missed


def _moved(touches: Touches, free: FloatArray, p: FloatArray) -> FloatArray:
    """Return the speeds that impulses make of others."""
    (a, b), (x, z), (r, s) = touches.bodies, touches.normal, touches.arms
    force, count = np.array([x * p[0] - z * p[1], z * p[0] + x * p[1]]), len(free)
    total = [np.bincount(b, one, count) - np.bincount(a, one, count) for one in force]
    turned = -np.bincount(a, r * p[1], count) - np.bincount(b, s * p[1], count)
    found: FloatArray = free + touches.inverse * np.array([*total, turned]).T
    return found


@once
def _code() -> Built:
    """Return the code of the sweeps."""
    return build_code([], CodeOptions(level=2), exports=["sweeps"], routines=RoutineSource("numerics.cone_impulses"))


def write_routines() -> list[Routine]:
    """Write the sweeps."""
    of_contact = {"i": INTEGER, "friction": NUMBER, "index": ADDRESS, "table": ADDRESS, "v": ADDRESS, "p": ADDRESS}
    one = Routine("contact", of_contact)
    i, friction, index, table, v, p = one.arguments
    a, b = (v.at(index.read(i * 2 + k, INTEGER)) for k in (0, 1))
    x, z, r, s, least, gives, yields, m, j, n, k = (table[i * _ENTRIES + k] for k in range(_ENTRIES))
    dx, dz, old, before = b[0] - a[0], b[1] - a[1], p[i * 2], p[i * 2 + 1]
    normal = old - (x * dx + z * dz - least) / gives
    normal = one.choose(normal > 0.0, normal, 0.0)
    most = friction * normal
    tangent = before - (x * dz - z * dx - (r * a[2] + s * b[2])) / yields
    tangent = one.choose(tangent > most, most, one.choose(tangent < 0.0 - most, 0.0 - most, tangent))
    pushed, rubbed = normal - old, tangent - before
    along, up = x * pushed - z * rubbed, z * pushed + x * rubbed
    for body, straight, turn, sign, arm in ((a, m, j, -1.0, r), (b, n, k, 1.0, s)):
        body[0] = body[0] + straight * along * sign
        body[1] = body[1] + straight * up * sign
        body[2] = body[2] - turn * arm * rubbed
    p[i * 2], p[i * 2 + 1] = normal, tangent
    one.give(0)
    every = Routine(
        "sweeps",
        {"count": INTEGER, "sweeps": INTEGER, **{key: of_contact[key] for key in [*of_contact][1:]}},
        exported=True,
    )
    count, sweeps, *rest = every.arguments
    with every.count(sweeps):
        with every.count(count) as i:
            every.call(one, i, *rest)
        with every.count(count) as i:
            every.call(one, count - 1 - i, *rest)
    every.give(0)
    return [one, every]
