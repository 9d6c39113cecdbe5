"""Derivatives by going back: against those by columns, which have nothing in common with them but the equations."""

import numpy as np
import pytest
from tests.study.sensitivities.test_events import in_wind, pushed, slack_rope, stops
from tests.study.sensitivities.test_inputs import NODES, pendulum, sampled

from atwood import assemble, sensitivities
from atwood.study.sensitivities import passage
from atwood.study.sensitivities.columns import find_columns
from atwood.study.sensitivities.pulled import Pulled
from atwood_library.scenes import (
    BouncingBall,
    CartPole,
    Chain,
    ChaplyginSleigh,
    DoublePendulum,
    DrivenPendulum,
    FourBar,
    LagrangeTop,
    NewtonsCradle,
    RockingBlock,
    RollingDisc,
    SliderCrank,
    StickSlip,
    Woodpecker,
)

CASES = [
    (DoublePendulum, ["bob2.position.x", "rod1.tension"], ["mass1", "length1"], ["rod1.angle"], 2.0),
    (FourBar, ["rocker.position.x"], ["rocker.length"], ["crank.angular_velocity"], 1.0),
    (SliderCrank, [], ["crank.length"], [], 0.5),
    (DrivenPendulum, ["rod.angle"], ["motion.amplitude"], [], 1.0),
    (RollingDisc, ["disc.position.x"], [], ["disc.spin.x"], 1.0),
    (ChaplyginSleigh, ["sleigh.position.x"], ["speed"], [], 1.0),
    (LagrangeTop, ["top.theta"], ["top.mass"], [], 1.0),
    (BouncingBall, ["ball.position.z"], ["height"], [], 0.8),
    (StickSlip, ["body.position.x"], ["belt_speed"], [], 3.0),
    (RockingBlock, ["block.angle"], ["tilt"], [], 1.0),
    (CartPole, ["rail.displacement"], ["lean"], [], 0.1),
    (NewtonsCradle, ["rod5.angle"], ["ball5.mass"], [], 0.8),
    (slack_rope, ["bob.position.x"], ["rope.length"], ["bob.velocity.x"], 1.5),
    (stops, ["bob.position.x"], ["floor.friction"], ["bob.velocity.x"], 1.0),
    (pushed, ["bob.position.x"], ["source.start_time", "source.width"], [], 1.0),
    (in_wind, ["bob.position.x"], ["wind.place"], ["bob.velocity.x"], 1.0),
]


def both(scene, quantities, **about):
    assembly = assemble(scene, form=about.pop("form"))
    return [sensitivities(assembly, quantities, mode=mode, rtol=1e-12, **about) for mode in ("forward", "adjoint")]


def assert_alike(forward, adjoint):
    largest = np.max(np.abs(forward.derivatives), axis=2, keepdims=True)
    assert np.all(np.abs(adjoint.derivatives - forward.derivatives) <= 1e-10 * (1.0 + largest))
    assert adjoint.values == pytest.approx(forward.values, rel=1e-9, abs=1e-9)
    assert np.max(largest) > 1e-3


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize(("kind", "quantities", "parameters", "start", "t_end"), CASES)
def test_is_alike(kind, quantities, parameters, start, t_end, form):
    about = {"parameters": parameters, "start": start, "t_end": t_end, "form": form}
    assert_alike(*both(kind(), quantities, outputs=[0.0, 0.4 * t_end, t_end], **about))


@pytest.mark.parametrize("between", ["linear", "held"])
@pytest.mark.parametrize("kind", [pendulum, lambda: pendulum(rope=True), sampled])
def test_by_inputs_is_alike(kind, between):
    about = {"inputs": {"push.value": NODES}, "between": between, "t_end": 1.2, "form": "reduced"}
    found = both(kind(), ["bob.position.x", "push.force"], parameters=["bob.mass"], outputs=[0.5, 1.2], **about)
    assert_alike(*found)


def test_states_are_moved_no_farther_than_impacts_are_smooth(monkeypatch):
    about = {"parameters": ["spring.stiffness"], "t_end": 0.15, "outputs": [0.15], "rtol": 1e-12}
    found = sensitivities(Woodpecker(), ["sleeve.position.z"], **about)
    monkeypatch.setattr(passage, "_MOVED", (1e-2, *passage._MOVED))  # here a hundredth is too far
    far = sensitivities(Woodpecker(), ["sleeve.position.z"], mode="adjoint", **about)
    assert far.derivatives == pytest.approx(found.derivatives, rel=1e-8)


def test_goes_back_once_for_any_number_of_columns(monkeypatch):
    calls = []
    back = Pulled.back
    monkeypatch.setattr(Pulled, "back", lambda self, *given: calls.append(1) or back(self, *given))
    assembly = assemble(Chain(links=5))
    paths = [one.name for one in assembly.parameters]
    found = sensitivities(assembly, ["rod[4].angle"], parameters=paths, outputs=[1.0])
    assert len(calls) == 1
    assert found.by == tuple(paths)
    near = sensitivities(assembly, ["rod[4].angle"], parameters=paths, outputs=[1.0], mode="forward")
    assert found.derivatives == pytest.approx(near.derivatives, abs=1e-7)


def test_a_value_of_a_leaf_needs_no_other_scene():
    assembly, pairs = assemble(DoublePendulum()), [("bob1.mass", "mass1"), ("rod1.length", "length1")]
    start = sensitivities(assembly, ["rod1.angle"], parameters=["bob1.mass"], outputs=[0.1]).result.run.start
    columns = find_columns(assembly, start, [*pairs[0], "rod1.length"], [])
    assert [(one.symbols, one.leaves_start) for one in columns] == [
        (frozenset({"bob1.mass"}), True),
        (frozenset({"bob1.mass"}), True),
        (frozenset({"rod1.length"}), False),
    ]
    for pair in pairs:
        found = [sensitivities(DoublePendulum(), form="dae", parameters=[one], outputs=[0.5]) for one in pair]
        assert found[0].derivatives == pytest.approx(found[1].derivatives, rel=1e-7, abs=1e-8)
