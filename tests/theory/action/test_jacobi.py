"""The theory of Hamilton and Jacobi: separation, and action and angle variables."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.special import beta, ellipe, ellipk

from atwood import Scene, SolveError, UsageError, action_angle, exp, hamiltonian, separation
from atwood.theory.action.separation import Separation
from atwood_library import PointMass, Potential
from atwood_library.scenes import (
    ChargedParticle,
    DoublePendulum,
    DrivenPendulum,
    Kepler,
    LagrangeTop,
    NBody,
    RotatingHoopDriven,
    SimplePendulum,
    SphericalPendulum,
)

POLAR = {"body.position.x": "r*cos(phi)", "body.position.z": "r*sin(phi)"}
PARABOLIC = {"body.position.x": "xi*eta", "body.position.z": "(xi**2 - eta**2)/2"}


def test_kepler_separates_in_polar_and_parabolic_coordinates():
    scene = Kepler(eccentricity=0.5)
    assert not separation(scene).separates
    assert separation(scene, POLAR).separates
    assert separation(scene, PARABOLIC).separates
    assert not separation(scene, {"body.position.x": "a*b", "body.position.z": "a + b"}).separates


def test_kepler_separates_in_elliptic_coordinates_and_with_a_field_in_parabolic_ones():
    """One focus is the centre; in a uniform field along the axis, as of weight, polar coordinates do not do."""
    elliptic = {"body.position.x": "cosh(u)*cos(v) - 1", "body.position.z": "sinh(u)*sin(v)"}
    assert separation(Kepler(), elliptic).separates
    assert separation(Kepler(gravity=0.3), PARABOLIC).separates
    assert not separation(Kepler(gravity=0.3), POLAR).separates


def test_three_bodies_do_not_separate():
    found = separation(NBody())
    assert not found.separates
    assert "does not separate" in found.sentence


def test_other_scenes():
    assert separation(SphericalPendulum(coordinates="angles")).separates
    assert separation(LagrangeTop()).separates
    assert not separation(DoublePendulum()).separates
    assert separation(SimplePendulum()).separates


def test_action_variables_of_the_planet():
    """``E = -2 pi^2 m k^2/(J_r + J_phi)^2`` (Goldstein, equation 10.139), and the radial action itself."""
    found = separation(Kepler(eccentricity=0.5), POLAR)
    assert [str(one) for one in found.coordinates] == ["phi", "r"]
    q, p = [0.0, 0.5], [0.5 * np.sqrt(3.0), 0.0]
    radial, around = found.motion("r", q, p), found.motion("phi", q, p, turn=2.0 * np.pi)
    assert (radial.kind, around.kind) == ("libration", "rotation")
    np.testing.assert_allclose(radial.ends, [0.5, 1.5], rtol=1e-12)
    assert around.action == pytest.approx(np.pi * np.sqrt(3.0), rel=1e-13)
    assert radial.action + around.action == pytest.approx(2.0 * np.pi, rel=1e-12)
    # The same from another state of the same orbit, and the momentum that the quadrature is of.
    momentum = float(radial.momentum(1.2))
    other = found.motion("r", [2.0, 1.2], [0.5 * np.sqrt(3.0), momentum])
    assert other.action == pytest.approx(radial.action, rel=1e-11)
    h = hamiltonian(Kepler(eccentricity=0.5))
    assert float(h([0.5, 0.0], [0.0, np.sqrt(3.0)])) == pytest.approx(
        0.5 * (momentum**2 + 0.75 / 1.44) - 1.0 / 1.2, rel=1e-12
    )


def test_parabolic_action_variables_of_the_planet():
    """A turn of xi and of eta is two of the orbit, since a place has two pairs of them."""
    found = separation(Kepler(eccentricity=0.5), PARABOLIC)
    xi = eta = np.sqrt(0.5)
    p_x, p_z = 0.0, np.sqrt(3.0)
    q, p = [eta, xi], [p_x * xi - p_z * eta, p_x * eta + p_z * xi]
    total = sum(found.motion(name, q, p).action for name in ("xi", "eta"))
    assert total == pytest.approx(2.0 * 2.0 * np.pi, rel=1e-11)


def test_the_separated_momentum_in_symbols():
    import sympy

    found = separation(Kepler(eccentricity=0.5), POLAR)
    made = found.momentum_squared("r").subs(found.values)
    there = made.subs({"E": -0.5, "p_phi": 0.5 * sympy.sqrt(3)})
    assert abs(float(there.subs({"r": 0.5}))) < 1e-14
    assert float(there.subs({"r": 1.0})) == pytest.approx(0.25)


@pytest.mark.sample(1)
@pytest.mark.parametrize("amplitude", [0.5, 1.0, 2.5, 3.1])
def test_the_pendulum_that_swings(amplitude):
    """``T = 4 K(k)/w`` and ``J = 16 w (E(k) - (1 - k^2) K(k))`` with ``k = sin(amplitude/2)`` for m = l = 1."""
    found = action_angle(SimplePendulum(release_angle=amplitude))
    w, square = np.sqrt(9.81), np.sin(amplitude / 2.0) ** 2
    assert found.kind == "libration"
    assert found.period == pytest.approx(4.0 * ellipk(square) / w, rel=1e-10)
    assert found.action == pytest.approx(16.0 * w * (ellipe(square) - (1.0 - square) * ellipk(square)), rel=1e-12)
    np.testing.assert_allclose(found.turning_points, [-amplitude, amplitude], rtol=1e-12)


@pytest.mark.parametrize("amplitude", [1e-4, 1e-7])
def test_small_amplitudes_lose_no_digits(amplitude):
    found, w = action_angle(SimplePendulum(release_angle=amplitude)), np.sqrt(9.81)
    assert found.period == pytest.approx(2.0 * np.pi / w * (1.0 + amplitude**2 / 16.0), rel=1e-13)
    assert found.action == pytest.approx(np.pi * w * amplitude**2 * (1.0 - amplitude**2 / 32.0), rel=1e-13)
    assert found.error < 1e-13


def test_the_pendulum_that_goes_round():
    scene = SimplePendulum(release_angle=0.3)
    scene.start["rod.angular_velocity"] = 9.0
    found = action_angle(scene)
    energy = 40.5 - 9.81 * np.cos(0.3)
    square = 2.0 * 9.81 / (energy + 9.81)
    assert found.kind == "rotation"
    assert found.turning_points is None
    assert found.period == pytest.approx(2.0 * np.sqrt(2.0 / (energy + 9.81)) * ellipk(square), rel=1e-12)


def test_the_frequency_is_the_derivative_of_h_by_j():
    levels = [action_angle(SimplePendulum(release_angle=1.0 + step)) for step in (-1e-3, 0.0, 1e-3)]
    slope = (levels[2].energy - levels[0].energy) / (levels[2].action - levels[0].action)
    assert levels[1].frequency == pytest.approx(slope, rel=1e-6)


def test_the_angle_rises_evenly_in_time():
    from atwood import simulate

    scene = SimplePendulum(release_angle=1.0)
    found = action_angle(scene)
    times = np.linspace(0.0, 0.94 * found.period, 12)
    run = simulate(scene, t_end=float(times[-1]), rtol=1e-12, outputs=times)
    angles = [found.angle(q, v) for q, v in zip(run["rod.angle"], run["rod.angular_velocity"], strict=True)]
    np.testing.assert_allclose((np.array(angles) - 0.45) % 1.0, 0.05 + times / found.period, atol=1e-6)


def test_a_hoop_that_is_driven_has_action_and_angle():
    """H is conserved and not the energy; the bead swings about its place of rest at the side."""
    found = action_angle(RotatingHoopDriven())
    low, high = found.turning_points
    assert low < np.arccos(-9.81 / 25.0) < high or low < -np.arccos(-9.81 / 25.0) < high


def test_what_has_no_period_is_told():
    with pytest.raises(SolveError, match="at rest"):
        action_angle(SimplePendulum(release_angle=0.0))
    with pytest.raises(SolveError):
        action_angle(SimplePendulum(release_angle=np.pi))
    with pytest.raises(UsageError, match="2 degrees of freedom"):
        action_angle(DoublePendulum())
    with pytest.raises(UsageError, match="no level of H that it stays on"):
        action_angle(DrivenPendulum())


def test_wrong_coordinates_are_named():
    with pytest.raises(UsageError, match=r"leave out body\.position\.z"):
        separation(Kepler(), {"body.position.x": "r"})
    with pytest.raises(UsageError, match="2 coordinates are given by 3 others"):
        separation(Kepler(), {"body.position.x": "a*b", "body.position.z": "c"})
    with pytest.raises(UsageError, match="their Jacobian is zero"):
        separation(Kepler(), {"body.position.x": "a + b", "body.position.z": "a + b"})
    with pytest.raises(UsageError, match="none of the coordinates"):
        separation(Kepler(), POLAR).motion("x", [0.0, 1.0], [1.0, 0.0])


@pytest.mark.parametrize(
    "scene",
    [
        separation(Kepler(eccentricity=0.5), POLAR),
        separation(Kepler(eccentricity=0.5), PARABOLIC),
        separation(SphericalPendulum(coordinates="angles")),
    ],
    ids=["polar", "parabolic", "sphere"],
)
def test_the_square_of_a_momentum_is_a_function_of_its_own_coordinate_alone(scene: Separation) -> None:
    """On the curve that ``motion`` goes along: with E, momenta that are kept, and one value at another place."""
    q, p = np.array([1.1, 0.9]), np.array([0.3, 0.4])
    values = {str(symbol): value for symbol, value in scene.values.items()}
    for k, own in enumerate(scene.coordinates):
        found = scene.momentum_squared(str(own))
        other, its = scene.coordinates[1 - k], scene.momenta[1 - k]
        assert not found.has(other)
        kept = not scene.expression.has(other)
        assert kept or not found.has(its)
        state = dict(zip((*scene.coordinates, *scene.momenta), (*q, *p), strict=True))
        energy = float(scene.expression.subs({**scene.values, **state}))
        known = {"E": energy, f"alpha_{own}": p[k] ** 2, f"{own}_0": q[k], str(its): p[1 - k], **values}
        curve = scene.motion(str(own), q, p, turn=2.0 * np.pi if not scene.expression.has(own) else None)
        for place in q[k] + np.array([-0.05, 0.0, 0.05]):
            value = found.subs({one: known[str(one)] for one in found.free_symbols if one != own}).subs(own, place)
            along = float(curve.momentum(place))
            assert float(value) == pytest.approx(along**2, rel=1e-9) if np.isfinite(along) else float(value) < 0.0


def well(energy: Callable[..., Any], place: float, speed: float) -> Scene:
    scene = Scene(gravity=0.0, space="line")
    field, body = scene.add("field", Potential()), scene.add("body", PointMass(mass=1.0))
    scene.connect(field.point, body.point)
    scene.set("field.energy_function", energy)
    scene.start.update({"body.position.x": place, "body.velocity.x": speed})
    return scene


@pytest.mark.sample(2)
@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("place", "share"), [(0.5, 1.0), (2.0**0.5, 0.0), (0.0, 0.0), (-0.7, -1.0)])
def test_on_a_separatrix_nothing_has_a_period(place: float, share: float) -> None:
    speed = share * np.sqrt(max(0.0, 2.0 * (1.0 - (place**2 - 1.0) ** 2)))
    with pytest.raises(SolveError, match="separatrix"):
        action_angle(well(lambda x: (x**2 - 1.0) ** 2, place, speed))


TOPS = {
    "of powers": (lambda x: x**4 - x**6, (2.0 / 3.0) ** 0.5),
    "on one side": (lambda x: x**2 - x**3, 2.0 / 3.0),
    "of fourth order": (lambda x: 1.0 - (1.0 - x**2) ** 4, 1.0),
    "of a bell": (lambda x: x**2 * exp(-(x**2)), 1.0),
}


@pytest.mark.sample(1)
@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("name", "size", "height", "off"),
    [
        ("of powers", 1.0, 1.0, 0.0),
        ("of powers", 1.0, 1.0, 100.0),
        ("on one side", 1e-3, 1.0, 0.0),
        ("of fourth order", 1e3, 1e-6, 0.0),
        ("of a bell", 1.0, 1.0, 0.0),
    ],
)
def test_a_separatrix_is_one_whatever_its_size_and_place(name: str, size: float, height: float, off: float) -> None:
    law, top = TOPS[name]

    def energy(x: Any) -> Any:
        return height * law((x - off) / size)

    full, speeds = height * float(law(top)), {}
    for share in (0.0, 0.3):
        place = share * top
        speeds[place] = float(np.sqrt(2.0 * (full - height * float(law(place)))))
        with pytest.raises(SolveError, match="separatrix"):
            action_angle(well(energy, off + size * place, speeds[place]))
    below = action_angle(well(energy, off, 0.99 * speeds[0.0]))
    assert below.kind == "libration"
    x = below.period * speeds[0.0] / size  # as of the same law at unit size and height
    unit = action_angle(well(law, 0.0, 0.99 * float(np.sqrt(2.0 * float(law(top))))))
    assert x == pytest.approx(unit.period * np.sqrt(2.0 * float(law(top))), rel=1e-7)
    if name != "of a bell":
        with pytest.raises(SolveError, match="no turning point"):
            action_angle(well(energy, off, 1.01 * speeds[0.0]))


@pytest.mark.sample(2)
@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi])
def test_a_pendulum_that_comes_to_stand_has_no_period(angle: float) -> None:
    scene = SimplePendulum()
    rate = np.sqrt(2.0 * 9.81 / scene.length * (1.0 + np.cos(angle)))
    scene.start.update({"rod.angle": angle, "rod.angular_velocity": rate})
    with pytest.raises(SolveError, match="separatrix"):
        action_angle(scene)


def test_beside_the_separatrix_there_is_one_and_in_x_to_the_fourth() -> None:
    """The quartic oscillator: T = 4 B(1/4, 1/2)/4 sqrt(m/2)/a for V = x^4."""
    assert action_angle(well(lambda x: x**4, 0.5, 0.0)).period == pytest.approx(beta(0.25, 0.5) * np.sqrt(0.5) / 0.5)
    below = action_angle(well(lambda x: (x**2 - 1.0) ** 2, np.sqrt(2.0) * (1.0 - 1e-9), 0.0))
    assert below.kind == "libration"
    assert np.isfinite(below.period)


def test_a_charge_separates_in_the_gauge_in_which_a_coordinate_is_ignorable() -> None:
    assert not separation(ChargedParticle()).separates
    found = separation(ChargedParticle(), gauge="q*B*x*z/2")
    assert found.separates
    assert "p_x" in map(str, found.constants)
