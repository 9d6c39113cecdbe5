"""Moreau and Jean's time stepping: equal steps, with the impulses of contacts at their ends."""

from __future__ import annotations

from typing import TYPE_CHECKING

from atwood.integrators.methods.record import Method, Task

if TYPE_CHECKING:
    from atwood.integrators.time_stepping.session import TimeSteppingSession


def _open(task: Task) -> TimeSteppingSession:
    from atwood.integrators.time_stepping.session import TimeSteppingSession

    assert task.impulsive is not None
    return TimeSteppingSession(task.impulsive, task.t, task.y, task.budget, task.end)


MOREAU = Method(
    "moreau",
    "Moreau-Jean time stepping",
    "J. J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, 1988; M. Jean, Computer Methods in "
    "Applied Mechanics and Engineering 177 (1999) 235; V. Acary, B. Brogliato, Numerical Methods for Nonsmooth "
    "Dynamical Systems, Springer 2008, chapter 10",
    "impulsive",
    orders=(2,),
    open=_open,
    nodes_in_step=3,
    reach=8.0,
    steps_seen=0.5,
    steps_unseen=10.0,
    loosest_tolerance=1.0,
    default_order=2,
    keeps_constraints=True,
)
"""Of order two where nothing touches, of order one over impacts and where something sticks or slips."""
