"""Pictures of reduced motions: where they turn, and the path of a top's axis."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import atwood
from atwood import UsageError, reduced
from atwood_library.scenes import LagrangeTop, RotatingHoopFree, SimplePendulum


@pytest.mark.parametrize(
    "scene", [LagrangeTop(), RotatingHoopFree(), SimplePendulum()], ids=["top", "hoop", "pendulum"]
)
def test_effective_potentials_meet_the_energy_where_the_motion_turns(scene: atwood.Scene, tmp_path) -> None:
    motion = reduced(scene)
    figure = atwood.plot_effective_potential(motion, tmp_path / "potential.png")
    points = [line for line in figure.axes[0].lines if line.get_marker() == "o"]
    assert [float(one.get_xdata()[0]) for one in points] == pytest.approx(motion.turning_points)
    assert motion.effective_potential(np.array(motion.turning_points)) == pytest.approx(motion.energy, rel=1e-9)
    assert (tmp_path / "potential.png").stat().st_size > 5_000
    plt.close(figure)


def test_a_pendulum_that_turns_over_has_a_picture() -> None:
    scene = SimplePendulum(release_angle=0.0)
    scene.start["rod.angular_velocity"] = 9.0
    motion = reduced(scene)
    assert motion.kind == "rotation"
    plt.close(atwood.plot_effective_potential(motion))


@pytest.mark.sample(0)
def test_the_axis_of_a_top_stays_between_its_circles() -> None:
    motion = reduced(LagrangeTop())
    figure = atwood.plot_top_path(motion, periods=3)
    roots = [line for line in figure.axes[0].lines if line.get_marker() == "o"]
    ends = sorted(float(np.cos(angle)) for angle in motion.turning_points)
    assert [float(one.get_xdata()[0]) for one in roots] == pytest.approx(ends)
    assert "3 periods" in figure.axes[1].get_title(loc="left")
    plt.close(figure)


def test_what_has_no_path_is_said() -> None:
    with pytest.raises(UsageError, match="nothing turns about the vertical"):
        atwood.plot_top_path(reduced(SimplePendulum()))
    with pytest.raises(UsageError, match=r"phy: there is no such ignorable angle"):
        atwood.plot_top_path(reduced(LagrangeTop()), azimuth="top.phy")
