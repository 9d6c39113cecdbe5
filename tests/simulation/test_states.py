"""States that components declare: continuous ones, held ones, updates at sample times and at events."""

import pickle
from math import exp, pi
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from atwood import (
    Component,
    DeclarationError,
    ParameterError,
    Scalar,
    Scene,
    SolveError,
    assemble,
    derivative,
    discrete_state,
    event,
    load_result,
    observable,
    parameter,
    save_result,
    signal,
    simulate,
    state,
    sweep,
    update,
)
from atwood_library import Force, Ground, Link, Pivot, PointMass, Spring, Torque

SOLVERS = [
    ("reduced", "explicit"), ("reduced", "taylor"), ("reduced", "ida"), ("reduced", "ida-sundae"), ("dae", "ida"),
]  # fmt: skip


class Lag(Component):
    """A first-order lag."""

    time_constant: float = parameter(0.5, unit="s", above=0.0, doc="Time constant.")
    begin: float = parameter(0.25, unit="any", doc="Where it starts.")
    u: float = signal(1.0, unit="any", doc="What it follows.")
    y: Scalar = state(begin, unit="any", doc="What follows.")

    @derivative("y")
    def rate(self) -> Scalar:
        return (self.u - self.y) / self.time_constant


class Modes(Component):
    """Three modes that die away, as one state of several numbers."""

    order: int = parameter(3, integer=True, doc="How many.")
    x: Any = state(1.0, count="order", doc="The modes.")

    @derivative("x")
    def rates(self) -> Any:
        return [-(i + 1.0) * one for i, one in enumerate(self.x)]

    @observable(unit="1", doc="Their sum.")
    def total(self) -> Scalar:
        return sum(self.x)


class Feedback(Component):
    """A sampled feedback of position and speed, which counts its calls."""

    period: float = parameter(0.1, unit="s", doc="Sample time.")
    x: float = signal(unit="m", doc="Position.")
    v: float = signal(unit="m/s", doc="Speed.")
    force: Scalar = discrete_state(unit="N", doc="Command.")
    calls: Scalar = discrete_state(doc="How often it was called.")

    @update(every="period", sets=("force", "calls"))
    def step(self) -> Any:
        assert isinstance(self.x, float)
        return np.array([-2.0 * self.x - 1.5 * self.v, self.calls + 1.0])


class Sawtooth(Component):
    """A ramp that starts anew where it reaches its top."""

    top: float = parameter(0.3, doc="Where it turns.")
    y: Scalar = state(doc="The ramp.")
    turns: Scalar = discrete_state(doc="How often.")

    @derivative("y")
    def rate(self) -> Scalar:
        return 1.0

    @event(direction=1, message="it reaches its top")
    def full(self) -> Scalar:
        return self.y - self.top

    @update(at="full", sets=("y", "turns"))
    def empty(self) -> Any:
        return 0.0, self.turns + 1.0


def cart(period: float = 0.1) -> Scene:
    scene = Scene(space="line", line_axis=(1.0, 0.0, 0.0))
    mass, force, control = scene.add("mass", PointMass(mass=2.0)), scene.add("force", Force()), Feedback(period=period)
    scene.add("control", control)
    scene.connect(mass.point, force.point)
    scene.connect(control.output("force"), force.input("value"))
    scene.connect(mass.output("position.x"), control.input("x"))
    scene.connect(mass.output("velocity.x"), control.input("v"))
    scene.start["mass.position.x"], scene.start["mass.velocity.x"] = 1.0, 0.0
    return scene


def driven_pendulum(space: str) -> Scene:
    """A pendulum with a torque that follows its angle late."""
    scene = Scene(space=space)
    ground, pivot, link = scene.add("ground", Ground()), scene.add("pivot", Pivot()), scene.add("link", Link())
    torque, lag = scene.add("torque", Torque(axis=(0.0, -1.0, 0.0))), scene.add("lag", Lag())
    scene.connect(ground.frame, pivot.a)
    scene.connect(pivot.b, link.a)
    scene.connect(link.b, torque.frame)
    scene.connect(pivot.output("angle"), lag.input("u"))
    scene.connect(lag.output("y"), torque.input("value"))
    scene.start["pivot.angle"], scene.start["pivot.angular_velocity"] = 0.5, 0.3
    return scene


@pytest.mark.parametrize(("form", "solver"), SOLVERS)
def test_a_state_alone_follows_its_rate(form: str, solver: str) -> None:
    scene = Scene()
    scene.add("lag", Lag())
    scene.add("three", Modes())
    result = simulate(scene, t_end=2.0, form=form, solver=solver, rtol=1e-9)
    assert_allclose(result["lag.y"], 1.0 - 0.75 * np.exp(-result.time / 0.5), atol=1e-7)
    assert_allclose(result["three.x[2]"], np.exp(-3.0 * result.time), atol=1e-7)
    assert_allclose(result["three.total"], sum(np.exp(-k * result.time) for k in (1, 2, 3)), atol=1e-7)


@pytest.mark.sample(3)
@pytest.mark.parametrize(("form", "solver"), SOLVERS)
@pytest.mark.parametrize("space", ["plane", "space"])
def test_states_and_mechanics_act_on_each_other_alike_everywhere(form: str, solver: str, space: str) -> None:
    expected = simulate(driven_pendulum("plane"), t_end=2.0, solver="taylor", rtol=1e-13)
    result = simulate(driven_pendulum(space), t_end=2.0, form=form, solver=solver, rtol=1e-10)
    for path in ("pivot.angle", "lag.y"):
        assert_allclose(result[path], expected[path], rtol=0, atol=2e-6)
    assert result.energy.max_drift < 1e-5


def test_the_order_of_the_method_is_kept() -> None:
    exact = 1.0 - 0.75 * exp(-4.0)
    scene = Scene()
    scene.add("lag", Lag())
    errors = [abs(simulate(scene, t_end=2.0, rtol=r, solver="ida")["lag.y"][-1] - exact) for r in (1e-4, 1e-7, 1e-10)]
    assert errors[0] > 10.0 * errors[1] > 100.0 * errors[2]


def test_a_start_is_the_scenes_the_parts_or_that_of_other_values() -> None:
    scene = Scene()
    scene.add("lag", Lag())
    assembly = assemble(scene)
    assert simulate(assembly, t_end=1.0)["lag.y"][0] == 0.25
    other = assembly.with_values({"lag.begin": 0.75, "lag.time_constant": 0.1})
    assert other.shared is assembly.shared
    assert simulate(other, t_end=1.0)["lag.y"][0] == 0.75
    scene.start["lag.y"] = 3.0
    assert simulate(scene, t_end=1.0)["lag.y"][0] == 3.0


@pytest.mark.sample(4)
@pytest.mark.parametrize(("form", "solver"), SOLVERS)
def test_a_sampled_feedback_is_the_linear_map_of_one_period(form: str, solver: str) -> None:
    """Between samples ``x'' = F/m`` with F held, so that a period is a matrix."""
    result = simulate(cart(), t_end=2.0, form=form, solver=solver, rtol=1e-10, outputs=21)
    h, m = 0.1, 2.0
    z, seen = np.array([1.0, 0.0]), []
    for _ in range(20):
        force = -2.0 * z[0] - 1.5 * z[1]
        seen.append((*z, force))
        z = np.array([z[0] + h * z[1] + 0.5 * h * h * force / m, z[1] + h * force / m])
    assert_allclose(result["mass.position.x"][:20], [one[0] for one in seen], atol=1e-8)
    assert_allclose(result["control.force"][:20], [one[2] for one in seen], atol=1e-8)
    assert result["mass.position.x"][-1] == pytest.approx(z[0], abs=1e-8)
    assert result["control.calls"][-1] == 21.0  # with that at the end
    assert result.energy.max_drift < 1e-7  # the work of a force in steps


def test_samples_compile_nothing() -> None:
    assembly = assemble(cart())
    simulate(assembly, t_end=2.35)  # many samples have their updates compiled
    made = len(assembly.shared._made)
    simulate(assembly, t_end=3.0)
    assert len(assembly.shared._made) == made


@pytest.mark.parametrize(("form", "solver"), SOLVERS)
def test_an_event_resets_states(form: str, solver: str) -> None:
    scene = Scene()
    scene.add("saw", Sawtooth())
    scene.add("lag", Lag())  # so that something moves in every solver's state
    result = simulate(scene, t_end=1.0, form=form, solver=solver, rtol=1e-9, outputs=[0.1, 0.5, 0.95])
    assert [round(one.time, 9) for one in result.events] == [0.3, 0.6, 0.9]
    assert result["saw.turns"][-1] == 3.0
    assert result["saw.y"][-1] == pytest.approx(0.05, abs=1e-8)


def test_one_of_one_moment_comes_after_what_feeds_it() -> None:
    class Counter(Component):
        """Counts."""

        n: Scalar = discrete_state(doc="Count.")

        @update(every=0.1, sets="n")
        def step(self) -> float:
            return self.n + 1.0

    class Copy(Component):
        """Copies."""

        u: float = signal(doc="What.")
        n: Scalar = discrete_state(-1.0, doc="Copy.")

        @update(every=0.1, sets="n")
        def step(self) -> float:
            return self.u

    scene = Scene()
    copy, counter = scene.add("copied", Copy()), scene.add("counter", Counter())
    scene.connect(counter.output("n"), copy.input("u"))
    result = simulate(scene, t_end=1.0, outputs=[0.05, 0.55])
    assert result["copied.n"].tolist() == result["counter.n"].tolist() == [1.0, 6.0]
    ring = Scene()
    a, b = ring.add("a", Copy()), ring.add("b", Copy())
    ring.connect(a.output("n"), b.input("u"))
    ring.connect(b.output("n"), a.input("u"))
    with pytest.raises(DeclarationError, match=r"a\.step -> b\.step -> a\.step|b\.step -> a\.step -> b\.step"):
        simulate(ring, t_end=1.0)


def test_results_and_assemblies_carry_states(tmp_path: Any) -> None:
    scene = pickle.loads(pickle.dumps(cart()))
    result = simulate(scene, t_end=1.0)
    again = pickle.loads(pickle.dumps(result))
    assert_allclose(again["control.force"], result["control.force"])
    assert again.energy.max_drift == result.energy.max_drift
    save_result(result, tmp_path / "cart.nc")
    assert_allclose(load_result(tmp_path / "cart.nc")["control.force"], result["control.force"])


def test_a_sweep_carries_states() -> None:
    found = sweep(cart(), vary={"control.period": [0.05, 0.1, 0.2]}, t_end=1.0, quantities=["mass.position.x"])
    for row, period in zip(found["mass.position.x"], (0.05, 0.1, 0.2), strict=True):
        assert row[-1] == pytest.approx(simulate(cart(period), t_end=1.0)["mass.position.x"][-1], rel=1e-12)


def test_a_repeated_run_asks_no_update_twice() -> None:
    """The energy ledger may make a run again; an update that remembers by itself is not called for it."""
    calls: list[float] = []

    class Remembering(Component):
        """Remembers."""

        y: Scalar = discrete_state(unit="N", doc="Command.")

        @update(every=0.5, sets="y")
        def step(self) -> float:
            calls.append(self.time)
            return 1e3 * len(calls)

    scene = Scene(space="line", line_axis=(1.0, 0.0, 0.0))
    mass, spring, wall = scene.add("mass", PointMass()), Spring(stiffness=1e4, natural_length=1.0), Ground()
    scene.add("spring", spring)
    scene.add("wall", wall)
    force, memory = scene.add("force", Force()), scene.add("memory", Remembering())
    scene.connect(wall.frame, spring.a)
    scene.connect(spring.b, mass.point)
    scene.connect(mass.point, force.point)
    scene.connect(memory.output("y"), force.input("value"))
    scene.start["mass.position.x"] = 1.1
    result = simulate(scene, t_end=2.0, samples=1, outputs=3)
    assert result.energy.max_drift < 1e-4
    assert calls == [0.0, 0.5, 1.0, 1.5, 2.0]


def _component(body: dict[str, Any]) -> Component:
    return type("Own", (Component,), {"__doc__": "Own.", **body})()


def _scene(component: Component) -> Scene:
    scene = Scene()
    scene.add("own", component)
    return scene


def test_two_states_of_one_name_are_refused() -> None:
    with pytest.raises(DeclarationError, match="'x' is declared twice"):

        class Twice(Component):
            """Twice."""

            x: Scalar = state(doc="One.")
            x: Scalar = state(doc="Other.")  # type: ignore[no-redef]  # noqa: PIE794


def test_a_sample_time_of_zero_is_refused_by_name() -> None:
    with pytest.raises(ParameterError, match=r"control\.period: its sample time is 0 s"):
        simulate(cart(period=0.0), t_end=1.0)


def test_an_algebraic_loop_of_blocks_is_named() -> None:
    class Gain(Component):
        """Passes through."""

        u: float = signal(doc="What.")

        @observable(unit="1", doc="Twice that.")
        def y(self) -> Scalar:
            return 2.0 * self.u

    scene = cart()
    a, b, c = (scene.add(name, Gain()) for name in ("first", "second", "beside"))
    scene.connect(a.output("y"), b.input("u"))
    scene.connect(b.output("y"), a.input("u"))
    scene.connect(a.output("y"), c.input("u"))
    with pytest.raises(DeclarationError, match="algebraic loop") as e:
        simulate(scene, t_end=1.0)
    assert "first" in str(e.value)
    assert "second" in str(e.value)
    assert "beside" not in str(e.value)
    assert "control" not in str(e.value)


def test_wrong_declarations_are_one_clear_error() -> None:
    with pytest.raises(DeclarationError, match=r"own\.x: no law says its rate"):
        simulate(_scene(_component({"x": state(doc="X.")})), t_end=1.0)

    class Misnamed(Component):
        """Misnamed."""

        level: Scalar = state(doc="Level.")

        @derivative("levle")
        def rate(self) -> Scalar:
            return 1.0

    with pytest.raises(DeclarationError, match="levle"):
        simulate(_scene(Misnamed()), t_end=1.0)

    class Wordy(Component):
        """Returns words."""

        y: Scalar = discrete_state(doc="Y.")

        @update(every=0.25, sets="y")
        def step(self) -> Any:
            return "much"

    with pytest.raises(SolveError, match=r"own\.step: at t = 0 the update raises ValueError"):
        simulate(_scene(Wordy()), t_end=1.0)

    class Sudden(Component):
        """Names no event."""

        y: Scalar = discrete_state(doc="Y.")

        @update(at="never", sets="y")
        def step(self) -> float:
            return 1.0

    with pytest.raises(DeclarationError, match="never"):
        simulate(_scene(Sudden()), t_end=1.0)


def test_a_held_state_may_prescribe_a_torque_of_a_loop() -> None:
    """Updates go on through closed loops, too, which IDA alone takes."""
    from atwood_library.scenes import FourBar

    class Steps(Component):
        """A torque in steps."""

        y: Scalar = discrete_state(unit="N*m", doc="Torque.")

        @update(every=0.25, sets="y")
        def step(self) -> float:
            return self.y + 0.5

    scene = FourBar()
    steps, torque = scene.add("steps", Steps()), scene.add("torque", Torque())
    scene.connect(scene["crank"].b, torque.frame)
    scene.connect(steps.output("y"), torque.input("value"))
    results = [simulate(scene, t_end=1.0, form=form, rtol=1e-9) for form in ("reduced", "dae")]
    assert_allclose(results[0]["crank.angle"], results[1]["crank.angle"], atol=1e-5)
    assert results[0]["steps.y"][-1] == 2.5  # after the sample at the end
    assert all(one.energy.max_drift < 1e-5 for one in results)


def test_lengths_and_angles_of_parts_stay_what_they_are() -> None:
    """A state beside a mechanism on a line leaves its elimination as it was."""
    scene = Scene(space="line", line_axis=(1.0, 0.0, 0.0))
    ground, mass = scene.add("ground", Ground()), scene.add("mass", PointMass())
    spring, lag = scene.add("spring", Spring(stiffness=pi**2, natural_length=0.0)), scene.add("lag", Lag())
    scene.connect(ground.frame, spring.a)
    scene.connect(spring.b, mass.point)
    scene.connect(mass.output("position.x"), lag.input("u"))
    scene.start["mass.position.x"], scene.start["mass.velocity.x"] = 1.0, 0.0
    result = simulate(scene, t_end=2.0, rtol=1e-10)
    assert_allclose(result["mass.position.x"], np.cos(pi * result.time), atol=1e-7)
