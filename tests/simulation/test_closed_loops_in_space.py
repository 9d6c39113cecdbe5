"""Loops in space that formulas solve, against geometry and the numeric loop."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from atwood import simulate
from atwood.integrators.ida import library as sundials_library
from atwood_library.scenes import SpatialSliderCrank

from .test_closed_loops import by_formulas, solved, states

needs_sundials = pytest.mark.skipif(not sundials_library.available(), reason="the SUNDIALS libraries are not here")


def test_the_spatial_slider_crank_has_one_angle_and_its_rate() -> None:
    found = solved(SpatialSliderCrank())
    assert found is not None
    program = found.form.accelerations.program
    assert sum(len(group.symbols) for group in program.inputs[1:]) == 2
    assert sum(program.operations.values()) <= 150
    assert "solve" not in program.operations
    assert "atan2" not in program.operations


@pytest.mark.parametrize("solver", ["explicit", "taylor"])
def test_the_spatial_slider_crank_is_where_its_rod_puts_it(solver: str) -> None:
    result = simulate(SpatialSliderCrank(), solver=solver, rtol=1e-11, t_end=2.0)
    assert by_formulas(result)
    angle, crank, rod = result["bearing.angle"], 0.08, 0.3
    y, z = 0.1 + crank * np.cos(angle), 0.12 + crank * np.sin(angle)
    assert np.ptp(angle) > 4.0
    assert_allclose(result["guide.displacement"], np.sqrt(rod**2 - y**2 - z**2), atol=1e-14)
    assert result.energy.max_drift < 1e-8


@needs_sundials
def test_the_spatial_slider_crank_moves_as_its_numeric_loop() -> None:
    result, numeric = (simulate(SpatialSliderCrank(), rtol=1e-12, t_end=1.0, solver=one) for one in ("auto", "ida"))
    assert by_formulas(result)
    sizes = np.max(np.abs(states(numeric)), axis=1, keepdims=True)
    assert np.max(np.abs(states(result) - states(numeric)) / sizes) < 1e-7
