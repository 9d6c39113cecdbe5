"""Signals that pass through parts without connectors, and circles of them."""

import pytest

from atwood import Component, DeclarationError, Scalar, Scene, observable, parameter, signal, simulate
from atwood_library import Force, Ground, PointMass, PositionSensor, Sine, Slider, Spring


class Gain(Component):
    """Multiplies a signal."""

    gain: float = parameter(1.0, unit="any", doc="Factor.")
    u: float = signal(0.0, unit="any", doc="What goes in.")

    @observable(unit="any", doc="What comes out.")
    def value(self) -> Scalar:
        """Return the product."""
        return self.gain * self.u


def cart(*extra: tuple[str, Component]) -> Scene:
    scene = Scene()
    ground, rail, body = scene.add("ground", Ground()), scene.add("rail", Slider()), scene.add("cart", PointMass())
    for name, part in extra:
        scene.add(name, part)
    scene.connect(ground.frame, rail.a)
    scene.connect(rail.b, body.point)
    scene.start["rail.displacement"] = 0.7
    return scene


def test_a_gain_between_sensor_and_force_makes_a_spring() -> None:
    fed = cart(("sensor", PositionSensor()), ("gain", Gain(gain=-9.0)), ("motor", Force()))
    fed.connect(fed["cart"].point, fed["sensor"].point)
    fed.connect(fed["cart"].point, fed["motor"].point)
    fed.connect(fed["sensor"].output("position.x"), fed["gain"].input("u"))
    fed.connect(fed["gain"].output("value"), fed["motor"].input("value"))
    sprung = cart(("spring", Spring(stiffness=9.0)))
    sprung.connect(sprung["ground"].frame, sprung["spring"].a)
    sprung.connect(sprung["cart"].point, sprung["spring"].b)
    one, other = (simulate(scene, t_end=2.0, rtol=1e-10) for scene in (fed, sprung))
    assert one["cart.position.x"] == pytest.approx(other["cart.position.x"], abs=1e-7)


def test_a_gain_behind_a_source_is_a_function_of_time() -> None:
    scene = cart(("sine", Sine(angular_frequency=2.0)), ("gain", Gain(gain=3.0)), ("motor", Force()))
    scene.connect(scene["cart"].point, scene["motor"].point)
    scene.connect(scene["sine"].output("value"), scene["gain"].input("u"))
    scene.connect(scene["gain"].output("value"), scene["motor"].input("value"))
    result = simulate(scene, t_end=1.0, rtol=1e-10)
    t = result.time
    import numpy as np

    assert result["cart.position.x"] == pytest.approx(0.7 + 1.5 * t - 0.75 * np.sin(2.0 * t), abs=1e-7)


def test_a_circle_of_signals_is_refused() -> None:
    scene = cart(("a", Gain()), ("b", Gain()), ("motor", Force()))
    scene.connect(scene["cart"].point, scene["motor"].point)
    scene.connect(scene["a"].output("value"), scene["b"].input("u"))
    scene.connect(scene["b"].output("value"), scene["a"].input("u"))
    scene.connect(scene["a"].output("value"), scene["motor"].input("value"))
    with pytest.raises(DeclarationError, match="algebraic loop"):
        simulate(scene, t_end=1.0)


def test_a_spring_without_natural_length_may_start_at_length_zero() -> None:
    scene = cart(("spring", Spring(stiffness=9.0)))
    scene.connect(scene["ground"].frame, scene["spring"].a)
    scene.connect(scene["cart"].point, scene["spring"].b)
    scene.start["rail.displacement"] = 0.0
    scene.start["rail.speed"] = 3.0
    result = simulate(scene, t_end=1.0, rtol=1e-10)
    import numpy as np

    assert result["cart.position.x"] == pytest.approx(np.sin(3.0 * result.time), abs=1e-7)
