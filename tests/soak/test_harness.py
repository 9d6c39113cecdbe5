"""The soak itself: what it draws is sound, and what it calls a hang is one."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from . import workers
from .build import build_scene, plane_angles
from .draw import draw
from .oracle import Oracle
from .relations import RELATIONS
from .summary import as_data, progress_line
from .trial import Discarded, Finding, Trial
from .workers import Done


def test_no_start_is_singular() -> None:
    """A rod that is in line with the pin of its body holds it as well, to first order, as if it were redundant."""
    with pytest.raises(Discarded, match="singular"):
        draw(201393, own=False)


@pytest.mark.parametrize("seed", [200247, 200951])
def test_no_damper_has_axes_that_point_against_each_other(seed: int) -> None:
    mechanism = draw(seed, own=False)
    assert all(tie.sort != "torsion_damper" for tie in mechanism.ties)
    oracle = Oracle(mechanism)
    place, speeds = oracle.start()
    assert np.all(np.isfinite(oracle.accelerations(place, speeds, 0.0)[0]))


@pytest.mark.sample(0)
def test_a_crank_that_is_driven_beyond_its_reach_comes_to_a_singular_position() -> None:
    oracle = Oracle(draw(1159, own=False))
    assert oracle.is_singular_on_the_way(np.linspace(0.0, 0.3, 31))
    assert not Oracle(draw(1, own=False)).is_singular_on_the_way(np.linspace(0.0, 0.3, 4))


def test_a_trial_that_waits_for_the_processor_is_no_hang(monkeypatch: pytest.MonkeyPatch) -> None:
    class Process:
        pid = 1

    worker = workers._Worker(Process(), None, ("scenes", 1), since=0.0)  # type: ignore[arg-type]
    monkeypatch.setattr(workers.time, "monotonic", lambda: 100.0)
    monkeypatch.setattr(workers, "_processor_time", lambda pid: 3.0)
    assert workers._look(worker, False, 60.0) is None
    monkeypatch.setattr(workers, "_dismiss", lambda worker: None)
    monkeypatch.setattr(workers, "_processor_time", lambda pid: 61.0)
    done = workers._look(worker, False, 60.0)
    assert done is not None
    assert isinstance(done.trial, Trial)
    assert done.trial.findings[0].gravity == "hang"


def test_the_summary_counts_by_groups_and_names_the_slowest() -> None:
    done = [
        Done("scenes", 7, Trial(("space: line", "joint: pivot", "compared dae")), 0.5),
        Done("scenes", 8, Trial(("space: line", "discarded: immobile")), 2.0),
        Done("scenes", 9, Trial(("space: plane",), (Finding("wrong", "dae: speeds", "1e-3"),)), 1.0),
    ]
    found = json.loads(json.dumps(as_data(done, 4.0)))
    scenes = found["tried"]["scenes"]
    assert scenes["words"]["space"] == {"line": 2, "plane": 1}
    assert scenes["words"][""] == {"compared dae": 1}
    assert [each["seed"] for each in scenes["slowest"]] == [8, 9, 7]
    assert (scenes["trials"], scenes["with_findings"]) == (3, 1)
    assert found["findings"] == [
        {"kind": "scenes", "seed": 9, "gravity": "wrong", "what": "dae: speeds", "detail": "1e-3"}
    ]
    assert progress_line(done, 30, 4.0).startswith("3 of 30: 1 with findings, 1 discarded, 1.17 s a trial")


def test_relations_do_not_change_a_mechanism() -> None:
    """Turns of angles in a plane, and what a body on a line carries, are those of the first description."""
    random = np.random.default_rng(0)
    for seed in (500095, 500060):
        mechanism = draw(seed)
        related = RELATIONS["renamed" if mechanism.space == "plane" else "moved and turned"](mechanism, random)
        first, second = Oracle(mechanism), Oracle(related.mechanism)
        starts = first.start(), second.start()
        energies = [one.energy(*start, 0.0) for one, start in zip((first, second), starts, strict=True)]
        assert energies[0][0] == pytest.approx(energies[1][0])
        if mechanism.space == "plane":
            assert plane_angles(related.mechanism) == {
                related.names(name): angle for name, angle in plane_angles(mechanism).items()
            }
        else:
            powers = [
                float(one.forces(*start, 0.0) @ start[1]) for one, start in zip((first, second), starts, strict=True)
            ]
            assert powers[0] == pytest.approx(powers[1])


def test_a_body_that_is_split_keeps_its_turns() -> None:
    mechanism = draw(500284)
    angles = plane_angles(mechanism)
    for seed in range(4):
        found = plane_angles(RELATIONS["split"](mechanism, np.random.default_rng(seed)).mechanism)
        assert found.items() >= angles.items()


def test_gears_may_be_named_before_their_joints() -> None:
    mechanism = draw(500015)
    assert any(tie.grips for tie in mechanism.ties)
    backwards = replace(mechanism, ties=mechanism.ties[::-1])
    assert len(build_scene(backwards).parts) == len(build_scene(mechanism).parts)
