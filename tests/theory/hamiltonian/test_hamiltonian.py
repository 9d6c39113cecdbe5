"""The Hamiltonian of a scene, in symbols and in numbers."""

from __future__ import annotations

import numpy as np
import pytest
import sympy

from atwood import (
    Component,
    Point,
    Scalar,
    Scene,
    StartError,
    UnsupportedError,
    UsageError,
    assemble,
    connector,
    dot,
    hamiltonian,
    lagrangian,
    simulate,
    sqrt,
)
from atwood_library import PointMass
from atwood_library.scenes import (
    Chain,
    ChargedParticle,
    DoublePendulum,
    DrivenPendulum,
    FallingWithDrag,
    FourBar,
    FreeBody,
    Kepler,
    LagrangeTop,
    PendulumOnCart,
    RollingDisc,
    RotatingHoopDriven,
    SimplePendulum,
    SphericalPendulum,
)

CASES = {
    "pendulum": SimplePendulum,
    "double pendulum": DoublePendulum,
    "Kepler": Kepler,
    "charge": ChargedParticle,
    "top": LagrangeTop,
    "cart": PendulumOnCart,
    "sphere": lambda: SphericalPendulum(coordinates="angles"),
    "hoop": RotatingHoopDriven,
    "driven": DrivenPendulum,
}


def _state(h, seed=1):
    random = np.random.default_rng(seed)
    q, _ = h.start()
    return q + random.uniform(0.1, 0.4, len(q)), random.uniform(-1.0, 1.0, len(q)), 0.3


@pytest.mark.sample(3)
@pytest.mark.parametrize("case", CASES)
def test_symbols_say_what_numbers_do(case):
    """H, its derivatives and Hamilton's equations by sympy are those by the Legendre transform in numbers."""
    h = hamiltonian(CASES[case]())
    q, p, t = _state(h)
    place = {**dict(zip(h.coordinates, q, strict=True)), **dict(zip(h.momenta, p, strict=True))}
    place |= {**h.values, sympy.Symbol("t"): t}
    assert float(h.expression.subs(place)) == pytest.approx(float(h(q, p, t)), rel=1e-12)
    slopes, velocities = h.gradient(q, p, t)
    rates, forces = h.equations
    np.testing.assert_allclose([float(one.subs(place)) for one in rates], velocities, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose([-float(one.subs(place)) for one in forces], slopes, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(h.momenta_at(q, velocities, t), p, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("case", CASES)
def test_the_gradient_is_that_of_h(case):
    h = hamiltonian(CASES[case]())
    q, p, t = _state(h, 2)
    n, step = len(q), 1e-3
    moves = step * np.vstack([np.eye(2 * n)])
    states = [np.concatenate([q, p]) + k * moves for k in (-2, -1, 1, 2)]
    low2, low, high, high2 = (h(one[:, :n], one[:, n:], t) for one in states)
    slopes = (8.0 * (high - low) - (high2 - low2)) / (12.0 * step)
    np.testing.assert_allclose(np.concatenate(h.gradient(q, p, t)), slopes, rtol=1e-7, atol=1e-8)
    before, after = h(q, p, t - step), h(q, p, t + step)
    assert float(h.time_derivative(q, p, t)) == pytest.approx((after - before) / (2.0 * step), rel=1e-4, abs=1e-8)


def test_the_top_has_its_textbook_form():
    h = hamiltonian(LagrangeTop())
    (phi, theta, psi), (p_phi, p_theta, p_psi) = h.coordinates, h.momenta
    m, c, g, i1, i3 = sympy.symbols("m c_z g I_1 I_3")
    inertia = i1 + m * c**2
    book = (p_phi - p_psi * sympy.cos(theta)) ** 2 / (2 * inertia * sympy.sin(theta) ** 2)
    book += p_theta**2 / (2 * inertia) + p_psi**2 / (2 * i3) + m * g * c * sympy.cos(theta)
    assert sympy.expand(h.expression - book) == 0
    assert not h.expression.has(phi)
    assert not h.expression.has(psi)


def test_magnetic_terms_and_the_gauge():
    """A charge has p = m v + e A, and (p - e A)^2/2m + e phi is its energy in every gauge."""
    values = []
    for gauge in ("symmetric", "x", "z"):
        h = hamiltonian(ChargedParticle(gauge=gauge, electric_x=0.2))
        q, _ = h.start()
        q, v = q + np.array([0.3, -0.2]), np.array([0.7, -0.4])
        values.append(float(h(q, h.momenta_at(q, v))))
        assert h.is_energy
    np.testing.assert_allclose(values, values[0], rtol=1e-12)


def test_what_is_said_of_h():
    assert hamiltonian(SimplePendulum()).sentence == "H = T + V; it is conserved."
    hoop = hamiltonian(RotatingHoopDriven())
    assert (hoop.is_energy, hoop.is_conserved) == (False, True)
    driven = hamiltonian(DrivenPendulum())
    assert (driven.is_energy, driven.is_conserved) == (False, False)
    falling = hamiltonian(FallingWithDrag())
    assert (falling.is_energy, falling.is_conserved, falling.other_forces) == (True, False, ("air",))


def test_forces_beside_h_are_in_the_rates():
    h = hamiltonian(FallingWithDrag())
    q, p = h.start()
    result = simulate(FallingWithDrag(), t_end=1e-3, outputs=[0.0, 1e-3], rtol=1e-12)
    rates, forces = h.rates(q, p)
    mass = h.momenta_at(q, [1.0, 0.0])[0]
    acceleration = forces / mass
    for axis, a in zip("xz", acceleration, strict=True):
        assert result[f"ball.acceleration.{axis}"][0] == pytest.approx(a, rel=1e-9)
    assert rates[0] == pytest.approx(result["ball.velocity.x"][0])


def test_large_scenes_have_numbers():
    h = hamiltonian(Chain(links=15))
    assert not h.is_short
    with pytest.raises(UnsupportedError, match="would fill a page"):
        _ = h.expression
    q, p = h.start()
    result = simulate(Chain(links=15), t_end=0.2, rtol=1e-11)
    assert float(h(q, p)) == pytest.approx(result.energy.total[0], abs=1e-9)
    velocities = np.array([result[path.replace("angle", "angular_velocity")][-1] for path in h.paths])
    places = np.array([result[path][-1] for path in h.paths])
    assert float(h(places, h.momenta_at(places, velocities))) == pytest.approx(float(h(q, p)), abs=1e-8)


class NearLight(Component):
    """Makes of a point of mass 1 one of rest mass 1 with the speed of light 1."""

    point: Point = connector(Point, "The point.")

    @lagrangian
    def law(self) -> Scalar:
        square = dot(self.point.velocity, self.point.velocity)
        return 1.0 - sqrt(1.0 - square) - 0.5 * square


class NoInertia(Component):
    """Takes the inertia of a point of mass 1 away, and puts it into a magnetic field."""

    point: Point = connector(Point, "The point.")

    @lagrangian
    def law(self) -> Scalar:
        r, v = self.point.position, self.point.velocity
        return r.z * v.x - r.x * v.z - dot(r, r) - 0.5 * dot(v, v)


def _with_law(law):
    scene = Scene(gravity=0.0)
    point, part = scene.add("point", PointMass(mass=1.0)), scene.add("law", law())
    scene.connect(part.point, point.point)
    return scene


def test_a_momentum_that_is_no_multiple_of_the_velocity():
    """A particle near the speed of light: H = sqrt(p^2 + 1) - 1 in units of m c^2, by Newton's method in numbers."""
    scene = _with_law(NearLight)
    h = hamiltonian(scene)
    p = np.array([[3.0, -4.0], [0.1, 0.0], [0.0, 30.0]])
    size = np.sqrt(1.0 + np.sum(p**2, axis=1))
    np.testing.assert_allclose(h(np.zeros((3, 2)), p), size - 1.0, rtol=1e-11)
    np.testing.assert_allclose(h.velocities_at(np.zeros((3, 2)), p), p / size[:, None], rtol=1e-11)


@pytest.mark.parametrize(
    ("make", "said"),
    [(RollingDisc, "it rolls"), (FourBar, "closed loops tie"), (SphericalPendulum, "tie its 3 coordinates")],
)
def test_scenes_without_h_say_why(make, said):
    with pytest.raises(UnsupportedError, match=said):
        hamiltonian(make())


def test_a_singular_mass_matrix_names_what_has_no_inertia():
    """A charge without mass in a magnetic field: L is linear in its velocities."""
    with pytest.raises(UnsupportedError, match=r"mass matrix is singular: point\.position"):
        hamiltonian(_with_law(NoInertia))


def test_the_dae_form_and_singular_starts_are_told():
    with pytest.raises(UsageError, match="dae form"):
        hamiltonian(assemble(SimplePendulum(), form="dae"))
    with pytest.raises(StartError, match="singular"):
        hamiltonian(FreeBody()).start()
    q, p = hamiltonian(FreeBody(), orientation="euler-zyx").start()
    assert np.all(np.isfinite([*q, *p]))


def test_it_shows_itself():
    h = hamiltonian(DoublePendulum())
    assert repr(h) == "Hamiltonian('DoublePendulum': 2 coordinates; H = T + V; it is conserved)"
    assert r"p_{\theta_{1}}" in h.latex()
    assert "H = " in h.text()
    assert "<h4>DoublePendulum: Hamiltonian</h4>" in h._repr_html_()
    assert "| $p_{\\theta_{1}}$ | `p:rod1.angle` | kg*m^2/s |" in h.markdown()
    assert h.to_dict()["coordinates"] == ["rod1.angle", "rod2.angle"]
    large = hamiltonian(Chain(links=13))
    assert "is there in numbers" in large.text()
