"""Where a solver cannot go on without a law that has no value, the error says what changes fastest."""

import pytest

from atwood import Component, Point, Scene, SolveError, Vector, connector, dot, potential, simulate
from atwood_library import PointMass


class Fall(Component):
    """A centre that draws with ever more force: the potential has no lower end."""

    point: Point = connector(Point, "What is drawn.")

    @potential
    def energy(self):
        r = self.point.position - Vector(0.0, 0.0, 0.0)
        return -1.0 / dot(r, r) ** 2


@pytest.mark.parametrize("solver", ["ida", "explicit"])
def test_what_changes_fastest_is_named(solver: str) -> None:
    scene = Scene(gravity=0.0, t_end=10.0)
    scene.connect(scene.add("comet", PointMass()).point, scene.add("sun", Fall()).point)
    scene.start.update({"comet.position.x": 1.0, "comet.position.z": 0.0})
    with pytest.raises(SolveError, match=r"at t = .*comet\.position\.x|comet\.position\.x.*at t = ") as caught:
        simulate(scene, solver=solver, max_seconds=20.0)
    assert caught.value.advice
