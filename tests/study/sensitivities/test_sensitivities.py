"""Derivatives of runs where nothing jumps: against formulas, and against differences of runs."""

import numpy as np
import pytest

from atwood import AtwoodError, Scene, UsageError, assemble, sensitivities, simulate
from atwood_library import Ground, PointMass, Rod
from atwood_library.scenes import (
    Chain,
    ChaplyginSleigh,
    DoublePendulum,
    DrivenPendulum,
    FourBar,
    LagrangeTop,
    RollingDisc,
    SwingingAtwood,
)


def differences(scene, form, quantity, path, value, step, is_start, t_end):
    """Return a derivative by differences of three lengths."""
    assembly = assemble(scene, form=form)

    def at(change):
        values = {path: value + change}
        other = assembly.with_values({}, start=values) if is_start else assembly.with_values(values)
        return simulate(other, t_end=t_end, outputs=[0.5 * t_end, t_end], rtol=1e-13)[quantity]

    slopes = [(at(h) - at(-h)) / (2.0 * h) for h in (step, step / 2.0, step / 4.0)]
    first, second = (4.0 * slopes[1] - slopes[0]) / 3.0, (4.0 * slopes[2] - slopes[1]) / 3.0
    return (16.0 * second - first) / 15.0


CASES = [
    (DoublePendulum, "bob2.position.x", "length1", 1.0, False),
    (DoublePendulum, "rod1.tension", "mass2", 1.0, False),
    (DoublePendulum, "rod2.angle", "rod1.angle", np.pi / 2, True),
    (FourBar, "rocker.position.x", "rocker.length", 2.0, False),
    (FourBar, "crank.angle", "crank.angular_velocity", 2.0, True),
    (SwingingAtwood, "swing.displacement", "hinge.angle", np.pi / 2, True),
    (ChaplyginSleigh, "sleigh.position.x", "speed", None, False),
    (DrivenPendulum, "rod.angle", "motion.amplitude", 0.1, False),
    (RollingDisc, "disc.position.x", "disc.spin.x", -5.196152422706632, True),
    (LagrangeTop, "top.theta", "top.mass", 1.0, False),
]


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize(("kind", "quantity", "path", "value", "is_start"), CASES)
def test_meets_differences(kind, quantity, path, value, is_start, form):
    scene = kind()
    value = scene._value(path) if value is None else value
    given = {"start" if is_start else "parameters": [path]}
    found = sensitivities(scene, [quantity], **given, t_end=1.0, outputs=[0.5, 1.0], form=form)
    near = differences(scene, form, quantity, path, value, 1e-3, is_start, 1.0)
    assert np.abs(found[quantity, path] - near) == pytest.approx(0.0, abs=1e-7 * np.max(np.abs(near)))


def falling():
    scene = Scene()
    scene.add("bob", PointMass(mass=2.0))
    scene.start.update({"bob.position.x": 0.0, "bob.position.z": 3.0, "bob.velocity.x": 1.5})
    return scene


def test_of_free_fall():
    found = sensitivities(
        falling(), ["bob.position.z", "bob.position.x"], parameters=["gravity", "bob.mass"], start=["bob.velocity.x"]
    )
    assert found["bob.position.z", "gravity"] == pytest.approx(-0.5 * found.time**2, abs=1e-11)
    assert found["bob.position.x", "bob.velocity.x"] == pytest.approx(found.time, abs=1e-11)
    assert np.all(found["bob.position.z", "bob.mass"] == 0.0)
    assert found.units["bob.position.z", "gravity"] == "s^2"
    assert found.units["bob.position.x", "bob.velocity.x"] == "s"


def test_does_not_depend_on_names_and_order():
    def scene(order):
        made = Scene()
        ground = made.add("ground", Ground())
        parts = {name: made.add(name, Rod(length=1.0) if name == "rod" else PointMass(mass=1.0)) for name in order}
        made.connect(ground.frame, parts["rod"].a)
        made.connect(parts["rod"].b, parts["bob"].point)
        made.start["rod.angle"] = 1.0
        return made

    one, other = (
        sensitivities(scene(order), ["bob.position.x"], parameters=["rod.length"])["bob.position.x", "rod.length"]
        for order in (("rod", "bob"), ("bob", "rod"))
    )
    assert one == pytest.approx(other, rel=1e-9)


def test_many_columns_at_once_are_each_by_itself():
    scene, paths = DoublePendulum(), ["mass1", "mass2", "length1", "length2"]
    together = sensitivities(scene, ["rod2.angle"], parameters=paths)
    for path in paths:
        alone = sensitivities(scene, ["rod2.angle"], parameters=[path])
        assert together["rod2.angle", path] == pytest.approx(alone["rod2.angle", path], rel=1e-7, abs=1e-8)


@pytest.mark.parametrize(
    ("scene", "given", "said"),
    [
        (Chain, {"parameters": ["links"]}, "whole number"),
        (FourBar, {"parameters": ["right.position"]}, "single numbers"),
        (DoublePendulum, {"parameters": ["mass3"]}, "no parameter"),
        (DoublePendulum, {"parameters": ["mass1", "mass1"]}, "twice"),
        (DoublePendulum, {}, "nothing"),
        (DoublePendulum, {"start": ["rod1.tension"]}, "cannot be prescribed"),
        (DoublePendulum, {"start": ["rod9.angle"]}, "no such quantity"),
    ],
)
def test_refuses_by_name(scene, given, said):
    with pytest.raises(AtwoodError, match=said):
        sensitivities(scene(), **given)


def test_zero_is_refused():
    scene = falling()
    scene.set("gravity", 0.0)
    with pytest.raises(UsageError, match="exactly zero"):
        sensitivities(scene, ["bob.position.z"], parameters=["gravity"])


def test_table():
    found = sensitivities(DoublePendulum(), ["rod1.angle"], parameters=["mass1"], t_end=0.5)
    assert "1/kg" in found.as_text()
    with pytest.raises(UsageError, match="no derivatives by it"):
        _ = found["rod1.angle", "mass2"]
