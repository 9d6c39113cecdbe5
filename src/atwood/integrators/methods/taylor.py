"""Taylor series whose order follows the tolerance."""

from __future__ import annotations

from typing import TYPE_CHECKING

from atwood.integrators.methods.record import Method, Task

if TYPE_CHECKING:
    from atwood.integrators.batch import BatchPlaces
    from atwood.integrators.explicit_session import ExplicitSession
    from atwood.integrators.lanes import LanePlaces
    from atwood.integrators.taylor.stepper import CompiledStepper


def _stepper(task: Task) -> CompiledStepper:
    from atwood.integrators.taylor.stepper import CompiledStepper

    assert task.series is not None
    problem = task.problem
    onto = None if problem.project is None or problem.compiled is None else problem.compiled()
    return CompiledStepper(task.series(), task.settings, guard=problem.guard, onto=onto)


def _open(task: Task) -> ExplicitSession:
    from atwood.integrators.explicit_session import ExplicitSession

    return ExplicitSession(task.problem, task.settings, _stepper(task), task.t, task.y, task.budget)


def _batch(task: Task) -> BatchPlaces:
    return _stepper(task).batch_places()


def _lanes(task: Task, lanes: int) -> LanePlaces:
    from atwood.integrators.taylor.lanes import open_lanes

    assert task.series is not None
    return open_lanes(task.series(), task.settings, lanes)


TAYLOR = Method(
    key="taylor",
    title="Taylor series",
    citation="A. Jorba, M. Zou, A software package for the numerical integration of ODEs by means of high-order Taylor "
    "methods, Experimental Mathematics 14 (2005) 99-117",
    kind="series",
    orders=tuple(range(5, 29)),
    open=_open,
    batch=_batch,
    lanes=_lanes,
    keeps_constraints=True,
    word="Taylor series",
    nodes_in_step=12,
    reach=2.0,
    steps_seen=0.1,
    steps_unseen=1.5,
)
