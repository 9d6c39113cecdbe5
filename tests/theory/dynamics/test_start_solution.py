"""Parameters and start values that follow from how a scene starts."""

from math import cos

import numpy as np
import pytest

import atwood_library as lib
from atwood import Scene, SolveError, UsageError, assemble, simulate, solve_initial_values
from atwood_library.scenes import FourBar


def held_link(space: str = "plane") -> Scene:
    """Return a link on a hinge with a spring, at an angle."""
    scene = Scene(space=space)
    ground, pivot, link = scene.add("ground", lib.Ground()), scene.add("pivot", lib.Pivot(stiffness=1.0)), lib.Link()
    link.length, link.mass = 1.2, 3.0
    scene.add("link", link)
    scene.connect(ground.frame, pivot.a)
    scene.connect(pivot.b, link.a)
    scene.start["pivot.angle"], scene.start["pivot.angular_velocity"] = -0.4, 0.0
    return scene


@pytest.mark.parametrize("space", ["plane", "space"])
def test_a_spring_that_holds_a_link_at_rest(space: str) -> None:
    found = solve_initial_values(held_link(space), unknowns=["pivot.stiffness"], conditions={"pivot.angle''": 0.0})
    assert found.values["pivot.stiffness"] == pytest.approx(3.0 * 9.81 * 0.6 * cos(0.4) / 0.4, rel=1e-10)
    assert np.ptp(simulate(found.assembly, t_end=1.0)["pivot.angle"]) < 1e-9


def test_a_parameter_and_a_start_value_at_once() -> None:
    conditions = {"pivot.angular_velocity'": 2.0, "link.velocity.x": "0.3 m/s"}
    unknowns = ["pivot.natural_angle", "pivot.angular_velocity"]
    values = solve_initial_values(held_link(), unknowns=unknowns, conditions=conditions).values
    rate = 0.3 / (0.6 * np.sin(0.4))
    assert values["pivot.angular_velocity"] == pytest.approx(rate, rel=1e-10)
    # J angle'' = -k (angle - natural) - m g l/2 cos(angle)
    natural = -0.4 + (1.2**2 * 2.0 + 3.0 * 9.81 * 0.6 * cos(0.4)) / 1.0
    assert values["pivot.natural_angle"] == pytest.approx(natural, rel=1e-9)


def test_a_loop_starts_with_an_acceleration() -> None:
    scene = FourBar()
    found = solve_initial_values(assemble(scene), unknowns=["gravity"], conditions={"crank.angle''": -3.0})
    again = solve_initial_values(found.assembly, unknowns=["gravity"], conditions={"crank.angle''": -3.0})
    assert again.values["gravity"] == pytest.approx(found.values["gravity"], rel=1e-9)
    early = simulate(found.assembly, t_end=0.01, rtol=1e-10, outputs=3)
    rates = early["crank.angular_velocity"]
    assert (-3.0 * rates[0] + 4.0 * rates[1] - rates[2]) / 0.01 == pytest.approx(-3.0, rel=1e-3)


def test_what_cannot_be_is_refused() -> None:
    scene = held_link()
    with pytest.raises(UsageError, match="1 unknowns have 2 conditions"):
        solve_initial_values(scene, unknowns=["gravity"], conditions={"pivot.angle''": 0.0, "link.velocity.x": 1.0})
    with pytest.raises(UsageError, match="no such quantity"):
        solve_initial_values(scene, unknowns=["gravity"], conditions={"pivot.angel": 0.0})
    with pytest.raises(UsageError, match="no parameter with a number"):
        solve_initial_values(scene, unknowns=["pivot.axis"], conditions={"pivot.angle''": 0.0})
    with pytest.raises(SolveError, match="no values near by"):  # a length cannot make it fall upwards
        solve_initial_values(scene, unknowns=["link.length"], conditions={"pivot.angle''": 50.0})
