"""What is proven for the values of the parameters alone says so."""

from __future__ import annotations

from typing import Any

from atwood import Number, Scene, connect, conserved, parameter, separation
from atwood_library import PointMass, Potential
from atwood_library.scenes import Kepler

POLAR = {"body.position.x": "r*cos(phi)", "body.position.z": "r*sin(phi)"}


def _energy(x: Any, z: Any, *, first: Any, second: Any) -> Any:
    return 0.5 * first * x**2 + 0.5 * second * z**2


class Trap(Scene):
    """A body on two springs at right angles: where they are equal it turns as it likes."""

    first: Number = parameter(2.0, unit="N/m", above=0.0, doc="Stiffness along x.")
    second: Number = parameter(2.0, unit="N/m", above=0.0, doc="Stiffness along z.")
    gravity = 0.0
    field: Potential = Potential()
    body: PointMass = PointMass(mass=1.0)
    connections = [connect(field.point, body.point)]

    def build(self) -> None:
        self.set("field.energy_function", _energy)


def test_an_angular_momentum_that_equal_springs_keep() -> None:
    said = {one.name: one.evidence for one in conserved(Trap())}
    assert said["h"] == "proven on the graph"
    assert said["L"] == "proven on the graph, for these values of the parameters"
    assert "L" not in {one.name for one in conserved(Trap(second=3.0))}
    assert all(one.evidence == "proven on the graph" for one in conserved(Kepler()))


def test_a_separation_in_polar_coordinates_with_equal_springs() -> None:
    found = separation(Trap(), POLAR)
    assert found.separates
    assert not found.is_general
    assert "for these values of the parameters" in found.sentence
    assert separation(Trap()).is_general
    assert "for these values" not in separation(Kepler(), POLAR).sentence
