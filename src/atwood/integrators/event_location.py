"""Finding where event functions pass through zero inside a step.

A step of the integrator leaves an interpolant behind.  The watch compares the sign of each event function with
the sign that it last had for certain, and narrows the interpolant down to the first change.  It needs nothing
from the integrator but the interpolant, so that a root beyond the next output time can simply wait.
Routines do all this (`atwood.integrators.event_routines`), for compiled functions and for functions in Python alike.

The rules, which decide the cases on the edge:

- arriving at zero exactly is an event; leaving zero is not, nor is touching it;
- at zero, and up to the rounding of its value, an event has no sign: after a restart there, and after it has happened,
  the sign is the first that is larger than rounding, at times that move away from there by more and more;
- a change within rounding of a restart belongs to the restart, unless the sign before is handed on to it;
- events within rounding of each other happen together;
- a function that passes zero and comes back within a step has passed it: see `atwood.integrators.event_location`;
- what needs no exact time happens at the end of the step in which its sign changed, unless something else does before.

Event functions that come near zero between two points of a solution: what tangents say, and where to look.

A function that is convex between two points lies above its tangents there.  If each tangent keeps the sign up to the
middle, so does the function.  Where one does not, the function is read between, at the least value of the cubic through
both points with these slopes (Hermite), and both parts are judged in the same way.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from atwood.integrators.protocol import State
from atwood.lazy_dataclasses import dataclass

Interpolant = Callable[[float], State]

ROUNDING = float(np.finfo(np.float64).eps)
FARTHER = 4.0
"""Signs near zero are read at times of which each is so many times as far from there as the one before."""

NOISE = 16.0
"""A value has a sign from so many times its change on, when the state changes by rounding."""


HALF = 0.5
MOST = 200
"""A step is read at no more places than these: what then is left is a touch, not a passage."""

SHORTEST = 1e-6
"""Parts of a step that are shorter than this share are not divided: there the depth is rounding."""

TINY = 1e-300
"""Makes zero positive."""

PASSED = 0.9
"""What has passed zero by this share of its margin at the start of a mode happens there.

Equal parts pass their margins together. One of them ends the mode, and the others are at the end of theirs to rounding:
a whole margin would leave them at zero, with a sign that nobody knows.
"""

SHORT = 1e-6
"""Share of the time since the mode began in which the rate of an event is read."""

ALIKE = 1.0 + 1e-6
"""Events that pass their margins at once have passed zero at once, if it was earlier by shares as alike as this."""

LONGEST = 0.1
"""Share of that time by which an event may be brought forward, by one Euler step back."""


LARGEST = float(np.finfo(np.float64).max)
"""Slopes are no larger, so that what is worked out from them stays a number."""


@dataclass(frozen=True, eq=False)
class Root:
    """Events that happen together: the state just past zero, and +-1 or 0 for each event function."""

    state: State
    events: tuple[int, ...]
