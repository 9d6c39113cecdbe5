"""What a run can be asked for, and what is said of the rest."""

import numpy as np
import pytest

from atwood import UsageError, assemble, simulate
from atwood_library.scenes import FourBar, SimplePendulum


def test_the_end_may_be_text_with_a_unit():
    assert simulate(SimplePendulum(), t_end="50 ms", outputs=3).time[-1] == pytest.approx(0.05)
    assert simulate(SimplePendulum(), t_end=np.float64(0.05), outputs=3).time[-1] == pytest.approx(0.05)


@pytest.mark.parametrize("end", ["soon", "3 m", [1.0, 2.0], float("inf"), float("nan"), -1.0])
def test_what_is_no_end_is_refused(end):
    with pytest.raises(UsageError, match="end"):
        simulate(SimplePendulum(), t_end=end)


@pytest.mark.parametrize("outputs", ["many", None, [], [0.0, float("nan")], [1.0, 0.5], [[0.0, 1.0]], [0.0, 99.0], 1])
def test_what_are_no_outputs_is_refused(outputs):
    with pytest.raises(UsageError, match="output"):
        simulate(SimplePendulum(), t_end=1.0, outputs=outputs)


@pytest.mark.parametrize("solver", ["taylor", "explicit"])
def test_a_run_again_begins_with_the_first_step_that_was_given(solver):
    assembly = assemble(FourBar())
    runs = [simulate(assembly, t_end=0.5, solver=solver, first_step=1e-5) for _ in range(3)]
    unasked = simulate(assembly, t_end=0.5, solver=solver)
    assert {one.run.statistics.steps for one in runs} == {runs[0].run.statistics.steps}
    assert runs[0].run.statistics.steps > unasked.run.statistics.steps
    assert all(np.array_equal(one["crank.angle"], runs[0]["crank.angle"]) for one in runs)
