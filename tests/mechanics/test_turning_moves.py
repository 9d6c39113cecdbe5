"""In a plane, a joint coordinate that both moves and turns frame b, in whichever sense and proportion."""

import pytest

import atwood as aw
from atwood_library import Ground, RigidBody


class Rack(aw.Component):
    """A wheel that rolls along x: it turns clockwise by the way over the radius."""

    spaces = ("plane",)
    radius: float = aw.parameter(0.4, unit="m", above=0.0, doc="Radius.")
    offset: float = aw.parameter(0.0, unit="rad", doc="Angle of b where the way is zero.")
    a: aw.Frame = aw.connector(aw.Frame, "The rack.")
    b: aw.Frame = aw.connector(aw.Frame, "The wheel.")

    @aw.constraint(reaction="normal", unit="N", doc="Force on b along z of a.")
    def height(self):
        return self.a.to_frame(self.b.position - self.a.position).z - self.radius

    @aw.constraint(reaction="friction", unit="N", doc="Force on b along x of a.")
    def grip(self):
        return self.way() + self.radius * (self.b.angle - self.a.angle - self.offset)

    @aw.joint("a", "b", coordinates=("way",), solves=("height", "grip"))
    def roll(self, way):
        return aw.Placement(aw.Vector(way, 0.0, self.radius), self.offset - way / self.radius, axes="a")

    @aw.observable(unit="m", doc="Way along the rack.")
    def way(self):
        return self.a.to_frame(self.b.position - self.a.position).x


@pytest.mark.parametrize("offset", [0.0, 0.3])
def test_both_forms_roll_down_a_slope(offset):
    slope, mass, moment = 0.2, 2.0, 0.25
    made = {}
    for form in ("reduced", "dae"):
        scene = aw.Scene()
        ground = scene.add("ground", Ground(angle=-slope))
        rack = scene.add("rack", Rack(offset=offset))
        wheel = scene.add("wheel", RigidBody(mass=mass, moments=(moment, moment, moment)))
        scene.connect(ground.frame, rack.a)
        scene.connect(rack.b, wheel.frame)
        scene.start["rack.way"] = 0.5
        made[form] = aw.simulate(scene, form=form, t_end=1.0, outputs=11)
    result = made["reduced"]
    assert len(result.assembly.regular.coordinates) == 1
    down = 9.81 * aw.sin(slope) / (1.0 + moment / (mass * 0.4**2))
    for one in made.values():
        assert one["rack.way"] == pytest.approx(0.5 + 0.5 * down * one.time**2, rel=1e-7)
        turned = one["wheel.angle"]
        assert turned == pytest.approx(offset - slope - one["rack.way"] / 0.4, rel=1e-7)
    assert result["rack.friction"] == pytest.approx(made["dae"]["rack.friction"], rel=1e-6)
