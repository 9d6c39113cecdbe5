"""SUNDIALS IDA: backward differentiation of variable order, with equations as machine code or in Python."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from atwood.integrators.methods.record import Method, Task
from atwood.lazy_dataclasses import replace

if TYPE_CHECKING:
    from atwood.integrators.session import Session


def _open(task: Task, in_python: bool = False) -> Session:
    from atwood.integrators.ida.native import NativeSession
    from atwood.integrators.ida.setup import IDAS_OWN, IdaTuning

    assert task.implicit is not None
    assert task.yp is not None
    tuning = IdaTuning(angle_like=task.angles, stop_time=task.end)
    problem = task.implicit(not in_python)
    if in_python:
        problem, tuning = replace(problem, native=None, pivots=None), replace(IDAS_OWN, stop_time=task.end)
    return NativeSession(problem, task.settings, task.t, task.y, task.yp, task.budget, tuning)


_ida: Any = partial(
    Method,
    citation="A. C. Hindmarsh et al., SUNDIALS: Suite of nonlinear and differential/algebraic equation solvers, ACM "
    "Transactions on Mathematical Software 31 (2005) 363-396",
    kind="implicit",
    orders=(1, 2, 3, 4, 5),
    keeps_constraints=True,
    word="IDA",
    nodes_in_step=3,
    reach=2.0,
    steps_seen=2.0,
    steps_unseen=100.0,
    least_tolerance=1e-13,
    loosest_tolerance=1.0,
    first_share=0.01,
)

IDA: Method = _ida("ida", "SUNDIALS IDA", open=_open)
IDA_SUNDAE: Method = _ida(
    "ida-sundae", "SUNDIALS IDA with equations in Python", open=partial(_open, in_python=True), is_interpreted=True
)
