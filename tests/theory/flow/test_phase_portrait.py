"""Phase portraits against energies and closed forms."""

import math

import matplotlib.pyplot as plt
import numpy as np
import pytest

import atwood
from atwood import PhasePortrait, UnsupportedError, UsageError, phase_portrait
from atwood.theory.flow.plane_field import Window, curves_through
from atwood_library import Drag
from atwood_library.scenes import (
    Atwood,
    DoublePendulum,
    DrivenPendulum,
    Oscillators,
    RotatingHoopDriven,
    SimplePendulum,
)

from ..oscillations.scenes import turning_rod

ENERGIES = {
    "free": lambda q: 0.0 * q,
    "harmonic": lambda q: 2.0 * q**2,
    "inverted": lambda q: -2.0 * q**2,
    "pendulum": lambda q: 4.0 * (1.0 - np.cos(q)),
}
TURN = round(math.pi, 9)
KINDS = {"free": [], "harmonic": ["centre"], "inverted": ["saddle"], "pendulum": ["saddle", "centre", "saddle"]}


@pytest.mark.sample(1)
@pytest.mark.parametrize("kind", ENERGIES)
def test_curves_keep_the_energy_of_textbook_oscillators(kind: str) -> None:
    found = phase_portrait(Oscillators(kind=kind))
    assert [one.kind for one in found.rest_points] == KINDS[kind]
    assert found.everywhere_at_rest == (kind == "free")
    assert len(found.curves) > 8
    for curve in (*found.curves, *found.separatrices):
        energy = 0.5 * curve[:, 1] ** 2 + ENERGIES[kind](curve[:, 0])
        assert energy == pytest.approx(energy[0], rel=1e-4, abs=1e-4)


@pytest.mark.parametrize("across", [None, (-2.0, 2.0), (-2.0, 2.00017)])
def test_where_a_spring_has_no_length_nothing_rests(across: tuple[float, float] | None) -> None:
    """A bead on a spring on a rod that turns: accelerations jump at the axle, where they have no value."""
    found = phase_portrait(turning_rod(), coordinates=across)
    assert [one.kind for one in found.rest_points] == ["centre"] * 2
    assert [one.coordinate for one in found.rest_points] == pytest.approx([-0.9, 0.9], abs=1e-9)


def test_separatrices_of_the_pendulum_have_the_energy_of_its_top() -> None:
    found = phase_portrait(SimplePendulum(), coordinates=("-200 deg", "200 deg"), speeds=(-10.0, 10.0))
    assert found.window == Window((-math.radians(200), math.radians(200)), (-10.0, 10.0))
    assert [one.coordinate for one in found.rest_points] == pytest.approx([-math.pi, 0.0, math.pi], abs=1e-12)
    assert [abs(one.eigenvalues[0]) for one in found.rest_points] == pytest.approx([math.sqrt(9.81)] * 3, rel=1e-7)
    assert len(found.separatrices) == 8
    for curve in found.separatrices:
        speed = 2.0 * math.sqrt(9.81) * np.abs(np.cos(curve[:, 0] / 2.0))
        assert np.abs(curve[:, 1]) == pytest.approx(speed, abs=5e-3)


def test_over_the_momentum_curves_are_level_sets_of_h() -> None:
    """``H = p^2/(2 m l^2) - m g l cos(theta)``, and m g l on the separatrices from one saddle to the other."""
    found = phase_portrait(SimplePendulum(mass=2.0, length=0.7), momenta=True)
    assert found.speed == "p_theta"
    assert found.units == ("rad", "J s")
    assert found.levels is not None
    for curve, level in zip(found.curves, found.levels, strict=True):
        h = curve[:, 1] ** 2 / (2.0 * 2.0 * 0.7**2) - 2.0 * 9.81 * 0.7 * np.cos(curve[:, 0])
        assert h == pytest.approx(level, rel=1e-4, abs=1e-4)
    between = [one for one in found.named if one.kind == "heteroclinic"]
    assert {(round(one.begin, 9), round(one.end, 9)) for one in between} == {(-TURN, TURN), (TURN, -TURN)}
    assert [one.energy for one in found.named] == pytest.approx([2.0 * 9.81 * 0.7] * 8, rel=1e-12)
    assert "heteroclinic" in found.as_text()
    hoop = phase_portrait(RotatingHoopDriven(), momenta=True)
    assert "homoclinic" in {one.kind for one in hoop.named if one.begin == pytest.approx(math.pi)}


@pytest.fixture(scope="module")
def portrait() -> PhasePortrait:
    return phase_portrait(SimplePendulum())


def test_motions_run_in_their_sense(portrait: PhasePortrait) -> None:
    for curve in portrait.curves:
        ahead = np.diff(curve, axis=0)
        fast = np.abs(curve[:-1, 1]) > 1.0
        assert np.all(ahead[fast, 0] * curve[:-1, 1][fast] > 0.0)


@pytest.mark.sample(0)
def test_friction_makes_a_focus() -> None:
    scene = SimplePendulum()
    drag = scene.add("drag", Drag(linear=0.5))
    scene.connect(drag.point, scene.bob.point)
    found = phase_portrait(scene)
    assert [one.kind for one in found.rest_points] == ["saddle", "stable focus", "saddle"]
    assert found.rest_points[1].eigenvalues[0].real == pytest.approx(-0.25, rel=1e-6)
    scene.drag.linear = 20.0
    assert phase_portrait(scene).rest_points[1].kind == "stable node"


def test_an_even_drive_is_no_hindrance() -> None:
    scene = RotatingHoopDriven()
    found = phase_portrait(scene, coordinates=(0.0, 2.0 * math.pi))
    kinds = {one.coordinate: one.kind for one in found.rest_points}
    inside = math.acos(-9.81 / (scene.radius * scene.rate**2))
    assert [where for where, kind in kinds.items() if kind == "centre"] == pytest.approx(
        [inside, 2.0 * math.pi - inside], abs=1e-9
    )


def test_order_of_the_curves_is_four() -> None:
    def spiral(points: np.ndarray) -> np.ndarray:
        return np.stack([points[:, 1], -points[:, 0]], axis=1)

    (curve,) = curves_through(spiral, np.array([[1.0, 0.0]]), Window((-2.0, 2.0), (-2.0, 2.0)), np.zeros((0, 2)))
    assert np.hypot(*curve.T) == pytest.approx(1.0, abs=1e-9)
    assert curve[-1] == pytest.approx(curve[0])


def test_what_has_no_portrait_is_said() -> None:
    machine = Atwood()
    machine.rope.when_slack = "slack"
    with pytest.raises(UsageError, match="This has 2 coordinates and 2 degrees of freedom"):
        phase_portrait(DoublePendulum())
    with pytest.raises(UsageError, match="depend on time"):
        phase_portrait(DrivenPendulum())
    with pytest.raises(UsageError, match="is no range"):
        phase_portrait(SimplePendulum(), coordinates=(1.0, -1.0))
    with pytest.raises(UnsupportedError, match="rope: its gap"):
        phase_portrait(machine)


def test_pictures_show_curves_and_points(portrait: PhasePortrait, tmp_path) -> None:
    figure = atwood.plot_phase_portrait(portrait, tmp_path / "phase.png")
    assert len(figure.axes[0].lines) == len(portrait.curves) + len(portrait.separatrices) + len(portrait.rest_points)
    assert (tmp_path / "phase.png").stat().st_size > 10_000
    section = atwood.poincare_section(
        DoublePendulum(), "rod1.angle rises above 0", ["rod2.angle", "rod2.angular_velocity"], t_end=10.0
    )
    assert len(atwood.plot_section(section).axes[0].lines[0].get_xdata()) == len(section)
    plt.close("all")
