"""Liouville's theorem: areas of clouds that flow, and densities on phase space."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest
import sympy

import atwood
from atwood import UnsupportedError, UsageError, hamiltonian, liouville_density, phase_cloud, simulate
from atwood.theory.hamiltonian.phase_space import vanishes
from atwood_library import Drag
from atwood_library.scenes import DoublePendulum, DrivenPendulum, Oscillators, SimplePendulum


def test_the_area_of_a_cloud_is_kept_and_its_states_are_those_of_runs() -> None:
    found = phase_cloud(SimplePendulum(mass=2.0), t_end=2.0)
    assert found.area == pytest.approx(np.full(5, found.area[0]), rel=1e-8)
    wide, tall = np.ptp(found.q[0, :, 0]), np.ptp(found.p[0, :, 0])
    assert found.area[0] == pytest.approx(np.pi * wide * tall / 4.0, rel=1e-12)
    scene = SimplePendulum(mass=2.0)
    scene.start.update({"rod.angle": found.q[0, 7, 0], "rod.angular_velocity": found.p[0, 7, 0] / 2.0})
    run = simulate(scene, t_end=2.0, rtol=1e-11)
    assert found.q[-1, 7, 0] == pytest.approx(run["rod.angle"][-1], abs=1e-7)


def test_of_several_coordinates_the_sum_of_the_shadows_is_kept() -> None:
    found = phase_cloud(DoublePendulum(), "rod2.angle", t_end=1.0)
    assert found.area == pytest.approx(np.full(5, found.area[0]), rel=1e-8)
    assert np.ptp(found.shadows[:, 0]) > 0.01
    driven = phase_cloud(DrivenPendulum(), t_end=1.0)
    assert driven.area == pytest.approx(np.full(5, driven.area[0]), rel=1e-8)
    with pytest.raises(UsageError, match="no coordinate"):
        phase_cloud(DoublePendulum(), "rod3.angle")


def test_friction_shrinks_it() -> None:
    """``div = -c/m`` for the drag c on the mass m, so that areas fall as ``exp(-c t/m)``."""
    scene = SimplePendulum(mass=2.0)
    drag = scene.add("drag", Drag(linear=0.5))
    scene.connect(drag.point, scene.bob.point)
    found = phase_cloud(scene, t_end=2.0)
    assert found.area == pytest.approx(found.area[0] * np.exp(-0.25 * found.time), rel=1e-8)
    with pytest.raises(UnsupportedError, match="forces act"):
        liouville_density("p_theta", hamiltonian(scene))


def test_liouville_s_equation() -> None:
    h = hamiltonian(Oscillators())
    found = liouville_density("exp(-u**2 - c*p_u**2)", h, constants=["c"])
    [u], [p] = h.coordinates, h.momenta
    m, k, a, t = sympy.symbols("m k a t")
    plain = {u: sympy.Symbol("u"), p: sympy.Symbol("p_u")}
    density, rate, solution = (one.xreplace(plain) for one in (found.density, found.rate, found.solution))
    x, y = plain.values()
    assert vanishes([rate - (2 * x * y / (m * a**2) - 2 * sympy.Symbol("c") * y * k * a**2 * x) * density]).holds
    assert vanishes([solution.subs(t, 0) - density, solution.diff(t).subs(t, 0) - rate]).holds
    assert not found.is_stationary
    pendulum = hamiltonian(SimplePendulum())
    assert liouville_density(pendulum.expression**2, pendulum).is_stationary
    assert liouville_density("p_theta", pendulum).solution is None


def test_a_cloud_is_drawn(tmp_path) -> None:
    figure = atwood.plot_phase_cloud(phase_cloud(SimplePendulum(), t_end=1.0), tmp_path / "cloud.png")
    assert len(figure.axes[0].patches) == 5
    plt.close("all")
