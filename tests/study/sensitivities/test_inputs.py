"""Derivatives by inputs at nodes: against formulas, and against differences of runs."""

import numpy as np
import pytest

from atwood import AtwoodError, Component, Scene, UsageError, discrete_state, parameter, sensitivities, signal, update
from atwood.study.sensitivities import changes, passage
from atwood_library import Drive, Force, Ground, PointMass, PositionSensor, Rod, Rope, SampledFeedback, Slider

NODES = [(0.0, 2.0), (0.3, -1.0), (0.7, 0.0), (1.5, 1.0)]


def block():
    scene = Scene(t_end=1.0)
    ground, rail = scene.add("ground", Ground()), scene.add("rail", Slider())
    mass, push = scene.add("block", PointMass(mass=2.0)), scene.add("push", Force())
    scene.connect(ground.frame, rail.a)
    scene.connect(rail.b, mass.point)
    scene.connect(mass.point, push.point)
    return scene


def pendulum(rope=False):
    """A bob on a rod, or on a rope that goes slack; it is pushed sideways, and pushed against by a controller."""
    scene = Scene(t_end=1.2)
    ground, bob = scene.add("ground", Ground()), scene.add("bob", PointMass(mass=1.0))
    hung = scene.add("rod", Rope(length=1.0, when_slack="slack") if rope else Rod(length=1.0))
    scene.connect(ground.frame, hung.a)
    scene.connect(hung.b, bob.point)
    if rope:
        scene.guess["bob.position.z"] = -1.0
        scene.start.update({"bob.position.x": 0.0, "bob.velocity.x": 5.2})
    else:
        scene.start["rod.angle"] = 0.4
    for name in ("push", "against"):
        scene.add(name, Force())
        scene.connect(bob.point, scene[name].point)
    return scene


def sampled():
    """The same under a controller that samples at the nodes, too."""
    scene = pendulum()
    seen, control = scene.add("seen", PositionSensor()), scene.add("control", SampledFeedback(period=0.1, gains=(3.0,)))
    scene.connect(scene["bob"].point, seen.point)
    scene.connect(seen.output("position.x"), control.input("u_1"))
    scene.connect(control.output("y"), scene["against"].input("value"))
    return scene


class Control(Component):
    """Reads a measurement, and gives a command."""

    u = signal(0.0, unit="any", doc="Measured.")
    most = parameter(0.5, unit="N", doc="The force.")
    y = discrete_state(0.0, unit="any", doc="Command.")


class Damper(Control):
    """Pushes back, by no more than a force."""

    @update(every=0.1, sets="y", pure=True)
    def saturated(self):
        return -max(-self.most, min(self.most, 9.0 * self.u - 0.4 * self.y))


class Smooth(Control):
    """The same without a bound."""

    @update(every=0.1, sets="y", pure=True)
    def free(self):
        return 0.4 * self.y * self.most - 9.0 * self.u * self.time


class Remembering(Control):
    """Says no more than that it may remember."""

    @update(every=0.1, sets="y")
    def remembered(self):
        return -self.u


def controlled(kind):
    scene = pendulum()
    seen, control = scene.add("seen", PositionSensor()), scene.add("control", kind())
    scene.connect(scene["bob"].point, seen.point)
    scene.connect(seen.output("position.x"), control.input("u"))
    scene.connect(control.output("y"), scene["against"].input("value"))
    return scene


def driven():
    scene = Scene(t_end=1.0)
    ground, drive, bob = (
        scene.add("ground", Ground()),
        scene.add("drive", Drive()),
        scene.add("bob", PointMass(mass=1.0)),
    )
    scene.connect(ground.frame, drive.a)
    scene.connect(drive.b, bob.point)
    hung = scene.add("rod", Rod(length=1.0))
    other = scene.add("other", PointMass(mass=1.0))
    scene.connect(drive.b, hung.a)
    scene.connect(hung.b, other.point)
    return scene


def changed(nodes, k, by):
    return [(t, value + by * (i == k)) for i, (t, value) in enumerate(nodes)]


@pytest.mark.parametrize("between", ["linear", "held"])
@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("kind", [pendulum, lambda: pendulum(rope=True), sampled])
def test_meets_differences(kind, form, between):
    def run(nodes):
        about = {"inputs": {"push.value": nodes}, "between": between, "form": form, "t_end": 1.2}
        return sensitivities(kind(), ["bob.position.x", "push.force"], **about, outputs=[0.5, 1.2], rtol=1e-12)

    found = run(NODES)
    assert found["bob.position.x", "push.value"].shape == (4, len(found.time))
    for k in range(3):
        slopes = [
            (run(changed(NODES, k, h)).values - run(changed(NODES, k, -h)).values) / (2 * h) for h in (0.02, 0.01)
        ]
        near = (4.0 * slopes[1] - slopes[0]) / 3.0
        assert found.derivatives[:, k] == pytest.approx(near, abs=1e-7)
        assert np.max(np.abs(near)) > 1e-3


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("kind", [Smooth, Damper])
def test_updates_that_are_arithmetic_are_derived_on_the_graph(kind, form, monkeypatch):
    def run(**about):
        about = {"outputs": [0.5, 1.2], "form": form, "rtol": 1e-12} | about
        return sensitivities(controlled(kind), ["bob.position.x"], **about)

    about = {"parameters": ["control.most", "rod.length"], "start": ["rod.angle"]}
    calls, differences = [], passage.differentiated
    monkeypatch.setattr(passage, "differentiated", lambda function: calls.append(1) or differences(function))
    found, graph = run(**about), len(calls)
    assert run(mode="adjoint", **about).derivatives == pytest.approx(found.derivatives, abs=1e-9)
    calls.clear()
    monkeypatch.setattr(changes, "_updated", lambda *given: None)
    assert found.derivatives == pytest.approx(run(**about).derivatives, abs=1e-9)
    assert (len(calls) - graph >= 30) == (kind is Smooth)


def test_updates_that_may_remember_are_refused():
    with pytest.raises(UsageError, match=r"control.*may remember.*no derivatives"):
        sensitivities(controlled(Remembering), parameters=["rod.length"])


def test_of_a_block():
    found = sensitivities(block(), ["rail.displacement"], inputs={"push.value": [(0.0, 6.0), (0.5, 0.0), (1.0, -6.0)]})
    assert found.at_end()[0] == pytest.approx([5 / 48, 1 / 8, 1 / 48], rel=1e-12)
    assert found.units["rail.displacement", "push.value[1]"] == "s^2/kg"
    held = sensitivities(
        block(), ["rail.displacement"], inputs={"push.value": [(0.0, 0.0), (0.5, 0.0), (1.0, 0.0)]}, between="held"
    )
    assert held.at_end()[0] == pytest.approx([3 / 16, 1 / 16, 0.0], rel=1e-12)


def test_constant_input_may_be_zero():
    found = sensitivities(block(), ["rail.displacement"], parameters=["block.mass"], inputs=["push.value"])
    assert found.by == ("block.mass", "push.value")
    assert found["rail.displacement", "push.value"] == pytest.approx(0.25 * found.time**2, abs=1e-12)


def test_of_a_model_in_a_scene():
    scene = Scene(t_end=1.0)
    scene.add("inner", block())
    found = sensitivities(scene, ["inner.rail.displacement"], inputs={"inner.push.value": "2 N"})
    assert found.at_end()[0] == pytest.approx([0.25], rel=1e-12)


@pytest.mark.parametrize(
    ("scene", "inputs", "said"),
    [
        (block, ["push.force"], "no input"),
        (block, ["block.mass"], "parameters="),
        (block, ["pull.value"], "no such part"),
        (block, {"push.value": [(0.0, 1.0), (0.5, 1.0)]}, "cover"),
        (block, {"push.value": [(0.0, 1.0), (0.0, 1.0)]}, "do not rise"),
        (block, {"push.value": [(0.0, np.nan), (1.0, 1.0)]}, "finite"),
        (block, {"push.value": "fast"}, "push.value"),
        (block, {"push.value": []}, "rows"),
        (sampled, ["against.value"], "connected"),
        (driven, {"drive.motion": [(0.0, 0.0), (1.0, 1.0)]}, "prescribes a motion"),
    ],
)
def test_refuses_by_name(scene, inputs, said):
    with pytest.raises(AtwoodError, match=said):
        sensitivities(scene(), inputs=inputs)
