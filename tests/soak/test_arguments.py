"""Bad arguments of public functions are refused by name: of every argument a few of the soak's bad values."""

from __future__ import annotations

import random

import pytest

import atwood

from . import calls_of_theory
from .arguments import attempts, make, parameters_of
from .calls import calls

_SLOW = ("plot", "plot_mechanism", "animate", "plot_comparison", "plot_sweep", "Result.plot", "compare")
"""What draws, or runs many times, before it comes to a bad file; tried in the soak alone but for one value."""

_OF_THEORY = {call.name for call in calls_of_theory.calls()}


def _chosen() -> list[object]:
    chance, by_argument = random.Random(3), {}
    for one in attempts():
        by_argument.setdefault(one.label, []).append(one)
    found = []
    for some in by_argument.values():
        found += chance.sample(some, min(len(some), 1 if some[0].call.name in (*_SLOW, *_OF_THEORY) else 2))
    return found


def test_a_bad_argument_is_refused_by_name() -> None:
    findings = [finding for one in _chosen() for finding in [make(one)[1]] if finding is not None]
    assert not findings, "\n".join(f"{one.gravity}: {one.detail}" for one in findings)


@pytest.mark.parametrize("name", ["assemble", "simulate", "sweep", "compare", "report", "save_result", "plot"])
def test_all_arguments_are_tried(name: str) -> None:
    tried = {argument for call in calls() if call.name == name for argument in call.kinds}
    assert set(parameters_of(getattr(atwood, name))) <= tried | {"guess"}


@pytest.mark.parametrize("angle", [1e308, -1e300, 1e10, "1e308 rad", "1e12 deg"])
def test_an_angle_that_has_lost_its_digits_is_refused(angle: float | str) -> None:
    from atwood_library.scenes import SCENES

    class Far(SCENES["simple-pendulum"]):
        def build(self) -> None:
            self.start["rod.angle"] = angle

    with pytest.raises(atwood.AtwoodError, match=r"rod\.angle: .*(too large|is known to)"):
        atwood.assemble(Far())


def test_a_number_whose_square_is_none_is_refused() -> None:
    from atwood_library import PointMass

    for mass in (1e-200, 1e200):
        with pytest.raises(atwood.ParameterError, match=r"mass: .* is too (small|large)"):
            PointMass(mass=mass)
