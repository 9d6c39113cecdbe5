"""Sample times and time events that steps pass without Python: what comes out is what single stretches give."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from atwood import (
    Component,
    Model,
    Number,
    Scalar,
    Scene,
    SolveError,
    assemble,
    discrete_state,
    parameter,
    select,
    signal,
    simulate,
    sin,
    sqrt,
    update,
)
from atwood.integrators.moments import Moments
from atwood.simulation.run.run import Walk
from atwood_library import Force, Ground, PointMass, Slider
from atwood_library.scenes import CartPole


class Controller(Component):
    """A controller with a state of its own, of arithmetic and Atwood's functions."""

    gain: Number = parameter(3.0, unit="any", doc="Its gain.")
    u: Number = signal(0.0, unit="any", doc="Place.")
    v: Number = signal(0.0, unit="any", doc="Speed.")
    y: Scalar = discrete_state(0.0, unit="any", doc="Command.")
    stored: Scalar = discrete_state(0.0, unit="any", doc="The sum of places.")

    @update(every=0.01, sets=("y", "stored"), pure=True)
    def work_out(self) -> tuple[Any, Any]:
        """Return the command."""
        push = -self.gain * self.u - 0.3 * self.v / sqrt(1.0 + self.u * self.u) - 0.01 * self.stored
        return select(push > 2.0, 2.0, push), self.stored + self.u


class Asking(Controller):
    """The same, which asks what a number is: it cannot be traced."""

    @update(every=0.01, sets=("y", "stored"), pure=True)
    def work_out(self) -> tuple[Any, Any]:
        """Return the command."""
        return (-self.gain * self.u if self.u == self.u and self.u > -1e9 else 0.0), self.stored + 1.0


class Remembering(Controller):
    """The same, which counts its calls and may raise."""

    calls: list[float] = []
    most = 10**9

    @update(every=0.01, sets=("y", "stored"))
    def work_out(self) -> tuple[Any, Any]:
        """Return the command."""
        if len(self.calls) >= self.most:
            raise RuntimeError("enough")
        self.calls.append(float(self.u))
        return -self.gain * self.u, float(len(self.calls))


def to_and_fro(t: Scalar) -> Scalar:
    """Return a force that the clock switches."""
    return select(sin(60.0 * t) > 0.0, 3.0, -1.0)


def cart(kind: type[Controller] = Controller, switches: bool = True) -> Scene:
    """A cart that a controller pulls to the middle, and that is pushed to and fro by the clock."""
    scene = Scene(t_end=1.0)
    ground, rail, mass = scene.add("ground", Ground()), scene.add("rail", Slider()), scene.add("mass", PointMass())
    force, control = scene.add("force", Force()), scene.add("control", kind())
    scene.connect(ground.frame, rail.a)
    scene.connect(rail.b, mass.point)
    scene.connect(mass.point, force.point)
    scene.connect(rail.output("displacement"), control.input("u"))
    scene.connect(rail.output("speed"), control.input("v"))
    scene.connect(control.output("y"), force.input("value"))
    if switches:
        push = scene.add("push", Force(value=to_and_fro))
        scene.connect(push.point, mass.point)
    scene.start.update({"rail.displacement": 1.0, "rail.speed": 0.0})
    return scene


@pytest.fixture
def passed(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many moments steps have passed by themselves, run by run."""
    counts: list[int] = []
    first = Moments.advance

    def counted(self: Moments, *given: Any) -> int:
        code = first(self, *given)
        counts.append(self.now)
        return code

    monkeypatch.setattr(Moments, "advance", counted)
    return counts


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("make", [CartPole, cart, lambda: cart(Asking), lambda: cart(Remembering)])
def test_moments_are_passed_with_the_bits_of_single_stretches(
    make: Callable[[], Model], form: str, passed: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = assemble(make(), form=form)
    found = simulate(scene, t_end=0.7, outputs=31, solver="explicit")
    assert passed
    assert passed[-1] >= 33
    monkeypatch.setattr(Walk, "passes_moments", False)
    Remembering.calls.clear()
    single = simulate(scene, t_end=0.7, outputs=31, solver="explicit")
    assert_array_equal(found.time, single.time)
    # In the dae form states that miss nothing are projected here, and left as they are there.
    compare = assert_array_equal if form == "reduced" else lambda a, b: assert_allclose(a, b, rtol=1e-12, atol=1e-12)
    for path, values in single.table().items():
        compare(found[path], values)
    assert found.energy.max_drift == pytest.approx(single.energy.max_drift, abs=1e-12)
    assert [one.after_time_event for one in found.run.segments] == [one.after_time_event for one in single.run.segments]
    ours, theirs = (
        {name: getattr(one.statistics, name) for name in type(one.statistics).__annotations__ if name != "seconds"}
        for one in (found, single)
    )
    assert ours == theirs
    assert_array_equal(pickle.loads(pickle.dumps(found))["rail.displacement"], found["rail.displacement"])


def test_an_update_is_traced_only_where_it_asks_nothing() -> None:
    from atwood.simulation.events.sampling import find_sampler
    from atwood.simulation.events.traced import update_code

    for kind, is_traced in ((Controller, True), (Asking, False), (Remembering, False)):
        assembly = assemble(cart(kind))
        sampler = find_sampler(assembly, 0.0, 1.0, np.zeros(0))
        assert (update_code(assembly, sampler) is not None) is is_traced


def test_an_update_that_raises_is_called_once_and_leaves_what_came_before(monkeypatch: pytest.MonkeyPatch) -> None:
    assembly = assemble(cart(Remembering))
    monkeypatch.setattr(Remembering, "most", 40)
    Remembering.calls.clear()
    with pytest.raises(SolveError, match=r"at t = 0\.4 the update raises RuntimeError: enough") as raised:
        simulate(assembly)
    assert len(Remembering.calls) == 40
    run = raised.value.run  # type: ignore[attr-defined]
    assert run.segments[-1].time[-1] == pytest.approx(0.4)


def test_progress_limits_and_interruptions_are_heard_between_moments(passed: list[int]) -> None:
    assembly, seen = assemble(cart()), list[float]()
    simulate(assembly, progress=seen.append)
    assert len(seen) >= 40
    assert seen == sorted(seen)
    assert seen[-1] == 1.0

    def interrupt(t: float) -> None:
        if t > 0.5:
            raise KeyboardInterrupt

    stopped = simulate(assembly, progress=interrupt)
    assert stopped.run.status == "interrupted"
    assert 0.5 < stopped.time[-1] < 0.6
    whole = simulate(assembly)
    count = len(stopped.time) - 1  # the last is shown since it is the last
    assert_array_equal(stopped["rail.displacement"][:count], whole["rail.displacement"][:count])
    passed.clear()
    assert simulate(assembly, max_steps=20).run.status == "step_limit"
    assert not passed


def test_other_values_have_their_own_updates() -> None:
    assembly = assemble(cart())
    other = assembly.with_values({"control.gain": 2.0})
    found = [simulate(one)["rail.displacement"][-1] for one in (assembly, other, assembly)]
    assert found[0] == found[2] != found[1]
