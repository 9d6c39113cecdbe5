"""Changes of a start from its conditions, beside those by differences of starts."""

import numpy as np
import pytest
from tests.study.sensitivities.test_events import slack_rope

from atwood import assemble, simulate
from atwood.simulation.initialization.start import own_state
from atwood.study.sensitivities.columns import find_columns
from atwood.study.sensitivities.starts import exact_changes
from atwood_library.scenes import AndrewsSqueezer, ChaplyginSleigh, DoublePendulum, FourBar


def changes(kind, form, parameters, start):
    """Return the changes from conditions, and those by differences."""
    run = simulate(assemble(kind(), form=form), t_end=0.01, outputs=2).run
    columns = find_columns(run.assembly, run.start, parameters, start)
    names = [one.name for one in run.assembly.parameters]
    seeds = np.array([[one.scale * (name in one.symbols) for name in names] for one in columns])
    here = own_state(run.assembly, run.start)
    return exact_changes(run.assembly, run.start, columns, seeds), [
        one.start(here, run.start.length) for one in columns
    ]


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize(
    ("kind", "parameters", "start"),
    [
        (DoublePendulum, ["length1", "rod2.length", "mass1"], ["rod1.angle", "rod2.angular_velocity"]),
        (FourBar, ["rocker.length", "crank.length", "gravity"], ["crank.angle", "crank.angular_velocity"]),
        (AndrewsSqueezer, ["k1.length", "k4.length"], []),
    ],
)
def test_meets_differences(kind, parameters, start, form):
    exact, near = changes(kind, form, parameters, start)
    for one, other in zip(exact, near, strict=True):
        assert one == pytest.approx(other, abs=1e-11 * (1.0 + np.max(np.abs(other))))


def test_what_does_not_follow_from_conditions_is_left_to_differences():
    for kind, parameter in ((ChaplyginSleigh, "speed"), (slack_rope, "rope.length")):
        exact, near = changes(kind, "reduced", [parameter], [])
        assert exact == [None]
        assert np.max(np.abs(near)) == pytest.approx(1.0, rel=1e-9)
