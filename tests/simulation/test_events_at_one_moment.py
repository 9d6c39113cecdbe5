"""Events that happen together, where a run is begun again, and at its end, against what happens by itself."""

from typing import Any

import pytest

from atwood import (
    Component,
    Scalar,
    Scene,
    discrete_state,
    select,
    simulate,
    update,
)
from atwood_library import Force, PointMass, Table

from ..helpers.counters import Counter

WAYS = [*(("reduced", one) for one in ("explicit", "taylor", "ida", "ida-sundae")), ("dae", "explicit"), ("dae", "ida")]


class Clock(Component):
    """Counts its ticks."""

    ticks: Scalar = discrete_state(doc="How many.")

    @update(every=0.25, sets="ticks")
    def tick(self) -> Scalar:
        """Return one more."""
        return self.ticks + 1.0


def mover(velocity: float, at: float) -> Scene:
    """Return a mass that nothing acts on."""
    scene = Scene(space="line", line_axis=(1.0, 0.0, 0.0))
    scene.add("m", PointMass(mass=1.0))
    scene.start.update({"m.position.x": at, "m.velocity.x": velocity})
    return scene


def pushed(scene: Scene, value: Any = 0.0) -> Scene:
    """Return a scene with a force on its mass."""
    force = scene.add("force", Force(value=value))
    scene.connect(force.point, scene.m.point)
    return scene


def with_a_table(scene: Scene, at: float) -> Scene:
    """Return a scene with a force by a table that has a break point at a time."""
    table = scene.add("table", Table(table=[(0.0, 0.0), (at, 0.0), (2.0, 1e-3)]))
    scene.connect(table.output("value"), pushed(scene).force.input("value"))
    return scene


def with_a_clock(scene: Scene, at: float) -> Scene:
    """Return a scene with a part that is sampled."""
    scene.add("clock", Clock())
    return scene


MOMENTS = {
    "sample": with_a_clock,
    "switch": lambda scene, at: pushed(scene, lambda t: select(t < at, 0.0, 1e-3)),
    "table": with_a_table,
}


@pytest.mark.parametrize(("form", "solver"), WAYS)
@pytest.mark.parametrize("moment", MOMENTS)
@pytest.mark.parametrize(("velocity", "at"), [(1.0, -1.0), (0.1, -0.1), (0.3, -0.3), (0.7, -0.175), (-1 / 3, 1 / 3)])
def test_what_passes_zero_where_a_run_is_begun_again_is_seen_once(
    form: str, solver: str, moment: str, velocity: float, at: float
) -> None:
    scene = MOMENTS[moment](mover(velocity, at), -at / velocity)
    counter = scene.add("counter", Counter())
    scene.connect(counter.point, scene.m.point)
    condition = "m.position.x crosses 0"
    run = simulate(scene, form=form, solver=solver, t_end=1.5, outputs=4, record=condition)
    noted = [one.time for one in run.events if one.message == condition]
    assert noted == pytest.approx([-at / velocity], abs=1e-7)
    assert run["counter.passed"][-1] == 1.0


@pytest.mark.parametrize(("form", "solver"), WAYS)
def test_all_parts_whose_events_happen_together_change(form: str, solver: str) -> None:
    scene = mover(1.0, -0.3)
    for i, place in enumerate((0.0, 0.0, 1e-9, 0.2)):
        counter = scene.add(f"counter{i}", Counter(level=place))
        scene.connect(counter.point, scene.m.point)
    run = simulate(scene, form=form, solver=solver, t_end=1.0, outputs=4)
    assert [run[f"counter{i}.passed"][-1] for i in range(4)] == [1.0, 1.0, 1.0, 1.0]
    assert len(run.events) == 4


@pytest.mark.sample(5)
@pytest.mark.parametrize(("form", "solver"), WAYS)
def test_samples_and_events_at_the_end_are_taken(form: str, solver: str) -> None:
    scene = with_a_clock(mover(1.0, -1.0), 0.0)
    run = simulate(scene, form=form, solver=solver, t_end=1.0, outputs=5)
    assert run["clock.ticks"].tolist() == [1.0, 2.0, 3.0, 4.0, 5.0]
    assert run.time.tolist() == [0.0, 0.25, 0.5, 0.75, 1.0]
    later = simulate(scene, form=form, solver=solver, t_end=0.9, outputs=2)
    assert later["clock.ticks"][-1] == 4.0
    scene = mover(1.0, -0.5)
    counter = scene.add("counter", Counter())
    scene.connect(counter.point, scene.m.point)
    run = simulate(scene, form=form, solver=solver, t_end=0.5 * (1.0 + 1e-9), outputs=3)
    assert run["counter.passed"][-1] == 1.0
