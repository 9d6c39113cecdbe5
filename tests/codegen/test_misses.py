"""What states miss conditions by is in machine code what it is from all slopes with NumPy."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from atwood import assemble, simulate
from atwood.codegen.llvm.misses import compile_misses
from atwood.simulation.problem.problem import SceneProblem
from atwood.simulation.problem.projection import constraints_at, misses_of
from atwood_library.scenes import Bricard, RigidBodies, RollingDisc


@pytest.mark.parametrize("scene", [Bricard, RigidBodies, RollingDisc])
@pytest.mark.parametrize("aside", [0.0, 1e-6, 0.3])
def test_misses_are_those_of_all_slopes(scene: type, aside: float) -> None:
    run = simulate(assemble(scene(), form="dae"), t_end=0.1, outputs=21).run
    one, rng = run.segments[0], np.random.default_rng(1)
    q, u = (values + aside * rng.standard_normal(values.shape) for values in (one.coordinates, one.speeds))
    now = constraints_at(one.plan, one.time, q, u)
    expected = [np.max(np.abs(each), axis=1) for each in (now.value, now.rate((u / one.plan.sizes[:, None]).T))]
    one.plan.compiles_columns = True
    assert_allclose(misses_of(one.plan, one.time, q, u), expected, rtol=1e-11, atol=1e-13)


def test_what_is_not_finite_is_missed_by_nan() -> None:
    plan: SceneProblem = simulate(assemble(Bricard(), form="dae"), t_end=0.01, outputs=3).run.segments[0].plan
    held = plan.balance.program
    places = list(zip(held.jacobian_rows.tolist(), held.jacobian_columns.tolist(), strict=True))
    made = compile_misses(held.constraints_alone, places).bind(plan.assembly.parameter_values)
    states = np.ones((3, plan.program.coordinates + plan.program.speeds))
    states[1, 0], states[2, -1] = np.nan, np.inf
    found = made(np.zeros(3), states, plan.sizes, np.zeros(held.constraints))
    assert np.isfinite(found[:, 0]).all()
    assert np.isnan(found[:, 1:]).all()
