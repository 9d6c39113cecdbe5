"""Every scene of the library in both forms: each is right to 1e-8, and they agree to 1e-7 at every quantity."""

from __future__ import annotations

import numpy as np
import pytest

from atwood import Result, Scene, report, simulate
from atwood.simulation.dynamics.balance import balance_of
from atwood.simulation.dynamics.reactions import maximal_state
from atwood_library.scenes import Bricard, FourBarRow

from ..helpers.arcs import by_arcs
from ..helpers.runs import FORMS
from ..helpers.smooth import SMOOTH as SCENES

TIGHT = 1e-12

SPANS = {
    "chain": (0.3, "its bobs are thrown about, so that errors grow"),
    "double-pendulum-3d": (0.7, "errors grow"),
    "flyball-governor": (0.05, "its dampers are stiff: hundreds of arcs in 0.1 s"),
    "four-bar-row": (0.6, "it comes to a singular position at 0.71 s; passages have tests of their own"),
    "gyroscope": (0.2, "its rotor spins at 100 rad/s, 3 turns in this time"),
    "lagrange-top": (0.7, "it spins at 50 rad/s"),
    "rolling-ball": (0.5, "its spin keeps what errors IDA makes"),
    "rolling-disc": (0.6, "it wobbles, which doubles errors in each second"),
    "slider-crank": (0.5, "errors grow"),
    "spatial-slider-crank": (0.4, "errors grow"),
    "stewart-platform": (0.2, "a large program; an arc takes 0.2 s to find"),
}
"""Where less than a second is compared (s), and why."""

BOUNDS = {"andrews-squeezer": 1e-7, "benchmark-bicycle": 1e-7, "strandbeest": 1e-7}
"""Where 1e-8 is not met: stiff, or constrained in many ways, with accelerations and forces far above one."""

ONE_TURN = {"rigid-bodies": ".angle"}
"""Quantities that say nothing: the angle in the plane x-z of rods that lie across it."""

TIGHTER = {"flyball-governor": 1e-13}
"""Its springs' forces are those of 4e5 N/m for small differences of lengths."""


def span(name: str) -> float:
    """Return how much of a scene is compared."""
    return min(SPANS.get(name, (1.0, ""))[0], float(SCENES[name]().t_end))


def gap(one: Result, other: Result) -> dict[str, float]:
    """Return how far two runs are apart at every quantity that both have, relative to its size but at least to 1.

    Angles about an axis that may be upright, and their rates, say nothing there; the axes say the same.
    """
    found = {}
    paths = [
        path for path in one.paths if path in other and not path.endswith((".phi", ".psi", "phi_rate", "psi_rate"))
    ]
    table, expected = one.table(paths), other.table(paths)
    for path in paths:
        values, right = table[path], expected[path]
        assert np.array_equal(np.isnan(values), np.isnan(right)), path
        known = ~np.isnan(right)
        size = max(1.0, float(np.max(np.abs(right[known]), initial=0.0)))
        found[path] = float(np.max(np.abs(values - right)[known], initial=0.0)) / size
    return found


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", SCENES)
def test_each_form_is_right_and_both_agree(name: str) -> None:
    end = span(name)
    runs = [
        simulate(SCENES[name](), form=form, rtol=TIGHTER.get(name, TIGHT), t_end=end, outputs=6, samples=6)
        for form in FORMS
    ]
    assert [one.form for one in runs] == list(FORMS)
    exact = by_arcs(runs[0])
    for run in runs:
        assert run.status == "finished"
        bound, silent = BOUNDS.get(name, 1e-8), ONE_TURN.get(name, " ")
        found = {path: size for path, size in gap(run, exact).items() if not path.endswith(silent)}
        wrong = {path: size for path, size in found.items() if not size < bound}
        assert not wrong, run.form
    apart = {path: size for path, size in gap(*runs).items() if not path.endswith(ONE_TURN.get(name, " "))}
    wrong = {path: size for path, size in apart.items() if not size < 10.0 * BOUNDS.get(name, 1e-8)}
    assert not wrong
    # what one form has and the other has not are Euler angles that it does not need
    only = set(runs[0].paths) ^ set(runs[1].paths)
    assert all(path.endswith(("phi_rate", "theta_rate", "psi_rate")) for path in only)


def test_reasons_are_given_for_scenes_that_there_are() -> None:
    assert set(SPANS) | set(TIGHTER) <= set(SCENES)


# -- redundant constraints ---------------------------------------------------------------------------------------------


def test_bricard_says_which_reactions_are_not_unique() -> None:
    found = report(Bricard())
    assert len(found.redundant) == 1
    assert found.redundant[0].startswith("hinge")
    joints = {path.split(".")[0] for path in found.not_unique}
    assert joints == {f"hinge{i}" for i in range(1, 7)}
    said = " ".join(str(found).split())
    assert f"{found.redundant[0]}: it follows from the other constraints and is left out" in said
    assert "not unique; those of least norm are reported" in said


@pytest.mark.sample(1)
@pytest.mark.parametrize("make", [Bricard, lambda: FourBarRow(space="space")])
def test_reactions_of_redundant_constraints_are_those_of_least_size(make: type[Scene]) -> None:
    # Every other solution differs by something that pulls nothing; that of least size is at right angles to all such.
    seen, redundant = [], len(report(make()).redundant)
    for form in FORMS:
        result = simulate(make(), form=form, rtol=1e-11, t_end=0.3, outputs=4)
        assembly, segment = result.assembly, result.run.segments[0]
        found = {one.key: one.sign * result[one.path] for one in assembly.reactions if one.axis < 0}
        multipliers = np.stack([found[one.key] for one in assembly.maximal.constraints])
        states = segment.coordinates[:, segment.shown], segment.speeds[:, segment.shown]
        places, speeds = maximal_state(assembly, result.time, *states)
        balance = balance_of(assembly, "dae")
        for k, t in enumerate(result.time):
            slope = balance.at(float(t), places[:, k], speeds[:, k]).jacobian
            _, sizes, directions = np.linalg.svd(slope.T)
            idle = directions[int(np.sum(sizes > 1e-9 * sizes[0])) :]
            assert len(idle) == redundant
            assert np.max(np.abs(idle @ multipliers[:, k])) < 1e-9 * np.max(np.abs(multipliers[:, k]))
        seen.append(multipliers)
    assert np.max(np.abs(seen[0] - seen[1])) < 1e-7 * np.max(np.abs(seen[0]))


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_what_redundant_reactions_have_in_common_is_unique(form: str) -> None:
    # Which of two bearings carries how much is open; together they carry weight and inertia.
    middle, step = 0.7, 2e-3
    times = middle + step * np.arange(-3, 4)
    result = simulate(Bricard(), form=form, rtol=1e-12, t_end=1.0, outputs=times)
    bodies = [f"rod{i}" for i in range(1, 6)]
    for axis in "xyz":
        momentum = sum(result[f"{body}.velocity.{axis}"] for body in bodies)
        rate = float(np.dot([-1, 9, -45, 0, 45, -9, 1], momentum)) / (60 * step)
        carried = result[f"near.force.{axis}"][3] + result[f"far.force.{axis}"][3]
        weight = 5.0 * 9.81 if axis == "z" else 0.0
        assert abs(carried - rate - weight) < 1e-7


@pytest.mark.sample(1)
@pytest.mark.parametrize("form", FORMS)
def test_unique_reactions_of_a_row_in_space_are_those_in_the_plane(form: str) -> None:
    flat, deep = (
        simulate(FourBarRow(space=space), form=form, rtol=1e-12, t_end=0.5, outputs=6) for space in ("plane", "space")
    )
    found = report(FourBarRow(space="space"))
    assert len(found.redundant) == 6
    reactions = {one.path for one in deep.assembly.reactions}
    unique = [path for path in sorted(reactions - set(found.not_unique)) if path in flat]
    assert {"foot[0].force.x", "left[1].force.z", "right[0].force.x"} <= set(unique)
    for path in unique:
        assert np.max(np.abs(flat[path] - deep[path])) < 1e-7 * max(1.0, np.max(np.abs(flat[path]))), path
    for path in found.not_unique:  # all of them across the plane, in which nothing acts
        assert np.max(np.abs(deep[path])) < 1e-8, path
