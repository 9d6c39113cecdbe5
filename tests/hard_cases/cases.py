"""All cases, in the order of the page."""

from __future__ import annotations

from . import known_motions, known_problems, large, loops, smooth, switching
from .case import KINDS, Case

ROOMS = (known_problems, known_motions, smooth, loops, large, switching)

CASES: tuple[Case, ...] = tuple(
    sorted((case for room in ROOMS for case in room.CASES), key=lambda case: KINDS.index(case.kind))
)
