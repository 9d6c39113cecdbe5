"""Laws that compare what moves: every solver stops where they switch, and goes on with the other branch.

Oracles are motions in pieces of constant or linear force, and the work of a constant force along a way.
"""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from atwood import (
    Component,
    Load,
    Point,
    Scalar,
    Scene,
    absolute,
    assemble,
    connector,
    discrete_state,
    dynamics,
    event,
    floor,
    force,
    maximum,
    minimum,
    parameter,
    potential,
    select,
    sign,
    simulate,
    sweep,
    update,
)
from atwood_library import PointMass
from atwood_library.scenes import SliderCrank

EVERY = [("reduced", "auto"), ("reduced", "explicit"), ("reduced", "taylor"), ("reduced", "ida"), ("dae", "auto")]
EVERY += [("dae", "ida")]
HAMILTONIAN = [*EVERY, ("reduced", "gauss"), ("reduced", "composition")]


class Push(Component):
    """A force along a direction that is a function of the place and the speed along it."""

    direction: Any = parameter((1.0, 0.0, 0.0), size=3, doc="Where it points.")
    point: Point = connector(Point, "Where it acts.")
    law: Callable[[Any, Any], Any] = staticmethod(lambda x, v: 0.0)

    @force
    def push(self) -> list[Load]:
        """Return the force."""
        n = self.direction
        x, v = (sum(a * b for a, b in zip(n, one, strict=True)) for one in (self.point.position, self.point.velocity))
        value = type(self).law(x, v)
        return [Load(self.point, tuple(value * a for a in n))]


class Hill(Component):
    """A potential that is a function of the place along x."""

    point: Point = connector(Point, "Where it acts.")
    law: Callable[[Any], Any] = staticmethod(lambda x: 0.0)

    @potential
    def energy(self) -> Scalar:
        """Return the energy."""
        return type(self).law(self.point.position[0])


class Edge(Hill):
    """A potential with an edge."""

    law = staticmethod(lambda x: absolute(x - 2.03))


def moving(
    law: Callable[..., Any], x: float = 0.0, v: float = 1.0, direction: Any = None, base: type[Component] = Push
) -> Scene:
    """A mass of 1 kg without weight that moves along a direction."""
    part = type("Law", (base,), {"law": staticmethod(law)})
    scene = Scene(gravity=0.0, space="plane" if direction is None else "space")
    n = (1.0, 0.0, 0.0) if direction is None else direction
    bob = scene.add("bob", PointMass(mass=1.0))
    push = scene.add("push", part(direction=n) if issubclass(base, Push) else part())
    scene.connect(bob.point, push.point)
    for i, axis in enumerate("xz" if direction is None else "xyz"):
        along = n[2 * i if direction is None else i]
        scene.start[f"bob.position.{axis}"], scene.start[f"bob.velocity.{axis}"] = x * along, v * along
    return scene


def band(width: float, height: float = 1.0, begin: float = 2.0) -> Callable[..., Any]:
    """A force that acts on a short way only."""
    return lambda x, *_: select(x < begin, 0.0, select(x < begin + width, height, 0.0))


def behind_band(t: float, width: float, height: float = 1.0, begin: float = 2.0) -> float:
    """Where a mass of 1 kg is that has crossed a band, from the origin at 1 m/s."""
    v = math.sqrt(1.0 + 2.0 * height * width)
    return begin + width + v * (t - begin - 2.0 * width / (1.0 + v))


class TestBands:
    @pytest.mark.parametrize(("form", "solver"), EVERY)
    @pytest.mark.parametrize("width", [0.1, 1e-3])
    def test_narrow_bands_are_not_stepped_over(self, form: str, solver: str, width: float) -> None:
        result = simulate(moving(band(width)), t_end=10.0, form=form, solver=solver, rtol=1e-8)
        assert result["bob.position.x"][-1] == pytest.approx(behind_band(10.0, width), abs=1e-9)
        assert not result.events

    @pytest.mark.parametrize("solver", ["auto", "ida"])
    def test_an_accuracy_that_is_reached_is_true(self, solver: str) -> None:
        result = simulate(moving(band(0.1)), t_end=10.0, solver=solver, accuracy=1e-8)
        true = abs(result["bob.position.x"][-1] - behind_band(10.0, 0.1))
        assert true <= max(float(np.max(result.error("bob.position.x"))), 1e-11)

    def test_many_switches_on_the_way(self) -> None:
        def ladder(x: Any, _: Any) -> Any:
            return sum(band(0.03, begin=1.0 + 0.1 * i)(x) for i in range(30))

        x, v, t = 1.0, 1.0, 1.0
        for i in range(30):
            faster = math.sqrt(v * v + 0.06)
            x, t, v = x + 0.03, t + 0.06 / (v + faster), faster
            if i < 29:
                x, t = x + 0.07, t + 0.07 / v
        result = simulate(moving(ladder), t_end=5.0)
        assert result["bob.position.x"][-1] == pytest.approx(x + v * (5.0 - t), abs=1e-10)

    @pytest.mark.parametrize("solver", ["auto", "ida", "taylor"])
    @pytest.mark.parametrize("depth", [1e-2, 1e-6, 1e-9, 0.0, -1e-9])
    def test_bands_that_are_hardly_touched(self, depth: float, solver: str) -> None:
        scene = moving(lambda x, _: -1.0 + select(x > 0.5 - depth, -3.0, 0.0))
        end = 3.0 - 4.5
        if depth > 0.0:
            v = math.sqrt(2.0 * depth)
            rest = 3.0 - (1.0 - v) - 0.5 * v
            end = 0.5 - depth - v * rest - 0.5 * rest * rest
        result = simulate(scene, t_end=3.0, solver=solver, rtol=1e-10)
        assert result["bob.position.x"][-1] == pytest.approx(end, abs=1e-8)

    def test_turned_moved_and_scaled(self) -> None:
        direction = (0.6, -0.48, 0.64)
        for size in (1e-3, 1.0, 1e3):
            law = lambda x, _, size=size: band(0.01 * size, size, begin=7.0 * size)(x)  # noqa: E731
            scene = moving(law, x=5.0 * size, v=size, direction=direction)
            result = simulate(scene, t_end=10.0)
            x = sum(a * result[f"bob.position.{axis}"][-1] for a, axis in zip(direction, "xyz", strict=True))
            assert x / size == pytest.approx(5.0 + behind_band(10.0, 0.01), rel=1e-10)

    def test_a_sweep_gives_what_single_runs_give(self) -> None:
        scene = moving(band(0.1))
        found = sweep(
            scene, vary={"bob.mass": [0.5, 1.0, 2.0]}, t_end=10.0, quantities=["bob.position.x"], outputs=[10.0]
        )
        for mass, x in zip([0.5, 1.0, 2.0], np.ravel(found["bob.position.x"]), strict=True):
            v = math.sqrt(1.0 + 0.2 / mass)
            assert x == pytest.approx(2.1 + v * (8.0 - 0.2 / (1.0 + v)), abs=1e-9)


class TestPotentials:
    @pytest.mark.sample(4)
    @pytest.mark.parametrize(("form", "solver"), HAMILTONIAN)
    def test_an_edge_of_a_potential(self, form: str, solver: str) -> None:
        scene = moving(lambda x: absolute(x - 2.03), base=Hill)
        v = math.sqrt(5.06)
        t = math.fmod(50.0 - (v - 1.0), 4.0 * v)
        back = t - 2.0 * v
        exact = 2.03 + (v * t - 0.5 * t * t if back < 0.0 else -v * back + 0.5 * back * back)
        result = simulate(scene, t_end=50.0, form=form, solver=solver, rtol=1e-8)
        assert result["bob.position.x"][-1] == pytest.approx(exact, abs=1e-8)
        assert result.energy.max_drift < 1e-9

    @pytest.mark.parametrize("solver", ["gauss", "composition"])
    def test_symplectic_steps_that_are_given_end_there_too(self, solver: str) -> None:
        scene = moving(lambda x: absolute(x - 2.03), base=Hill)
        v, result = math.sqrt(5.06), simulate(scene, t_end=5.0, solver=solver, step=0.25)
        t = 5.0 - (v - 1.0)
        assert result["bob.position.x"][-1] == pytest.approx(2.03 + v * t - 0.5 * t * t, abs=1e-9)

    @pytest.mark.parametrize(("form", "solver"), HAMILTONIAN)
    def test_a_stop(self, form: str, solver: str) -> None:
        scene = moving(lambda x: 5e3 * maximum(x - 1.0, 0.0) ** 2 + 5e3 * minimum(x + 1.0, 0.0) ** 2, base=Hill)
        result = simulate(scene, t_end=3.0, form=form, solver=solver, rtol=1e-9)
        assert result["bob.position.x"][-1] == pytest.approx(1.0 - (2.0 - math.pi / 100.0), abs=1e-6)

    @pytest.mark.sample(5)
    @pytest.mark.parametrize(("form", "solver"), [one for one in HAMILTONIAN if one[1] != "taylor"])
    def test_a_law_without_a_value_behind_its_switch(self, form: str, solver: str) -> None:
        # A contact of Hertz: it lasts 2 d / v times the integral of 1 / sqrt(1 - s^(5/2)), at depth d at most.
        scene = moving(lambda x: 4e3 * maximum(x - 1.0, 0.0) ** 2.5, base=Hill)
        deepest = (0.5 / 4e3) ** 0.4
        lasts = 2.0 * deepest * math.sqrt(math.pi) * math.gamma(1.4) / math.gamma(0.9)
        result = simulate(scene, t_end=2.5, form=form, solver=solver, rtol=1e-9)
        assert result["bob.position.x"][-1] == pytest.approx(1.0 - (1.5 - lasts), abs=1e-6)


class TestForces:
    @pytest.mark.parametrize(("form", "solver"), EVERY)
    def test_stairs(self, form: str, solver: str) -> None:
        scene = moving(lambda x, _: -floor(x), x=0.5)
        # At 1 m at 0.5 s it is slowed by 1 m/s^2: it just comes to 1.5 m, and is back at 1 m at 2.5 s.
        result = simulate(scene, t_end=3.0, form=form, solver=solver)
        assert result["bob.position.x"][-1] == pytest.approx(0.5, abs=1e-9)
        assert result.energy.max_drift < 1e-9

    @pytest.mark.parametrize(
        ("form", "solver"), [("reduced", "auto"), ("reduced", "ida"), ("dae", "auto"), ("dae", "ida")]
    )
    def test_friction_to_rest_and_at_rest(self, form: str, solver: str) -> None:
        scene = moving(lambda x, v: 0.25 - sign(v))
        result = simulate(scene, t_end=20.0, form=form, solver=solver, rtol=1e-8)
        assert result["bob.position.x"][-1] == pytest.approx(0.5 / 0.75, abs=1e-7)
        assert abs(result["bob.velocity.x"][-1]) < 1e-8
        assert result.statistics.steps < 500

    def test_friction_lets_go(self) -> None:
        # Held while the push of 0.5 t is below 1 N, then v' = 0.5 t - 1 from 2 s on.
        class Slides(Push):
            @force
            def push(self) -> list[Load]:
                """Return the force."""
                return [Load(self.point, (0.5 * self.time - sign(self.point.velocity[0]), 0.0, 0.0))]

        scene = moving(lambda x, v: 0.0, v=0.0, base=Slides)
        result = simulate(scene, t_end=6.0, rtol=1e-8)
        assert result["bob.velocity.x"][-1] == pytest.approx(9.0 - 6.0 + 1.0, abs=1e-6)

    @pytest.mark.parametrize("solver", ["auto", "ida", "taylor"])
    @pytest.mark.parametrize(("v", "end"), [(1.0, 1.5), (-1.0, -1.0), (0.0, 0.5)])
    def test_a_start_on_the_switch(self, v: float, end: float, solver: str) -> None:
        scene = moving(lambda x, _: select(x < 0.0, 0.0, 1.0), v=v)
        assert simulate(scene, t_end=1.0, solver=solver)["bob.position.x"][-1] == pytest.approx(end, abs=1e-12)

    def test_a_switch_at_the_very_end(self) -> None:
        for end in (1.0, math.nextafter(1.0, 0.0), math.nextafter(1.0, 2.0), 1.0 + 1e-15):
            result = simulate(moving(lambda x, _: select(x < 1.0, 0.0, 1.0)), t_end=end)
            assert result.time[-1] == end
            assert result["bob.position.x"][-1] == pytest.approx(1.0, abs=1e-14)

    def test_rest_on_a_switch(self) -> None:
        for law in (lambda x, _: -maximum(x, 0.0), lambda x, _: -sign(x), lambda x, _: sign(x)):
            assert simulate(moving(law, v=0.0), t_end=1.0)["bob.position.x"][-1] == pytest.approx(0.0, abs=1e-10)

    @pytest.mark.parametrize("solver", ["auto", "ida", "taylor"])
    def test_switches_of_one_moment_and_switches_in_switches(self, solver: str) -> None:
        two = moving(lambda x, _: select(x < 1.0, 0.0, 1.0) + select(2.0 * x < 2.0, 0.0, 1.0))
        assert simulate(two, t_end=2.0, solver=solver)["bob.position.x"][-1] == pytest.approx(3.0, abs=1e-10)
        nested = moving(lambda x, _: select(absolute(x - 2.0) < 0.05, 1.0, 0.0))
        found = simulate(nested, t_end=10.0, solver=solver)["bob.position.x"][-1]
        assert found == pytest.approx(behind_band(10.0, 0.1, begin=1.95), abs=1e-10)

    def test_errors_follow_the_tolerance(self) -> None:
        # Springs of 100 N/m to the right and 400 N/m to the left: half swings of pi/10 s and pi/20 s.
        scene = moving(lambda x, _: -select(x < 0.0, 400.0 * x, 100.0 * x))
        t = math.fmod(10.0, 0.15 * math.pi)
        exact = 0.1 * math.sin(10.0 * t) if t < 0.1 * math.pi else -0.05 * math.sin(20.0 * (t - 0.1 * math.pi))
        for rtol in (1e-4, 1e-6, 1e-8, 1e-10, 1e-12):
            found = simulate(scene, t_end=10.0, rtol=rtol)["bob.position.x"][-1]
            assert found == pytest.approx(exact, abs=300.0 * rtol)


class TestBeside:
    def test_the_work_in_a_mechanism_with_a_loop(self) -> None:
        for form, solver in (("reduced", "auto"), ("reduced", "ida"), ("reduced", "explicit"), ("dae", "auto")):
            law = lambda x, _: select(x > 1.5, select(x < 1.51, 50.0, 0.0), 0.0)  # noqa: E731
            scene, part = Scene(gravity=0.0), type("Law", (Push,), {"law": staticmethod(law)})
            crank, push = scene.add("crank", SliderCrank()), scene.add("push", part())
            scene.connect(crank.piston.point, push.point)
            result = simulate(scene, t_end=4.0, form=form, solver=solver, rtol=1e-9, outputs=401)
            x = result["crank.piston.position.x"]
            crossed = np.flatnonzero((x[1:] - 1.505) * (x[:-1] - 1.505) < 0.0)
            net = np.cumsum(np.sign(x[crossed + 1] - x[crossed]))
            assert len(crossed) >= 2
            gained = result.energy.kinetic[crossed + 3] - result.energy.kinetic[0]
            assert gained == pytest.approx(0.5 * net, abs=1e-6)

    def test_conditions_and_events_count_each_passing_once(self) -> None:
        class Counts(Hill):
            count: Any = discrete_state(0.0, doc="How often it has passed.")

            @event(direction=0, message="passes the edge")
            def passes(self) -> Scalar:
                """Return what passes zero."""
                return self.point.position[0] - 2.03

            @update(sets="count", at="passes")
            def counted(self) -> Scalar:
                """Return one more."""
                return self.count + 1.0

        scene = moving(lambda x: absolute(x - 2.03), base=Counts)
        result = simulate(scene, t_end=20.0, record="bob.position.x crosses 2.04")
        v = math.sqrt(5.06)
        assert result["push.count"][-1] == 1 + math.floor((20.0 - (v - 1.0)) / (2.0 * v))
        assert len([one for one in result.events if "2.04" in one.message]) == result["push.count"][-1]
        until = simulate(scene, t_end=20.0, until="bob.position.x crosses 2.04")
        assert until.time[-1] == pytest.approx(v - 1.0 + v - math.sqrt(v * v - 0.02), abs=1e-8)

    def test_who_reads_a_scene_sees_its_laws_as_they_are(self) -> None:
        assembly = assemble(moving(band(0.1)))
        before = assembly.own_equations.rows
        result = simulate(assembly, t_end=5.0)
        assert assembly.own_equations.rows is before
        assert result.assembly.sides is None
        assert all(one.assembly.sides is None for one in result.run.segments)
        accelerations = dynamics(assembly).forward_dynamics
        for x, a in ((1.9, 0.0), (2.05, 1.0), (2.2, 0.0)):
            assert accelerations([x, 0.0], [1.0, 0.0])[0] == a
        scene = Scene(gravity=0.0)
        scene.connect(scene.add("bob", PointMass()).point, scene.add("edge", Edge()).point)
        scene.start["bob.position.x"], scene.start["bob.velocity.x"] = 0.0, 1.0
        result = simulate(scene, t_end=5.0)
        again = pickle.loads(pickle.dumps(result))
        assert np.array_equal(again["bob.acceleration.x"], result["bob.acceleration.x"])
