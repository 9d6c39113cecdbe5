"""When the tangents at the ends of a step leave room for a value that passes zero and comes back.

A function that is convex within a step lies above its tangents at both ends.
"""

from __future__ import annotations

SECANT = 2.0**-10
"""Slopes are taken over this share of a width."""

FULL = 1.0
"""Up to this share of a step the tangents at its ends must keep the sign; twice what convex functions need."""

STEEP = 4.0
"""Where a tangent changes by so many times the larger value, the function may oscillate within the step."""
