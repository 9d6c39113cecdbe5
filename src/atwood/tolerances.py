"""Every tolerance of rank and consistency, in one place: its unit, its reason, and the interval in which it may lie.

A tolerance of rank decides whether a row or a direction is there or is rounding. A tolerance of consistency decides
whether two statements about one position or one speed contradict each other. All of them are relative: rows come with
their propagated errors (`atwood.simulation.dynamics.rounding`), lengths are shares of the scene's extent, angles are in
radians. The decisions on every scene of the library are the same with ten times and with a tenth of each
(``tests/test_tolerances.py``), and beyond either end of its interval a scene that is named there comes out wrong.

Modules read these as ``tolerances.RANK`` of the one object `tolerances`. What only controls an iteration, a step or a
choice among equals is not here: it stands where it is used.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

__all__ = ["INTERVALS", "Tolerances", "tolerances"]


class Tolerances:
    """The values; see the module. There is one object, `tolerances`."""

    CERTAIN: float = 30.0
    """Unit 1, times the propagated error of a row: what is left of a row by more is not rounding.

    Errors are found from eight ways of rounding 16 times as rough as the machine's; so 500 roundings in a row that all
    go the same way are still told from what is there. Below the interval the rounding of Bricard's loop counts as a
    constraint; above it, one of two rods that are all but parallel is dropped.
    """

    TRUSTED: float = 1e11
    """Unit 1, times the propagated error of a row: a row is scaled by its own size if that is larger, else by this.

    What rounding leaves in a row that is scaled so is below 1e-11, a hundredth of `RANK`. Above the interval rows
    that are known well are scaled down until `RANK` drops them.
    """

    RANK: float = 1e-9
    """Unit 1, relative to the largest singular value: a direction below is not followed by a least-norm solution.

    It lies well above what is left of rounding in rows that are scaled with `TRUSTED`, and below what a mechanism shows
    near a singular position. Integrals of Pfaffian constraints and relations between scaled rows are decided by it too.
    """

    KNOWN: float = 1e-6
    """Unit 1, share of the fastest rate of what is prescribed: rates count where rounding takes none by more.

    They say how far rounding takes a prescribed place in the time in which it moves by the scene's size. Where it
    hardly moves yet, its rate is rounding itself. Above the interval, drives that contradict each other pass for
    consistent ones.
    """

    CLEAR: float = 1e-6
    """Unit 1, smallest singular value with rows and columns scaled: above, rank is full and no place near by is asked.

    Below the interval a start within reach of a singular position is taken for an ordinary one.
    """

    SINGULAR: float = 1e-5
    """Unit 1, smallest singular value relative to that a little away: below, the position is singular.

    A little away is 1e-2 rad, so that a start within 1e-7 rad of a singular position, of which Newton's method knows no
    more than that, is one.
    """

    FREE: float = 1e-6
    """Unit 1, share in a direction of size one: above, a coordinate or a speed moves along that direction.

    Directions come from a singular value decomposition of rows that Newton's method has met to `MET`.
    """

    MET: float = 1e-11
    """Unit 1, of the scene's sizes: a position that misses a constraint or a start value by less has met it.

    It lies above the rounding of a chain of rotations and below every tolerance that a solver is given.
    """

    MET_SPEEDS: float = 1e-8
    """Unit 1, relative to the terms of each condition: speeds that miss by less have met it.

    Conditions on speeds are linear; what two passes leave is rounding, measured by the terms that cancel.
    """

    CLOSED: float = 1e-9
    """Unit 1, of the scene's extent, or rad: what is apart by less is in one place, and says the same.

    Loops, rigid parts, repeated start values and prescribed motions are compared by it. Lengths are typed with 12
    digits at most and often computed, as a diagonal is; a gap that a person could mean is larger.
    """

    NEARLY_FITS: float = 5e-10
    """Unit 1, of the scene's sizes: a singular position that constraints miss by less is one.

    Where links nearly fit, two ways of moving come close to each other and do not meet; a motion turns from one into
    the other within the root of what is missing, and must not be carried across.
    """

    HELD: float = 1e-7
    """Unit 1, of the scene's sizes: a projected state that misses a constraint by more has not met it.

    A prescribed motion that jumps by more is not continuous. States of a run carry the error of the solver, which this
    exceeds at every tolerance that projection can correct.
    """

    IN_PLACE: float = 1e-5
    """Unit 1, of the scene's sizes: a change of mode that would move something by more is refused.

    The time of an event is known as well as the solution, so that the position there is off by the tolerance of a run.
    """

    SAME: float = 1e-11
    """Unit 1, relative to the largest coefficient: coefficients of a Pfaffian form that differ by less are the same.

    They are evaluated at places that no symmetry singles out; what differs there in truth differs in the first digits.
    """

    RTOL: float = 1e-8
    """Unit 1: the relative tolerance of a solver unless another one is asked for, in every function and command."""


tolerances = Tolerances()
"""The values that every module reads."""

INTERVALS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "CERTAIN": (0.3, 1e6),
        "TRUSTED": (0.0, 1e15),
        "RANK": (0.0, 1e-3),
        "KNOWN": (0.0, 0.1),
        "CLEAR": (1e-10, math.inf),
        "SINGULAR": (1e-8, 1e-2),
        "FREE": (0.0, 0.1),
        "MET": (1e-15, 1e-8),
        "MET_SPEEDS": (3e-12, 1e-7),
        "CLOSED": (1e-15, 1e-7),
        "NEARLY_FITS": (2e-11, math.inf),
        "HELD": (1e-13, 1e-6),
        "IN_PLACE": (1e-9, 1e-4),
        "SAME": (1e-15, 1e-2),
    }
)
"""Where each may lie. An end of 0 or infinity is open: beyond it no known scene is wrong, it costs time or digits."""
