"""Pictures of sweeps."""

from typing import Any

import numpy as np
import pytest

from atwood import ResultError, UsageError, plot_sweep, sweep
from atwood_library.scenes import Chain, DoublePendulum


def drawn(*arguments: Any, **options: Any) -> Any:
    return sweep(DoublePendulum(), *arguments, t_end=0.1, threads=1, **options)


def test_a_curve_over_one_value() -> None:
    found = drawn({"mass1": [3.0, 1.0, 2.0]}, quantities=["rod1.angle", "bob2.position.x"])
    first, second = plot_sweep(found).axes
    line = first.lines[0]
    assert list(line.get_xdata()) == [1.0, 2.0, 3.0]
    assert np.array_equal(line.get_ydata(), found.end("rod1.angle")[[1, 2, 0]])
    assert second.get_ylabel() == "bob2.position.x, m"
    assert first.get_xlabel() == "mass1, kg"


def test_a_map_over_two_values() -> None:
    found = drawn({"mass1": [1.0, 2.0, 3.0]}, start={"rod1.angle": [0.1, 0.2]}, quantities=["rod2.angle"])
    figure = plot_sweep(found)
    axes = figure.axes[0]
    assert np.array_equal(axes.collections[0].get_array().reshape(3, 2), found.grid("rod2.angle"))
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("rod1.angle, rad", "mass1, kg")


def test_points_of_a_list_and_curves_of_a_grid() -> None:
    listed = drawn({"mass1": [1.0, 2.0], "mass2": [1.0, 3.0]}, combine="list", quantities=["rod2.angle"])
    assert plot_sweep(listed).axes[0].lines[0].get_linestyle() == "None"
    grid = drawn({"mass1": [1.0, 2.0], "mass2": [1.0, 3.0], "length1": [1.0, 1.5]}, quantities=["rod2.angle"])
    axes = plot_sweep(grid).axes[0]
    assert len(axes.lines) == 4
    assert "mass2 = 3, length1 = 1.5" in [text.get_text() for text in axes.get_legend().get_texts()]
    values = grid.grid("rod2.angle")
    for k, line in enumerate(axes.lines):
        assert np.array_equal(line.get_ydata(), values[:, k // 2, k % 2])


def test_failed_runs_leave_gaps() -> None:
    scene = DoublePendulum()
    found = sweep(scene, start={"bob1.position.x": [1.0, 0.5]}, t_end=0.1)
    assert found.failed == (1,)
    line = plot_sweep(found, "rod1.angle").axes[0].lines[0]
    assert list(np.isnan(line.get_ydata())) == [True, False]


def test_what_cannot_be_drawn_is_said() -> None:
    found = drawn({"mass1": [1.0, 2.0]})
    with pytest.raises(ResultError, match=r"rod1\.angle"):
        plot_sweep(found, ["rod1.angel"])
    with pytest.raises(UsageError, match="room"):
        plot_sweep(found, ["rod1.angle"] * 7)


def test_counts_are_numbers() -> None:
    found = sweep(Chain(), {"links": [2, 3]}, t_end=0.05, quantities=["rod[0].angle"])
    assert list(plot_sweep(found).axes[0].lines[0].get_xdata()) == [2.0, 3.0]
