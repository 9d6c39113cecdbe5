"""Conserved quantities along runs, in both forms and with every orientation."""

import pickle

import numpy as np
import pytest
from click.testing import CliRunner

from atwood import Scene, UsageError, assemble, conserved, simulate
from atwood.cli import main
from atwood_library import Ground, PointMass, Rod
from atwood_library.scenes import SCENES


@pytest.mark.sample(3)
@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("name", ["pendulum-on-cart", "lagrange-top", "four-bar", "rotating-hoop-driven"])
def test_they_stay_along_runs_of_both_forms(name: str, form: str) -> None:
    scene = SCENES[name]()
    found = conserved(scene)
    result = simulate(scene, form=form, t_end=0.5, rtol=1e-9, outputs=21, monitor=found)
    assert tuple(result.conserved) == found.names
    assert result.conserved.max_drift < 1e-6
    for one in result.conserved.values():
        assert one.values.shape == result.time.shape
        assert one.size > 0.0


def test_the_momentum_is_what_it_says() -> None:
    scene = SCENES["pendulum-on-cart"]()
    scene.start["rail.speed"] = 0.7
    result = simulate(scene, t_end=1.0, rtol=1e-10, monitor=conserved(scene))
    expected = 2.0 * result["cart.velocity.x"] + result["bob.velocity.x"]
    assert result.conserved["p:rail.displacement"].values == pytest.approx(expected, rel=1e-9)
    assert result.conserved["h"].values == pytest.approx(result.energy.total, rel=1e-9)
    again = pickle.loads(pickle.dumps(result.conserved))
    assert np.array_equal(again["h"].values, result.conserved["h"].values)
    assert "conserved" in repr(result)


@pytest.mark.parametrize("orientation", ["quaternion", "euler-zxz"])
def test_momenta_of_angles_along_runs_in_other_coordinates(orientation: str) -> None:
    scene = SCENES["lagrange-top"](motion="loops")
    found = conserved(scene, orientation="euler-zxz")
    result = simulate(scene, orientation=orientation, t_end=0.3, rtol=1e-10, outputs=11, monitor=found)
    assert result.conserved["p:top.euler.psi"].values == pytest.approx(np.full(11, 0.01 * 50.0), rel=1e-9)
    assert result.conserved.max_drift < 1e-7


def test_a_loose_run_drifts_and_shows_it() -> None:
    scene = SCENES["kepler"]()
    loose, tight = (
        simulate(scene, t_end=60.0, rtol=r, solver="explicit", monitor=conserved(scene)) for r in (1e-3, 1e-9)
    )
    assert tight.conserved["L"].max_drift < 1e-7
    assert loose.conserved["L"].max_drift > 100.0 * tight.conserved["L"].max_drift


def test_another_scene_is_refused() -> None:
    with pytest.raises(UsageError, match="another scene"):
        simulate(SCENES["kepler"](), monitor=conserved(SCENES["kepler"](mass=2.0)))
    with pytest.raises(UsageError, match="monitor"):
        simulate(SCENES["kepler"](), monitor="energy")


def test_of_an_assembly_and_on_the_command_line() -> None:
    scene = Scene()
    ground, rod, bob = (
        scene.add(n, c) for n, c in (("g", Ground()), ("r", Rod(length=1.0)), ("b", PointMass(mass=1.0)))
    )
    scene.connect(ground.frame, rod.a)
    scene.connect(rod.b, bob.point)
    scene.start["r.angle"] = 0.3
    assembly = assemble(scene)
    assert simulate(assembly, t_end=1.0, monitor=conserved(assembly)).conserved.max_drift < 1e-4
    shown = CliRunner().invoke(main, ["run", "kepler", "--conserved"])
    assert shown.exit_code == 0, shown.output
    assert "L drifts by" in shown.output
