"""The library's scenes with contact, impact and dry friction: known answers, in both forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import atwood as aw
from atwood import simulate
from atwood.simulation.run.run_record import run_again
from atwood_library.scenes import (
    Billiards,
    BouncingBall,
    Clutches,
    NewtonsCradle,
    RockingBlock,
    StickSlip,
    Woodpecker,
)

FORMS = pytest.mark.parametrize("form", ["reduced", "dae"])


def run(scene: aw.Scene, form: str, **options: object) -> aw.Result:
    return simulate(scene, form=form, rtol=1e-10, **{"outputs": 3, **options})


def times(result: aw.Result, kind: str) -> list[float]:
    return [one.time for one in result.events if one.kind == kind]


@FORMS
@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_bouncing_ball(form: str, restitution: float) -> None:
    rests = math.sqrt(2.0 * 3.0 / 9.81) * (1.0 + restitution) / (1.0 - restitution)
    result = run(BouncingBall(height=3.0, restitution=restitution), form)
    assert times(result, "rests" if restitution else "impact")[-1] == pytest.approx(rests, abs=1e-9)
    assert result["floor.gap_state"][-1] == 1.0


@FORMS
def test_newtons_cradle_hands_the_speed_on(form: str) -> None:
    scene = NewtonsCradle()
    quarter = scene.first_impact()
    result = run(scene, form, impacts="one_by_one", t_end=2.0 * quarter)
    assert [(one.part, one.kind) for one in result.events if one.kind == "impact"] == [
        (f"touch{i}", "impact") for i in range(1, 5)
    ]
    assert times(result, "impact") == pytest.approx([quarter] * 4, abs=1e-10)
    angles = [float(result[f"rod{i}.angle"][-1]) for i in range(1, 6)]
    assert angles == pytest.approx([0.0, 0.0, 0.0, 0.0, 0.5], abs=1e-9)


@FORMS
def test_newtons_cradle_as_bodies_that_touch(form: str) -> None:
    scene = NewtonsCradle(balls=3)
    quarter = scene.first_impact()
    result = run(scene, form, outputs=[0.0, quarter - 1e-9, quarter + 1e-9], t_end=quarter + 1e-9)
    before, after = (np.array([float(result[f"rod{i}.angular_velocity"][k]) for i in (1, 2, 3)]) for k in (-2, -1))
    assert after == pytest.approx(before[0] * np.array([-1.0, 2.0, 2.0]) / 3.0, abs=1e-7)


@FORMS
@pytest.mark.sample(1)
def test_rocking_block(form: str) -> None:
    found = times(run(RockingBlock(), form, t_end=3.0), "impact")
    assert found[0] == pytest.approx(0.5999358452, abs=1e-9)
    assert next(one for one in found if one > 2.9) == pytest.approx(2.9278155896, abs=1e-9)


@FORMS
def test_stick_slip(form: str) -> None:
    periods = np.diff(times(run(StickSlip(), form), "slips"))
    assert periods == pytest.approx(np.full(len(periods), 0.6693570623), abs=1e-9)


@FORMS
def test_clutches(form: str) -> None:
    known = [0.7096214747, 0.7916623592, 0.8311085061, 0.9068501928, 1.0002958599, 1.1439674925]
    found = [one.time for one in run(Clutches(), form).events if one.time > 0.5 and one.time != 0.9]
    assert found == pytest.approx(known, abs=1e-9)


@FORMS
@pytest.mark.sample(1)
def test_billiards_on_a_smooth_table_part_at_a_right_angle(form: str) -> None:
    """Without friction and loss: the ball goes along the line of centres, and the cue ball square to it."""
    scene = Billiards(cloth=0.0, friction=0.0, restitution=1.0, spin=0.0, t_end=0.2)
    result = run(scene, form)
    side = math.asin(scene.aside / (2.0 * scene.radius))
    cue, ball = ([float(result[f"{name}.velocity.{axis}"][-1]) for axis in "xyz"] for name in ("cue", "ball"))
    hit = 2.0 * math.cos(side)
    assert ball == pytest.approx([hit * math.cos(side), hit * math.sin(side), 0.0], abs=1e-9)
    assert cue == pytest.approx([2.0 - ball[0], -ball[1], 0.0], abs=1e-9)


@pytest.mark.sample(1)
@pytest.mark.parametrize("spin", [-30.0, 0.0, 70.0])
def test_billiards_keep_what_friction_keeps(spin: float) -> None:
    """About a point of the cloth friction has no moment: a ball rolls at 5/7 v + 2/7 r w (Coriolis)."""
    scene = Billiards(spin=spin, away=5.0, aside=0.1)
    result = run(scene, "reduced")
    rolls = (5.0 * scene.speed + 2.0 * scene.radius * spin) / 7.0
    assert result["cue.velocity.x"][-1] == pytest.approx(rolls, abs=1e-9)
    assert result["below_cue.slip_in_space_state"][-1] == 2.0


@FORMS
@pytest.mark.sample(1)
def test_woodpecker(form: str) -> None:
    """It comes down in steps that become alike, shorter than those of Glocker's model, in which angles are small."""
    result = run(Woodpecker(), form, t_end=0.6)
    hits = [one.time for one in result.events if (one.part, one.kind) == ("beak", "impact")]
    periods = np.diff(hits)
    assert periods[-1] == pytest.approx(0.1308, abs=2e-3)
    assert np.all(np.abs(np.diff(periods))[1:] < 0.8 * np.abs(np.diff(periods))[:-1])
    assert result["sleeve.position.z"][-1] < -0.05
    assert {one.part for one in result.events if one.kind == "impact"} == {"lower", "upper", "beak"}
    assert result.energy.max_drift < 1e-8


@FORMS
def test_samples_in_between_change_no_bit_of_a_run_with_impacts(form: str) -> None:
    """States at events were rounded by how many samples came before, so that work was none within the steps."""
    result = simulate(Woodpecker(), form=form, t_end=0.3)
    again = run_again(result.run, np.linspace(0.0, 0.3, 3001)[1:-1])
    assert again is not None
    assert [one.time for one in again.events] == [one.time for one in result.events]
    ends = [
        [np.append(one.coordinates[:, -1], one.speeds[:, -1]) for one in each.segments] for each in (result.run, again)
    ]
    np.testing.assert_array_equal(*ends)
    assert result.energy.max_drift < 1e-8
