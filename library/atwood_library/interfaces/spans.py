"""Straight pieces of a rope between two points."""

from __future__ import annotations

from typing import Any

from atwood import Scalar, dot

__all__ = ["rate_of_span"]


def rate_of_span(part: Any, p: Any, q: Any, of: str = "velocity") -> Scalar:
    """Return the rate of a piece's length, of velocities; on a line also the second one, of accelerations.

    Parameters
    ----------
    part
        The rope.
    p, q
        Connectors of it at both ends of the piece.
    of
        ``"velocity"`` or ``"acceleration"``.
    """
    apart = getattr(q, of) - getattr(p, of)
    if part.on_a_line:
        return dot(apart, part.line) * part.side(p, q, None)
    return dot(apart, q.position - p.position) / part.distance(p, q)
