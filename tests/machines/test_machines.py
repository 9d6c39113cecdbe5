from __future__ import annotations

import numpy as np
import pytest

from .emulated import MACHINES, USED
from .margins import ratio_in, ratio_of_arrays
from .run import Run, run_as
from .tightest import tightest


def test_comparisons_of_known_size() -> None:
    value, values = 1.0 + 1e-9, np.array([1.0, 1.0 + 1e-9])
    assert abs(value - 1.0) < 4e-9
    assert value == pytest.approx(1.0, abs=2e-9)
    assert values == pytest.approx(np.ones(2), abs=5e-9)
    assert np.allclose([0.0, 1e-9], 0.0, atol=1e-8)
    assert not np.allclose([0.0, 1e-3], 0.0, atol=1e-8)
    np.testing.assert_allclose([0.0, 1e-9], 0.0, atol=2e-8)


def test_a_run_as_on_a_plain_processor_records_every_comparison() -> None:
    run = run_as(MACHINES["nehalem"], [f"{__file__}::test_comparisons_of_known_size"], workers=1)
    assert run.finished, run.said
    assert list(run.outcomes.values()) == ["passed"]
    (margins,) = run.margins.values()
    found = sorted(round(ratio, 3) for ratio in margins.values())
    assert found == [0.05, 0.1, 0.2, 0.25, 0.5]


def test_a_run_that_found_no_test_or_crashed_is_not_finished() -> None:
    assert not Run(1.0, 4, "no tests").finished
    assert not Run(1.0, -11, "", {"test": "passed"}).finished
    assert not Run(1.0, 0, "").finished


@pytest.mark.parametrize(
    ("explanation", "ratio"),
    [
        ("1e-09 < 1e-08", 0.1),
        ("np.float64(2.0e-09) <= 1e-08\n  + where ...", 0.2),
        ("(3.0 < 4.0 and 1.0 < 4.0)", 0.75),
        ("12 <= 12", None),
        ("5 > 4", None),
        ("(9 - 8) < 3", None),
        ("(5 < 4) == False", None),
        ("-1.0 < 2.0", None),
        ("array([1, 2]) < 3", None),
        ("'a' in 'abc'", None),
    ],
)
def test_values_and_bounds_in_an_explanation(explanation: str, ratio: float | None) -> None:
    assert ratio_in(explanation) == (None if ratio is None else pytest.approx(ratio))


def test_the_largest_difference_of_arrays_counts() -> None:
    assert ratio_of_arrays([1.0, 2.0], [1.0, 2.0 + 1e-9], 0.0, 1e-8) == pytest.approx(0.1)
    assert ratio_of_arrays([np.nan, np.inf], [np.nan, np.inf], 0.0, 1e-8) == 0.0
    assert ratio_of_arrays([1.0], [1.0], 0.0, 0.0) == 0.0
    assert ratio_of_arrays([], [], 0.0, 1e-8) is None


def test_only_what_differs_between_machines_is_tight() -> None:
    def run(margins: dict[str, float]) -> Run:
        return Run(1.0, 0, "", {"test": "passed"}, {"test": margins})

    runs = {"a": run({"same": 0.99, "small": 0.1, "large": 0.5}), "b": run({"same": 0.99, "small": 0.2, "large": 0.9})}
    found = tightest(runs, 50)
    assert [bound.text for bound in found] == ["large", "small"]
    assert found[0].ratios == {"a": 0.5, "b": 0.9}


def test_another_machine_has_other_settings() -> None:
    assert MACHINES["this"].environment == {}
    environment = MACHINES["nehalem"].environment
    assert environment["OPENBLAS_CORETYPE"] == "Nehalem"
    assert set(environment.get("NPY_DISABLE_CPU_FEATURES", "").split()) == USED
