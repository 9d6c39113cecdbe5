"""What a singular position costs, in evaluations: they are what its time is made of."""

from __future__ import annotations

import pytest

from atwood import simulate
from atwood.codegen.llvm.columns import ColumnKernel
from atwood.codegen.python.backend import BoundKernel
from atwood.numerics import sparse
from atwood.simulation.singular.monitor import SingularityMonitor
from atwood_library.scenes import FourBar, FourBarRow

FORMS = ("reduced", "dae")


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many kernels were called while something looked out for singular positions."""
    count, inside = [0], [False]
    look = SingularityMonitor.look

    def counted(call):
        def counting(self, *groups):
            count[0] += inside[0]
            return call(self, *groups)

        return counting

    def looking(self, *state):
        inside[0] = True
        try:
            return look(self, *state)
        finally:
            inside[0] = False

    for kind in (BoundKernel, ColumnKernel):
        monkeypatch.setattr(kind, "__call__", counted(kind.__call__))
    monkeypatch.setattr(SingularityMonitor, "look", looking)
    return count


@pytest.mark.parametrize("form", FORMS)
def test_crossings_take_no_evaluation_in_python(form: str, calls: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    result = simulate(FourBarRow(windows=1), form=form)
    assert len(result.singular_crossings) == 10
    assert calls[0] == 0
    monkeypatch.setattr(SingularityMonitor, "pass_in_steps", lambda *_: None)
    assert len(simulate(FourBarRow(windows=1), form=form).singular_crossings) == 10
    assert 0 < calls[0] <= 10 * {"reduced": 28, "dae": 40}[form]  # where Python passes them


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_reactions_of_redundant_constraints_are_found_for_all_samples_at_once(
    form: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = simulate(FourBar(space="space"), form=form, t_end=1.0)
    plane = simulate(FourBar(), form=form, t_end=1.0)

    def alone(*_: object) -> None:
        raise AssertionError("a sample is solved by itself")

    for name in ("csr_least_norm", "solve_bordered"):
        monkeypatch.setattr(sparse, name, alone)
    for path in ("left.force.x", "right.force.z"):
        assert abs(result.array(path) - plane.array(path)).max() < 1e-5 * abs(plane.array(path)).max()
