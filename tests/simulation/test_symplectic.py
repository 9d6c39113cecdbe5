"""Scenes by the symplectic methods of Gauss: order, energy over long times, what is kept, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from atwood import (
    Component,
    Point,
    Scalar,
    Scene,
    SolveError,
    UnsupportedError,
    UsageError,
    compare,
    connector,
    dot,
    lagrangian,
    simulate,
    sqrt,
)
from atwood_library import PointMass
from atwood_library.scenes import (
    Bricard,
    Chain,
    ChargedParticle,
    DoublePendulum,
    DrivenPendulum,
    FallingWithDrag,
    FourBar,
    FreeBody,
    Kepler,
    LagrangeTop,
    NBody,
    RollingDisc,
    RotatingHoopDriven,
    SimplePendulum,
    SliderCrank,
    SphericalPendulum,
)

ORDERS = {2: (0.04, 0.02), 4: (0.1, 0.05), 6: (0.1, 0.05), 8: (0.2, 0.1), 10: (0.3, 0.2), 12: (0.4, 0.25)}


@pytest.mark.sample(5)
@pytest.mark.parametrize("order", ORDERS)
def test_the_order_is_that_of_the_method(order):
    scene, t = SimplePendulum(), np.linspace(0.0, 4.0, 41)
    exact = scene.closed_form(t)["rod.angle"]
    errors = []
    for step in ORDERS[order]:
        run = simulate(scene, solver="gauss", order=order, step=step, outputs=t)
        errors.append(np.max(np.abs(run["rod.angle"] - exact)))
    first, second = ORDERS[order]
    observed = np.log(errors[0] / errors[1]) / np.log(first / second)
    assert observed == pytest.approx(order, abs=0.6)


@pytest.mark.parametrize(("order", "count"), [(2, 80), (4, 80), (6, 80), (8, 60)])
def test_compositions_have_their_order(order, count):
    """One turn of a planet, which is at its start again."""
    errors = []
    for steps in (count, 2 * count):
        run = simulate(
            Kepler(eccentricity=0.3),
            t_end=4.0 * np.pi,
            solver="composition",
            order=order,
            step=2.0 * np.pi / steps,
            outputs=[0.0, 4.0 * np.pi],
            samples=1,
        )
        errors.append(np.hypot(run["body.position.x"][-1] - 0.7, run["body.position.z"][-1]))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.5)


@pytest.mark.parametrize("scene", [SimplePendulum(), RotatingHoopDriven(), NBody()], ids=["pendulum", "hoop", "bodies"])
def test_compositions_come_where_others_do(scene):
    ours = simulate(scene, t_end=1.0, solver="composition", rtol=1e-11)
    theirs = simulate(scene, t_end=1.0, rtol=1e-12)
    for path in scene.start:
        np.testing.assert_allclose(ours[path], theirs[path], atol=2e-8)


@pytest.mark.parametrize("scene", [DoublePendulum(), ChargedParticle()], ids=["double pendulum", "charge"])
def test_what_does_not_separate_has_no_composition(scene):
    with pytest.raises(UnsupportedError, match="its H is no sum of a function of momenta and one of coordinates"):
        simulate(scene, solver="composition")


def test_there_is_no_composition_of_order_ten():
    with pytest.raises(UsageError, match="there is no composition of order 10"):
        simulate(SimplePendulum(), solver="composition", order=10)


LONG = {
    "pendulum": (SimplePendulum(), 2.1397, 6, 24.3),
    "Kepler": (Kepler(eccentricity=0.5), 2.0 * np.pi, 8, 50.3),
    "spherical pendulum": (SphericalPendulum(coordinates="angles"), 2.0, 6, 40.3),
    "Kepler by a composition": (Kepler(eccentricity=0.5), 2.0 * np.pi, 6, 80.3),
}


@pytest.mark.sample(3)
@pytest.mark.parametrize("case", LONG)
def test_the_energy_error_does_not_grow(case):
    """Over a thousand periods; `benchmarks/symplectic.py` shows a hundred thousand."""
    scene, period, order, count = LONG[case]
    solver = "composition" if "composition" in case else "gauss"
    end = 1000.0 * period
    times = np.concatenate([np.linspace(0.0, 0.1 * end, 1500), np.linspace(0.9 * end, end, 1500)])
    run = simulate(scene, t_end=end, solver=solver, order=order, step=period / count, outputs=times, samples=1)
    errors = np.abs(run.energy.total - run.energy.total[0])
    first, last = np.max(errors[:1500]), np.max(errors[1500:])
    assert last <= 2.0 * first
    # An error of the method, not of the arithmetic.
    assert first > 1e-12


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("scene", "path"),
    [
        (DoublePendulum(), "rod2.angle"),
        (LagrangeTop(), "top.theta"),
        (LagrangeTop(inclination="1 deg", spin=2.0), "top.angular_velocity.x"),
        (FreeBody(), "body.angular_velocity.y"),
        (ChargedParticle(), "particle.position.z"),
        (DrivenPendulum(), "rod.angle"),
        (Chain(links=8), "rod[3].angle"),
    ],
    ids=["double pendulum", "top", "upright top", "free body", "charge", "driven pendulum", "chain"],
)
def test_motions_are_those_of_other_methods(scene, path):
    """Bodies in space with quaternions, magnetic terms, prescribed motions: a step that is not given is accurate."""
    ours = simulate(scene, t_end=1.0, solver="gauss", rtol=1e-10)
    theirs = simulate(scene, t_end=1.0, solver="explicit", rtol=1e-12)
    scale = max(1.0, float(np.max(np.abs(theirs[path]))))
    assert np.max(np.abs(ours[path] - theirs[path])) < 2e-8 * scale
    assert "gauss" in ours.solver.lower()


class NearLight(Component):
    """Makes of a point of mass 1 one of rest mass 1 with the speed of light 1, in a uniform field."""

    point: Point = connector(Point, "The point.")

    @lagrangian
    def law(self) -> Scalar:
        square = dot(self.point.velocity, self.point.velocity)
        return 1.0 - sqrt(1.0 - square) - 0.5 * square + self.point.position.x


def test_a_mass_that_depends_on_the_velocity():
    """A charge that falls through a field near the speed of light: ``x = sqrt(1 + t^2) - 1``."""
    scene = Scene(gravity=0.0)
    point, law = scene.add("point", PointMass(mass=1.0)), scene.add("law", NearLight())
    scene.connect(law.point, point.point)
    scene.start.update({"point.position.x": 0.0, "point.position.z": 0.0})
    run = simulate(scene, t_end=3.0, solver="gauss", order=8, step=0.05)
    np.testing.assert_allclose(run["point.position.x"], np.sqrt(1.0 + run.time**2) - 1.0, atol=1e-11)


def test_quadratic_invariants_are_kept_to_rounding():
    """The angular momentum of a free body and of a planet, at steps that are far from accurate."""
    run = simulate(Kepler(eccentricity=0.5), t_end=200.0, solver="gauss", order=2, step=0.1)
    x, z, vx, vz = (run[f"body.{name}"] for name in ("position.x", "position.z", "velocity.x", "velocity.z"))
    momentum = x * vz - z * vx
    assert np.max(np.abs(momentum - momentum[0])) < 1e-12


def test_outputs_and_noted_conditions_change_nothing():
    scene = SimplePendulum()
    settings = {"t_end": 5.0, "solver": "gauss", "order": 6, "step": 0.1}
    few = simulate(scene, outputs=[0.0, 5.0], samples=1, **settings)
    many = simulate(scene, outputs=np.linspace(0.0, 5.0, 501), **settings)
    noted = simulate(scene, outputs=[0.0, 5.0], record="rod.angle crosses 0", **settings)
    assert few["rod.angle"][-1] == many["rod.angle"][-1] == noted["rod.angle"][-1]
    exact = simulate(scene, t_end=5.0, rtol=1e-12, record="rod.angle crosses 0")
    np.testing.assert_allclose([one.time for one in noted.events], [one.time for one in exact.events], rtol=1e-6)


def test_backwards_in_time_it_comes_to_its_start():
    """The methods are symmetric: with the velocity turned round the same steps lead back."""
    forth = simulate(SimplePendulum(), t_end=3.0, solver="gauss", order=2, step=0.1, outputs=[0.0, 3.0])
    scene = SimplePendulum()
    scene.start["rod.angle"] = float(forth["rod.angle"][-1])
    scene.start["rod.angular_velocity"] = -float(forth["rod.angular_velocity"][-1])
    back = simulate(scene, t_end=3.0, solver="gauss", order=2, step=0.1, outputs=[0.0, 3.0])
    assert back["rod.angle"][-1] == pytest.approx(1.0, abs=1e-13)


@pytest.mark.sample(3)
@pytest.mark.parametrize("order", [2, 4, 6])
@pytest.mark.parametrize(
    "scene", [FourBar(), FourBar(space="space"), SliderCrank()], ids=["four-bar", "in space", "slider-crank"]
)
def test_loops_that_formulas_solve_have_their_order(scene, order):
    exact = simulate(scene, t_end=0.6, solver="taylor", rtol=1e-13, outputs=[0.0, 0.6])
    steps = (0.02, 0.01) if order < 6 else (0.03, 0.02)
    errors = []
    for step in steps:
        run = simulate(scene, t_end=0.6, solver="gauss", order=order, step=step, outputs=[0.0, 0.6])
        errors.append(np.max(np.abs(run["crank.angle"] - exact["crank.angle"])))
    assert np.log(errors[0] / errors[1]) / np.log(steps[0] / steps[1]) == pytest.approx(order, abs=0.6)


def test_the_energy_of_a_linkage_does_not_drift():
    """A crank that turns over and over: samples at whole steps, a period some fifty."""
    step, count = 0.02, 50_000
    outputs = step * np.unique(np.r_[np.arange(0, 5000), np.arange(count - 5000, count + 1)])
    run = simulate(FourBar(), t_end=step * count, outputs=outputs, solver="gauss", order=4, step=step, samples=1)
    errors = run.energy.total - run.energy.total[0]
    first, last = errors[:5000], errors[-5000:]
    assert np.max(np.abs(first)) > 1e-9
    assert np.max(np.abs(last)) < 3.0 * np.max(np.abs(first))
    assert abs(np.mean(last) - np.mean(first)) < 0.2 * np.max(np.abs(first))


def test_dead_centres_are_passed():
    """A linkage none of whose links turns fully: other coordinates take over at each end of a swing."""
    scene = FourBar(crank_length=2.0, coupler_length=1.5, rocker_length=1.8, frame_length=3.0)
    scene.start, scene.guess = {"crank.angle": 1.0, "crank.angular_velocity": 0.5}, {"rocker.angle": 2.0}
    ours = simulate(scene, t_end=4.0, solver="gauss", step=0.0025)
    theirs = simulate(scene, t_end=4.0, solver="taylor", rtol=1e-12)
    assert ours.statistics.reinitializations > 0
    for link in ("crank", "coupler", "rocker"):
        np.testing.assert_allclose(ours[f"{link}.angle"], theirs[f"{link}.angle"], atol=2e-8)


def damped_four_bar():
    """Return a linkage that loses energy."""
    scene = FourBar()
    scene.pivot1.damping = 0.1
    return scene


@pytest.mark.parametrize(
    ("make", "error", "said"),
    [
        (RollingDisc, UnsupportedError, "it rolls"),
        (Bricard, UsageError, "without closed loops"),
        (damped_four_bar, UnsupportedError, "pivot1: its forces do not follow from a Hamiltonian"),
        (FallingWithDrag, UnsupportedError, "air: its forces do not follow from a Hamiltonian"),
    ],
)
def test_what_has_no_hamiltonian_is_refused(make, error, said):
    with pytest.raises(error, match=said):
        simulate(make(), solver="gauss")


def test_settings_that_mean_nothing_are_refused():
    with pytest.raises(UsageError, match="order cannot be 3"):
        simulate(SimplePendulum(), solver="gauss", order=3)
    with pytest.raises(UsageError, match="is for the solvers 'gauss'"):
        simulate(SimplePendulum(), step=0.1)
    with pytest.raises(UsageError, match="step cannot be 1e-12, which asks for"):
        simulate(SimplePendulum(), solver="gauss", step=1e-12)
    with pytest.raises(SolveError, match="give a smaller step"):
        simulate(SimplePendulum(), solver="gauss", step=10.0)


def test_it_stands_beside_the_others_in_comparisons():
    found = compare(SimplePendulum(), t_end=2.0, rtols=[1e-5, 1e-9], forms=["reduced"])
    rows = [row for row in found.rows if row.label == "reduced, gauss"]
    assert [row.reason for row in rows] == ["", ""]
    errors = [row.error for row in rows]
    assert errors[1] < 1e-2 * errors[0]
