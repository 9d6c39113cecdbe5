"""Programs over many states as machine code: the same numbers as NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from atwood import assemble
from atwood_library.scenes import Bricard, FourBarRow


@pytest.mark.parametrize("scene", [FourBarRow(windows=2), Bricard()], ids=["plane", "space"])
@pytest.mark.parametrize("states", [1, 12, 40])
def test_the_same_numbers_as_numpy(scene: object, states: int) -> None:
    assembly = assemble(scene, form="dae")
    program = assembly.balance("dae").program
    rng = np.random.default_rng(3)
    q, u = (rng.uniform(-1.0, 1.0, (len(group.symbols), states)) for group in program.inputs[1:])
    t = np.full((1, 1), 0.3)
    for one, other in zip(
        assembly.columns(program)(t, q, u), assembly.kernel(program, vectorized=True)(t, q, u), strict=True
    ):
        assert one.shape == other.shape
        assert np.allclose(one, other, rtol=1e-11, atol=1e-11)


def test_what_has_no_value_is_nan_for_its_state_alone() -> None:
    assembly = assemble(FourBarRow(windows=1))
    program = assembly.balance("reduced").program
    q, u = (np.zeros((len(group.symbols), 3)) for group in program.inputs[1:])
    q[0, 1] = np.nan
    found = assembly.columns(program)(np.zeros((1, 1)), q, u)
    bad = np.any([np.any(~np.isfinite(one), axis=0) for one in found if len(one)], axis=0)
    assert bad.tolist() == [False, True, False]
