"""Back from the numeric loop to formulas: a dead centre that a run was handed over for has been passed.

The motion alone says when it is asked, as for singular positions (`atwood.simulation.singular.looks.stride_from`), so
that outputs change nothing.
"""

from __future__ import annotations

import numpy as np

from atwood.errors import SolveError
from atwood.integrators.protocol import FloatArray, Status, StepResult
from atwood.late import replace
from atwood.simulation.problem.closed_loops import solve_at
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.problem.problem import Plan
from atwood.simulation.problem.projection import project_safely
from atwood.simulation.run.choice import Choice, choose
from atwood.simulation.singular.looks import Look, stride_from

__all__ = ["WayBack"]


class WayBack:
    """When a run goes back to formulas.

    Parameters
    ----------
    plan, options
        The scene in its mode, and what was asked for.
    end
        When the stretch ends at the latest, s.
    start
        Where the numeric loop took over.

    Attributes
    ----------
    next
        When it is asked next, s.
    """

    def __init__(self, plan: Plan, options: RunOptions, end: float, start: StepResult) -> None:
        self._plan, self._options, self._whole = plan, options, end - start.t
        self.begin_again(start)

    def begin_again(self, here: StepResult) -> None:
        """Ask one stride from a state on."""
        self.next = here.t + stride_from(self._plan, Look(here.t, here.y, here.yp), self._whole)

    def ask(self, here: StepResult) -> tuple[Choice, FloatArray] | None:
        """Return what goes on by formulas, and the state that it starts from; None where these have none, or nearly so.

        Parameters
        ----------
        here
            Where the numeric loop is.
        """
        self.begin_again(here)
        plan = self._plan
        if here.status is not Status.REACHED:
            return None
        try:
            q, u = project_safely(plan, here.t, *self._split(here.y))
        except SolveError:
            return None
        if solve_at(plan, here.t, q, u) is None:
            return None
        found = choose(plan, self._options, here.t, q, u)
        if found.solver.startswith("ida"):
            return None
        return replace(found, reason=f"the dead centre has been passed: {found.reason}"), np.concatenate([q, u])

    def _split(self, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        q, u = self._plan.program.split(y)
        return q.copy(), u.copy()
