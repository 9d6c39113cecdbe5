"""Forces and observables that read the size of a reaction, also where it is zero."""

from collections.abc import Iterable

import pytest

from atwood import Load, Scalar, Scene, Vector, force, norm, observable, parameter, simulate
from atwood_library import Ground, Pivot, RigidBody

WAYS = [("reduced", "explicit"), ("reduced", "ida"), ("reduced", "taylor"), ("dae", "ida"), ("dae", "explicit")]


class Bearing(Pivot):
    """A hinge with friction in proportion to the size of its force, and to its speed."""

    friction: float = parameter(0.05, unit="m*s", doc="Torque for each newton and rad/s.")

    def pressed(self) -> Vector:
        """Return the force, of which no component acts across a plane."""
        return Vector(*(self.reaction(f"force.{axis}") for axis in "xyz"))

    @observable(unit="N", doc="Size of the force.")
    def load(self) -> Scalar:
        """Return the load."""
        return norm(self.pressed())

    @force
    def rub(self) -> Iterable[Load]:
        """Return the friction."""
        torque = (self.b.angular_velocity - self.a.angular_velocity) * (-self.friction * self.load())
        return [Load(self.b, Vector(0.0, 0.0, 0.0), torque), Load(self.a, Vector(0.0, 0.0, 0.0), -torque)]


@pytest.mark.parametrize(("form", "solver"), WAYS)
@pytest.mark.parametrize("space", ["plane", "space"])
@pytest.mark.parametrize(("gravity", "left"), [(0.0, 1.0), (9.81, 0.0860781236)])
def test_a_bearing_with_or_without_load(space: str, form: str, solver: str, gravity: float, left: float) -> None:
    """In the dae form Newton's method failed where the force was zero; in the plane the load could not be seen."""
    scene = Scene(space=space, gravity=gravity)
    ground, bearing = scene.add("ground", Ground()), scene.add("bearing", Bearing())
    body = scene.add("body", RigidBody(mass=1.0, moments=(0.1, 0.1, 0.1)))
    scene.connect(ground.frame, bearing.a)
    scene.connect(bearing.b, body.frame)
    scene.start["bearing.angular_velocity"] = 1.0
    result = simulate(scene, form=form, solver=solver, t_end=0.5, rtol=1e-9)
    # J w' = -c m g w
    assert result["bearing.angular_velocity"][-1] == pytest.approx(left, abs=1e-6)
    assert result.array("bearing.load") == pytest.approx(gravity, abs=1e-9)
