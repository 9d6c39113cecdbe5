"""Pictures of turning bodies: their curves lie where energy and angular momentum say."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import atwood
from atwood import UsageError, simulate
from atwood.plotting.polhodes import polhode
from atwood_library import Box, PointMass, Weld
from atwood_library.scenes import DoublePendulum, FreeSymmetricBody, IntermediateAxis


@pytest.mark.parametrize("energy", [0.34, 0.42, 0.5, 0.7, 0.99])
def test_polhodes_lie_on_both_surfaces(energy: float) -> None:
    moments = np.array([1.0, 2.0, 3.0])
    curves = polhode(moments, energy)
    assert len(curves) == 2
    for curve in curves:
        assert np.sum(curve**2, axis=1) == pytest.approx(1.0, abs=1e-12)
        assert curve**2 @ (1.0 / moments) == pytest.approx(energy, abs=1e-12)
    assert not np.allclose(curves[0], curves[1])


def test_a_run_keeps_to_its_polhode(tmp_path) -> None:
    result = simulate(IntermediateAxis(), t_end=12.0, rtol=1e-10)
    figure = atwood.plot_polhodes(result, file=tmp_path / "polhodes.svg")
    assert (tmp_path / "polhodes.svg").stat().st_size > 10_000
    assert any("middle moment" in text.get_text() for text in figure.axes[0].texts)
    plt.close(figure)


def test_fixed_parts_count_and_what_has_no_polhodes_is_said() -> None:
    scene = atwood.Scene()
    scene.gravity, scene.t_end, scene.space = 0.0, 1.0, "space"
    box, lump = (
        scene.add("box", Box(length_x=0.3, length_y=0.4, mass=1.0)),
        scene.add("lump", PointMass(mass=0.5)),
    )
    weld = scene.add("weld", Weld(displacement=(0.1, 0.2, 0.05)))
    scene.connect(box.frame, weld.a)
    scene.connect(weld.b, lump.point)
    scene.start.update({"box.spin.x": 1.0, "box.spin.y": 0.2})
    result = simulate(scene)
    plt.close(atwood.plot_polhodes(result, "box"))
    with pytest.raises(UsageError, match="boks: there is no such rigid body"):
        atwood.plot_polhodes(result, "boks")
    with pytest.raises(UsageError, match="two of its moments of inertia are equal"):
        atwood.plot_polhodes(simulate(FreeSymmetricBody(), t_end=0.1))
    with pytest.raises(UsageError, match="are of motions in space"):
        atwood.plot_polhodes(simulate(DoublePendulum(), t_end=0.1))
