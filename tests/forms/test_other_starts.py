"""Rolling scenes from other starts: the constants are parameters, nothing is compiled, and the answers are the same."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose

import atwood_library as lib
from atwood import Scene, sweep
from atwood.codegen.python import backend as python_backend
from atwood.pipeline import assemble, simulate

from ..helpers.runs import FORMS
from ..scenes.test_integrable import on_blades, upright, wheel_on_a_slope
from .test_with_values import counting


def cart(slope: float = 0.2) -> Scene:
    """Return a cart on two wheels, which keep its angle."""
    scene = Scene(t_end=1.0)
    ground = scene.add("ground", lib.Ground(angle=-slope))
    body = scene.add("cart", lib.Box(length_x=1.0, length_z=0.2, mass=5.0))
    for name, place in (("back", -0.4), ("front", 0.4)):
        wheel = scene.add(name, lib.Wheel(radius=0.2, mass=0.5, axial=0.01, transverse=0.005))
        end = scene.add(f"{name}_end", lib.Weld(displacement=(place, 0.0, 0.0)))
        scene.connect(body.frame, end.a)
        scene.connect(end.b, wheel.axle)
        scene.connect(ground.frame, wheel.ground)
    scene.start.update({"back.contact.displacement": 0.0, "back.contact.speed": 0.3, "back.bearing.angle": 0.0})
    scene.start["front.bearing.angle"] = 0.0
    return scene


def from_zero() -> Scene:
    scene = wheel_on_a_slope()
    scene.start.update({"contact.displacement": 0.0, "wheel.angle": 0.0})
    return scene


def upright_there() -> Scene:
    scene = upright()
    scene.start["disc.position.x"] = 0.1
    return scene


CASES: dict[str, tuple[Callable[[], Scene], dict[str, float]]] = {
    "slope": (wheel_on_a_slope, {"contact.displacement": -0.7, "wheel.angle": 1.9}),
    "slope, from zero": (from_zero, {"wheel.angle": 1.9}),
    "slope, to zero": (wheel_on_a_slope, {"contact.displacement": 0.0, "wheel.angle": 0.0}),
    "disc in space": (upright_there, {"disc.position.x": 0.4, "disc.spin.y": -2.0}),
    "two blades": (lambda: on_blades(2), {"link.angle": 0.3, "link.position.x": 0.2, "link.velocity.x": 0.4}),
    "cart": (cart, {"back.contact.displacement": 0.5, "back.bearing.angle": 1.0, "front.bearing.angle": -0.4}),
}


@pytest.fixture(autouse=True)
def compiled_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compile programs at their first call, so that what is compiled later is new."""
    monkeypatch.setattr(python_backend, "WALKS", 0)
    monkeypatch.setattr("atwood.simulation.problem.problem._MANY_STATES", -1)


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("form", FORMS)
def test_another_start_compiles_nothing(name: str, form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    make, start = CASES[name]
    options = {"t_end": 0.3, "outputs": 4, "rtol": 1e-9}
    first = assemble(make(), form=form)
    simulate(first, **options).table()
    with counting(monkeypatch) as counts:
        other = first.with_values(start=start)
        found = simulate(other, **options)
        found.table()
    assert other.why_new == ""
    assert counts == dict.fromkeys(counts, 0)
    assert other.shared is first.shared
    scene = make()
    scene.start.update(start)
    fresh = simulate(scene, form=form, **options)
    assert found.statistics.steps == fresh.statistics.steps
    for path, values in fresh.table().items():
        size = max(1.0, float(np.nanmax(np.abs(values), initial=0.0)))
        assert_allclose(found.array(path), values, rtol=0.0, atol=1e-9 * size, err_msg=path)
    back = simulate(other.with_values(start={k: first.flat.start.get(k) for k in start}), **options)
    known = simulate(first, **options)
    for path, values in known.table().items():
        assert_allclose(back.array(path), values, rtol=0.0, atol=1e-12, err_msg=path)


@pytest.mark.parametrize("form", FORMS)
def test_other_values_and_another_start_at_once(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    values, start = {"contact.radius": 0.4, "wheel.radius": 0.4, "wheel.mass": 3.0}, {"wheel.angle": 1.7}
    options = {"t_end": 0.5, "outputs": 4, "rtol": 1e-10}
    first = assemble(wheel_on_a_slope(), form=form)
    simulate(first, **options)
    with counting(monkeypatch) as counts:
        made = simulate(first.with_values(values, start=start), **options)
    assert counts == dict.fromkeys(counts, 0)
    assert np.max(np.abs(0.4 * (made["wheel.angle"] - 1.7) + made["contact.displacement"] - 0.3)) < 1e-9


@pytest.mark.parametrize("solver", ["auto", "ida"])
def test_a_sweep_over_starts_assembles_once(solver: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """However many starts there are, no more is made than for the first."""
    options = {"rtol": 1e-10, "outputs": 3, "t_end": 0.5, "solver": solver, "quantities": ["wheel", "contact"]}
    made = []
    for count in (2, 7):
        places = np.linspace(-1.0, 1.0, count)
        with counting(monkeypatch) as counts:
            found = sweep(wheel_on_a_slope(), start={"contact.displacement": places}, **options)
        made.append({name: number for name, number in counts.items() if name in ("graphs", "programs")})
        turned = found["wheel.angle"] - 0.2
        assert np.max(np.abs(found["contact.displacement"] - places[:, None] + 0.5 * turned)) < 1e-9
    assert made[0] == made[1]
    assert made[0]["graphs"] <= 2


@pytest.mark.parametrize(("slope", "is_new"), [(0.2, False), (0.0, True)])
def test_a_cart_that_starts_upside_down(slope: float, is_new: bool) -> None:
    """Its angle stays where it starts; zero, which makes the equations shorter, is not what the other root is."""
    options = {"t_end": 0.2, "outputs": 3}
    turned = {"cart.angle": np.pi + slope}
    other = assemble(cart(slope)).with_values(guess=turned)
    assert bool(other.why_new) == is_new
    scene = cart(slope)
    scene.guess.update(turned)
    found, fresh = simulate(other, **options), simulate(scene, **options)
    assert_allclose(found["cart.angle"], np.pi - slope, rtol=1e-12)
    for path, values in fresh.table().items():
        assert_allclose(found.array(path), values, rtol=0.0, atol=1e-9, err_msg=path)
