"""What acts between two joint coordinates, or between one and the ground: laws alike for angles and displacements."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from atwood import CoordinateLoad, Scalar, is_zero, maximum, minimum, select

__all__ = ["accelerated", "between", "gap_contact", "push", "resistance"]


def between(part: Any) -> tuple[Scalar, Scalar]:
    """Return by how much coordinate b is ahead of coordinate a, and its rate; of the ground, a is at zero.

    Parameters
    ----------
    part
        A part with the connectors `b` and, unless `against` is ``"ground"``, `a`.
    """
    if part.against == "ground":
        return part.b.value, part.b.rate
    return part.b.value - part.a.value, part.b.rate - part.a.rate


def accelerated(part: Any) -> Scalar:
    """Return the second rate of what `between` returns; only observables may ask for it."""
    if part.against == "ground":
        return part.b.acceleration
    return part.b.acceleration - part.a.acceleration


def gap_contact(beyond: Scalar, rate: Scalar, damping: float, stiffness: float) -> Scalar:
    """Return the damping part of an elastic contact, which pushes at most as much as the spring and never pulls.

    Parameters
    ----------
    beyond, rate
        How deep the contact is, and its rate.
    damping, stiffness
        Of the contact.
    """
    spring = stiffness * beyond
    return maximum(minimum(damping * rate, spring), -spring)


def resistance(part: Any, rate: Scalar) -> Scalar:
    """Return a force or a torque of the sign of a rate, as a function of the rate.

    Parameters
    ----------
    part
        A part with the parameters `linear`, `quadratic`, `constant`, `power` and `smooth_below`, and the input `level`.
    rate
        The rate.
    """
    total = part.linear * rate + part.quadratic * rate * select(rate < 0.0, -rate, rate)
    limit = part.smooth_below
    if not is_zero(part.constant):
        total = total + part.constant * maximum(minimum(rate / limit, 1.0), -1.0)
    if not is_zero(part.power):
        total = total + part.power * rate / maximum(rate * rate, limit * limit)
    return part.level * total


def push(part: Any, value: Scalar) -> Iterator[CoordinateLoad]:
    """Yield a force, or a torque, on coordinate b, and its reaction on coordinate a unless that is the ground."""
    yield CoordinateLoad(part.b, value)
    if part.against != "ground":
        yield CoordinateLoad(part.a, -value)
