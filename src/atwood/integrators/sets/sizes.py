"""What is small, slow or rounding where gaps and slips change."""

from __future__ import annotations

NEAR_REST = 100.0
"""Times what is small and slow, where impacts have accumulated."""

SEEN = 2.0
"""Times what is slow: what has come to rest may go by that still, or again, where its event is seen."""

BEGINS = 0.05
"""Times what is slow: the fastest of what begins to slip in two directions goes by that, lest rounding turn it."""

ASTRAY = 0.9
"""Cosine of the angle by which what begins to slip may move otherwise than friction holds it back."""

ROUNDED = 0.25 * 2.0**-52
"""Of the scene's size: a bounce that is no higher is rounding."""

BLURRED = 512.0
"""Times rounding of a gap by the share of energy that is lost: rounding tells in bounces that are no higher.

Each adds about its rounding to their height; where losses take as much away they would go on for ever.
"""

UNMOVED = 1e-28
"""Of the inverse of the scene's mass: what a unit of force moves by less is moved by rounding, which is squared."""

STEP = 2.0**-26
"""Of coordinates: by so much each is moved to see how its rounding moves a gap."""

FAST = 1e3
"""What bounces no higher than rounding is looked for where forces pull it back by so much times what falls, at most."""

GAIN = 1e-9
"""Of the work of impulses: more than this is energy that an impact would make."""

SHARED = 100.0
"""Times the slack of one inequality: shares that nothing determines come from other equations."""

APART = 32.0
"""Times rounding of a gap: one that is more comes to touch later than those that do now."""
