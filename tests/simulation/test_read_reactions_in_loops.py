"""Forces that read reactions where constraints are redundant: what is determined is read, and nothing else."""

from collections.abc import Iterable
from functools import cache
from typing import Any

import numpy as np
import pytest

from atwood import (
    Load,
    Scene,
    UnsupportedError,
    Vector,
    as_vector,
    assemble,
    dot,
    force,
    parameter,
    simulate,
    sqrt,
    sweep,
)
from atwood.expr import live
from atwood_library import (
    FirstOrder,
    Gain,
    Ground,
    Inertia,
    Link,
    Pivot,
    RigidBody,
    RotationalCoupling,
    RotationalSource,
    Slider,
    Weld,
)
from atwood_library.scenes import SliderCrank

QUANTITIES = ("pivot1.angular_velocity", "pivot2.angular_velocity")


class RoughPivot(Pivot):
    """A hinge whose friction grows with its speed and with its load, across the axis or as a whole."""

    friction: float = parameter(0.05, unit="m*s", doc="Torque for each newton and rad/s.")
    load: str = parameter("across", choices=("across", "whole"), doc="Which load counts.")

    @force
    def rub(self) -> Iterable[Load]:
        """Return the friction."""
        axis = self.a.to_world(as_vector(self.axis))
        load = Vector(*(self.reaction(f"force.{one}") for one in "xyz"))
        if self.load == "across":
            load -= axis * dot(load, axis)
        rate = dot(self.b.angular_velocity - self.a.angular_velocity, axis)
        torque = axis * (-self.friction * rate * sqrt(dot(load, load) + 0.01))
        return [Load(self.b, Vector(0.0, 0.0, 0.0), torque), Load(self.a, Vector(0.0, 0.0, 0.0), -torque)]


class LiftedPivot(Pivot):
    """A hinge with a torque that grows with what lifts it."""

    @force
    def rub(self) -> Iterable[Load]:
        """Return the torque."""
        torque = self.a.to_world(as_vector(self.axis)) * (1e-9 * self.reaction("force.z"))
        return [Load(self.b, Vector(0.0, 0.0, 0.0), torque), Load(self.a, Vector(0.0, 0.0, 0.0), -torque)]


def four_bar(turned: float | None = None, load: str = "across") -> Scene:
    """Return a four-bar linkage in the plane, or in space, turned, where it has three redundant constraints."""
    scene = Scene(space="plane" if turned is None else "space")
    ground, foot = scene.add("ground", Ground()), scene.add("foot", Weld(displacement=(2.5, 0.0, 0.0)))
    links = [scene.add(name, Link(length=size, mass=1.0)) for name, size in (("a", 1.0), ("b", 2.5), ("c", 2.0))]
    pivots = [scene.add(f"pivot{i}", Pivot() if i else RoughPivot(load=load)) for i in range(4)]
    base = ground.frame
    if turned is not None:
        stand = scene.add("stand", Weld(angle=turned, axis=(0.0, 0.0, 1.0)))
        scene.connect(base, stand.a)
        base = stand.b
    joined = [(base, pivots[0].a), (base, foot.a), (foot.b, pivots[3].b), (links[2].b, pivots[3].a)]
    joined += [(pivots[i].b, links[i].a) for i in range(3)] + [(links[i].b, pivots[i + 1].a) for i in range(2)]
    for a, b in joined:
        scene.connect(a, b)
    scene.start.update({"pivot1.angle": 1.0, "pivot1.angular_velocity": 3.0})
    return scene


def motion(scene: Scene, **options: Any) -> np.ndarray:
    result = simulate(scene, t_end=0.5, rtol=1e-9, outputs=6, **options)
    assert result.energy.max_drift < 1e-7
    return np.array([result.array(name) for name in QUANTITIES])


@cache
def in_the_plane() -> np.ndarray:
    return motion(four_bar())


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("turned", "form", "solver"),
    [
        (0.0, "reduced", "explicit"),
        (0.5, "reduced", "explicit"),
        (0.5, "reduced", "ida"),
        (0.5, "dae", "ida"),
        (0.5, "dae", "explicit"),
    ],
)
def test_friction_in_a_redundant_loop_is_that_in_the_plane(turned: float, form: str, solver: str) -> None:
    """It was refused: constraints are redundant, though the load across the axis of a hinge is determined."""
    found = motion(four_bar(turned), form=form, solver=solver)
    np.testing.assert_allclose(found, in_the_plane(), atol=1e-6)


@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_load_that_redundant_constraints_share_is_refused_by_name(form: str) -> None:
    with pytest.raises(UnsupportedError, match=r"pivot0\.force\.y, which is not determined") as caught:
        simulate(four_bar(0.0, "whole"), form=form, t_end=0.1)
    assert caught.value.where == "pivot0"
    assert "pivot0.coincidence[1]" in caught.value.message


def on_cranks(rough: str) -> Scene:
    """Return a table on three parallel cranks, of which one is redundant, and a link that hangs on the table."""
    scene = Scene()
    ground, table = scene.add("ground", Ground()), scene.add("table", RigidBody(mass=2.0, moments=(0.0, 0.5, 0.0)))
    for i in range(3):
        crank = scene.add(f"crank{i}", Link(length=0.5, mass=0.3))
        low, high = (scene.add(f"{name}{i}", Weld(displacement=(float(i), 0.0, 0.0))) for name in ("low", "high"))
        foot, head = (
            scene.add(f"foot{i}", RoughPivot() if f"foot{i}" == rough else Pivot()),
            scene.add(f"h{i}", Pivot()),
        )
        for a, b in ((ground.frame, low.a), (low.b, foot.a), (foot.b, crank.a), (crank.b, head.a)):
            scene.connect(a, b)
        scene.connect(table.frame, high.a)
        scene.connect(high.b, head.b)
    hook, bob = scene.add("hook", RoughPivot() if rough == "hook" else Pivot()), scene.add("bob", Link(length=0.4))
    scene.connect(table.frame, hook.a)
    scene.connect(hook.b, bob.a)
    scene.start["foot1.angle"] = 1.0
    return scene


def test_from_rest_on_it_counts_what_friction_reads_later() -> None:
    with pytest.raises(UnsupportedError, match=r"foot0\.force\.x, foot0\.force\.z, which is not determined"):
        simulate(on_cranks("foot0"), t_end=0.1)


@pytest.mark.sample(0)
def test_a_hinge_beside_redundant_constraints_is_read() -> None:
    results = [simulate(on_cranks("hook"), form=form, t_end=0.5, rtol=1e-8, outputs=3) for form in ("reduced", "dae")]
    assert results[0].energy.work[-1] < -1e-3
    angles = [result.array("bob.angle") for result in results]
    np.testing.assert_allclose(angles[0], angles[1], atol=1e-5)


def test_in_a_sweep() -> None:
    frictions = [0.02, 0.05]
    swept = sweep(four_bar(0.5), vary={"pivot0.friction": frictions}, t_end=0.2, quantities=["pivot1.angle"], rtol=1e-9)
    for friction, found in zip(frictions, swept["pivot1.angle"], strict=True):
        scene = four_bar()
        scene["pivot0"].friction = friction
        alone = simulate(scene, t_end=0.2, rtol=1e-9)["pivot1.angle"][-1]
        assert float(np.ravel(found)[-1]) == pytest.approx(float(alone), abs=1e-7)


def crank_with_filter(gain: float) -> Scene:
    """Return a slider-crank with a load; the torque between them goes through a filter, and back to the load."""
    scene: Scene = SliderCrank()
    load, sensor = scene.add("load", Inertia(moment=1.0)), scene.add("sensor", RotationalCoupling())
    low_pass, back = scene.add("filter", FirstOrder(time_constant=0.05)), scene.add("gain", Gain(gain=gain))
    motor = scene.add("motor", RotationalSource())
    pivot = scene["pivot1"]
    for a, b in (
        (pivot.shaft, sensor.a),
        (load.flange, sensor.b),
        (motor.b, load.flange),
        (sensor.output("torque"), low_pass.input("u")),
        (low_pass.output("y"), back.input("u")),
        (back.output("y"), motor.input("value")),
    ):
        scene.connect(a, b)
    return scene


@pytest.mark.parametrize("gain", [0.0, -0.3])
def test_formulas_solve_loops_beside_a_filter_of_a_reaction(gain: float) -> None:
    """One angle, its rate and the filter are integrated, by the explicit method or by series; IDA had six unknowns."""
    found = {}
    for form, solver in (("reduced", "auto"), ("dae", "auto"), ("reduced", "ida")):
        result = simulate(crank_with_filter(gain), form=form, solver=solver, t_end=2.0, rtol=1e-9, outputs=5)
        assert result.energy.max_drift < 1e-7
        found[form, solver] = np.array([result.array(name) for name in ("crank.angle", "filter.y", "pivot1.force.x")])
        if (form, solver) == ("reduced", "auto"):
            assert "formulas solve its closed loops, in terms of crank.angle, filter.y" in result.solver
            assert result.statistics.steps < 100
    first = found["reduced", "auto"]
    np.testing.assert_allclose(found["dae", "auto"], first, rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(found["reduced", "ida"], first, rtol=1e-6, atol=1e-6)


def test_what_is_read_beside_redundant_constraints_is_written_out() -> None:
    """Rods without inertia about themselves come last; what is solved in numbers are the reactions that are read."""
    read = assemble(four_bar(0.5), form="dae").maximal.read
    sizes = [node.payload for node in live(list(read.values())) if node.operation == "solve"]
    assert max(sizes) <= len(read)
    assert len(live(list(read.values()))) <= 19_003  # six times 38 unknowns, Newton's method, weights of rods


@pytest.mark.parametrize("apart", [1e-3, 1e-5])
@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_a_reaction_that_formulas_do_not_give_is_refused(form: str, apart: float) -> None:
    """Of two hinges 1e-5 m apart that hold a body on a sledge, a torque read 32 % of the force, in silence."""
    scene = Scene()
    ground, slide, first, second = (
        scene.add("ground", Ground()),
        scene.add("slide", Slider(axis=(1.0, 0.0, 0.0))),
        scene.add("first", Pivot()),
        scene.add("second", LiftedPivot()),
    )
    sledge = scene.add("sledge", RigidBody(mass=1.0, moments=(0.1, 0.1, 0.1)))
    body = scene.add("body", RigidBody(mass=1.0, moments=(0.1, 0.1, 0.1), center=(0.5, 0.0, 0.0)))
    one, other = (scene.add(name, Weld(displacement=(apart, 0.0, 0.0))) for name in ("one", "other"))
    for a, b in (
        (ground.frame, slide.a),
        (slide.b, sledge.frame),
        (sledge.frame, first.a),
        (first.b, body.frame),
        (sledge.frame, one.a),
        (one.b, second.a),
        (body.frame, other.a),
        (other.b, second.b),
    ):
        scene.connect(a, b)
    scene.start.update({"first.angle": 0.0, "second.angle": 0.0, "slide.displacement": 0.0, "slide.speed": 1.0})
    if apart < 1e-4:
        with pytest.raises(UnsupportedError, match="second: a force reads a reaction"):
            simulate(scene, form=form, t_end=0.01)
    else:
        result = simulate(scene, form=form, t_end=0.01)
        assert result["second.force.z"] == pytest.approx(0.5 * 9.81 / apart, rel=1e-6)
