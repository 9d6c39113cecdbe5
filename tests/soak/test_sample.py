"""A few trials of each kind with fixed seeds; thousands are made by `python -m tests.soak`."""

from __future__ import annotations

import numpy as np
import pytest

from atwood.numerics import contact_sets

from . import hostile, metamorphic, methods, poles, tables
from .draw import draw
from .kinds import run_trial
from .oracle import STEP, Oracle
from .scenes import Way, check_mechanism
from .trial import Discarded

WAYS = Way("reduced", solver="ida-sundae"), Way("dae", solver="ida-sundae")


@pytest.mark.sample(2)
@pytest.mark.parametrize("seed", [1, 2, 10, 16, 23])
def test_scenes_agree_with_the_oracle(seed: int) -> None:
    trial = check_mechanism(draw(seed, own=False), WAYS)
    assert "compared reduced" in trial.tried
    assert "compared dae" in trial.tried
    assert not trial.findings, trial.findings[0].detail


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("seed", "sorts"),
    [
        (400003, {"sampled"}),
        (400106, {"own_flywheel", "own_leak"}),
        (400130, {"own_flywheel", "own_spring", "rotational_gap"}),
        (400165, {"own_wire"}),
        (400267, {"own_swirl"}),
    ],
)
def test_own_components_stops_and_feedback_agree_with_the_oracle(seed: int, sorts: set[str]) -> None:
    mechanism = draw(seed)
    assert sorts <= {tie.sort for tie in mechanism.ties}
    trial = check_mechanism(mechanism, WAYS)
    assert {"compared reduced", "compared dae"} <= set(trial.tried)
    assert not trial.findings, trial.findings[0].detail


@pytest.mark.sample(2)
@pytest.mark.parametrize("seed", [1, 5, 6, 10, 13, 22])
def test_relations_hold(seed: int) -> None:
    trial = metamorphic.check(seed)
    assert any(word.startswith("compared") for word in trial.tried)
    assert not trial.findings, trial.findings[0].detail


@pytest.mark.sample(1)
@pytest.mark.parametrize("seed", [0, 1, 5])
def test_methods_agree(seed: int) -> None:
    trial = methods.check(seed)
    assert any(word.startswith("compared") for word in trial.tried)
    assert not trial.findings, trial.findings[0].detail


@pytest.mark.sample(4)
@pytest.mark.parametrize(
    ("kind", "seed"),
    [(kind, seed) for kind in ("levels", "stiff", "claims") for seed in (1, 3, 4)] + [("rest", 12)],
)
def test_closed_forms_are_met(kind: str, seed: int) -> None:
    trial, _ = run_trial(kind, seed)
    assert "compared" in trial.tried
    assert not trial.findings, trial.findings[0].detail


@pytest.mark.sample(2)
@pytest.mark.parametrize("seed", [101, 103, 110, 117, 131, 175])
def test_tables_agree_with_scipy(seed: int) -> None:
    trial = tables.check(seed)
    assert not trial.findings, trial.findings[0].detail


@pytest.mark.sample(1)
@pytest.mark.parametrize("kind", [hostile, poles], ids=["hostile", "poles"])
def test_files_and_poles(kind) -> None:
    for seed in range(6):
        trial = kind.check(seed)
        assert not trial.findings, (seed, trial.findings[0])


@pytest.mark.sample(1)
@pytest.mark.parametrize("seed", [3, 5, 6])
def test_laws_of_contact_hold(seed: int) -> None:
    trial, _ = run_trial("contacts", seed)
    assert "compared" in trial.tried
    assert not trial.findings, trial.findings[0].detail


@pytest.mark.sample(1)
@pytest.mark.parametrize("seed", [3, 52, 5, 11, 81])
def test_accuracies_of_contacts_are_reached(seed: int) -> None:
    """The first two end at an impact but for rounding; the last has an output among impacts that are summed."""
    trial, _ = run_trial("contact_accuracies", seed)
    assert "met" in trial.tried
    assert not trial.findings, trial.findings[0].detail


@pytest.mark.sample(1)
@pytest.mark.parametrize("seed", [1, 4, 8])
def test_sets_of_contacts_are_among_all_there_are(seed: int) -> None:
    trial, _ = run_trial("sets", seed)
    assert "compared" in trial.tried
    assert not trial.findings, trial.findings[0].detail


@pytest.mark.parametrize("seed", [2101, 6172, 5015])
def test_slips_begin_the_right_way_and_what_can_rest_does(seed: int) -> None:
    """Rounding of speeds does not turn the one; the least forces of the other contradict a law, and others none."""
    trial, _ = run_trial("sets", seed)
    assert "compared" in trial.tried
    assert not trial.findings, trial.findings[0].detail


@pytest.mark.parametrize("seed", [4, 5])
def test_sets_of_contacts_that_contradict_a_law_are_found(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(contact_sets, "_contradiction", lambda *given: (-1, (0, (0.0,))))  # whatever is tried is taken
    assert any(one.gravity == "wrong" for one in run_trial("sets", seed)[0].findings)


def test_rates_beside_a_pole_do_not_ask_for_more_samples_than_there_can_be() -> None:
    """Here 10 GB were taken."""
    with pytest.warns(UserWarning, match="may be counted wrong by whole turns"):
        trial = poles.check(3018)
    assert not trial.findings, trial.findings[0]


def test_the_oracle_is_consistent_by_itself() -> None:
    """The rows on the speeds are the rates of what the constraints hold, by complex steps along the motion."""
    looked_at = 0
    for seed in range(40):
        try:
            mechanism = draw(seed)
        except Discarded:
            continue
        oracle = Oracle(mechanism)
        place, speeds = oracle.start()
        values, rows, rates = oracle.constraints(oracle._moving(place, speeds), 1j * STEP)
        for (name, number), value, row, rate in zip(oracle.owners(), values, rows, rates, strict=True):
            tie = mechanism.tie(name)
            if tie.grips or (tie.sort.startswith("rolling") and number > 0):
                continue  # angles are counted in real numbers; what holds speeds alone has no value
            assert np.imag(value) / STEP == pytest.approx(float((row @ speeds + rate).real), abs=1e-9), tie.sort
            looked_at += 1
    assert looked_at > 100


@pytest.mark.parametrize("seed", [1000, 1001, 1002, 1003])
def test_laws_that_compare_places_agree_with_parabolas(seed: int) -> None:
    trial, _ = run_trial("switches", seed)
    assert not trial.findings, trial.findings[0].detail
