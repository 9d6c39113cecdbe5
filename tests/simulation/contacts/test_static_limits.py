"""Limits of friction of a law of one's own: what sticks is held by as much as what begins to slip."""

from __future__ import annotations

import pytest

from atwood import Component, Point, Scalar, Scene, StartError, connector, dry_friction, parameter, simulate, unilateral
from atwood_library import PointMass


class Belt(Component):
    """A moving floor whose friction grows with the speed of the slip."""

    sticks: float = parameter(0.3, minimum=0.0, doc="Coefficient of friction while it sticks.")
    slips: float = parameter(0.2, minimum=0.0, doc="Coefficient of friction while it begins to slip.")
    viscous: float = parameter(0.5, minimum=0.0, doc="What a metre a second adds.")
    speed: float = parameter(1.0, doc="Speed of the belt.")
    p: Point = connector(Point, "What slides.")

    @unilateral(reaction="normal_force", unit="N", doc="The floor.")
    def gap(self) -> Scalar:
        return self.p.position.z

    @dry_friction(
        at="gap", reaction="friction_force", unit="N", limit="most", static_limit="most_at_rest", doc="Friction."
    )
    def slip(self) -> Scalar:
        return self.p.velocity.x - self.speed

    def most(self) -> Scalar:
        return (self.slips + self.viscous * abs(self.slip())) * self.reaction("normal_force")

    def most_at_rest(self) -> Scalar:
        return self.sticks * self.reaction("normal_force")


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("height", [0.0, 0.1])
def test_a_static_limit_below_the_limit_is_refused_at_the_start(form: str, height: float) -> None:
    def scene(**given: float) -> Scene:
        made = Scene()
        mass, belt = made.add("mass", PointMass(mass=1.0)), made.add("belt", Belt(**given))
        made.connect(mass.point, belt.p)
        made.start.update({"mass.position.x": 0.0, "mass.velocity.x": 0.0})
        made.start.update({"mass.position.z": height, "mass.velocity.z": 0.0})
        return made

    # at the speed of the start, 1 m/s over the belt, friction is larger than what sticks can bear: it has to be
    assert simulate(scene(), form=form, t_end=0.01).status == "finished"
    with pytest.raises(StartError, match=r"belt\.slip: the limit of its friction while it sticks, 0\.1.* is below"):
        simulate(scene(sticks=0.1), form=form, t_end=0.01)
