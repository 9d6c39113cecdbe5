"""woodpecker: a toy bird that pecks its way down a pole."""

from __future__ import annotations

from atwood import Number, Scene, parameter
from atwood_library.contacts.vertex_contact import VertexContact
from atwood_library.forces.torsion_spring import TorsionSpring
from atwood_library.joints.pivot import Pivot
from atwood_library.joints.slider import Slider
from atwood_library.joints.weld import Weld
from atwood_library.parts.ground import Ground
from atwood_library.parts.rigid_body import RigidBody


class Woodpecker(Scene):
    """A bird on a spring is carried by a sleeve with play on a pole: the sleeve jams, slides and falls in turn.

    Sizes are those of C. Glocker (*Dynamik von Starrkoerpersystemen mit Reibung und Stoessen*, 1995, section 10.2). He
    takes angles as small; here the sleeve's corners and the beak are where they are, so that periods differ.
    """

    friction: Number = parameter(0.3, minimum=0.0, doc="Coefficient of friction of the pole.")
    restitution: Number = parameter(0.5, minimum=0.0, maximum=1.0, doc="Share of the speed that the beak keeps.")
    stiffness: Number = parameter(0.0056, unit="N*m/rad", above=0.0, doc="Stiffness of the spring.")
    pole_radius: Number = parameter(0.0025, unit="m", above=0.0, doc="Radius of the pole.")
    hole_radius: Number = parameter(0.0031, unit="m", above=0.0, doc="Radius of the hole in the sleeve.")
    half_height: Number = parameter(0.0058, unit="m", above=0.0, doc="Half the height of the sleeve.")
    sleeve_arm: Number = parameter(0.010, unit="m", doc="From the middle of the sleeve to the spring.")
    bird_arm: Number = parameter(0.015, unit="m", doc="From the spring to the centre of the bird.")
    beak_height: Number = parameter(0.02, unit="m", doc="Height of the beak over the centre of the bird.")
    beak_reach: Number = parameter(0.0201, unit="m", doc="How far the beak is before the centre of the bird.")
    t_end = 1.0

    def build(self) -> None:
        """Put the sleeve on the pole, and the bird on the sleeve."""
        ground = self.add("ground", Ground())
        pole = self.add("pole", Ground(position=(self.pole_radius, 0.0, 0.0)))
        guide = self.add("guide", Slider(axis=(0.0, 0.0, 1.0)))
        tilt = self.add("tilt", Pivot())
        sleeve = self.add("sleeve", RigidBody(mass=3e-4, moments=(5e-9, 5e-9, 5e-9)))
        arm = self.add("arm", Weld(displacement=(self.sleeve_arm, 0.0, 0.0)))
        hinge = self.add("hinge", Pivot())
        spring = self.add("spring", TorsionSpring(stiffness=self.stiffness))
        back = self.add("back", Weld(displacement=(self.bird_arm, 0.0, 0.0)))
        bird = self.add("bird", RigidBody(mass=4.5e-3, moments=(7e-7, 7e-7, 7e-7)))
        for one, other in (
            (ground.frame, guide.a),
            (guide.b, tilt.a),
            (tilt.b, sleeve.frame),
            (sleeve.frame, arm.a),
            (arm.b, hinge.a),
            (arm.b, spring.a),
            (hinge.b, spring.b),
            (hinge.b, back.a),
            (back.b, bird.frame),
        ):
            self.connect(one, other)
        touching = {
            "lower": (sleeve, (self.hole_radius, 0.0, -self.half_height), 0.0),
            "upper": (sleeve, (self.hole_radius, 0.0, self.half_height), 0.0),
            "beak": (bird, (-self.beak_reach, 0.0, self.beak_height), self.restitution),
        }
        for name, (body, place, restitution) in touching.items():
            own = VertexContact(normal=(1.0, 0.0, 0.0), place=place, restitution=restitution, friction=self.friction)
            contact = self.add(name, own)
            self.connect(pole.frame, contact.plane)
            self.connect(body.frame, contact.body)

    start = {
        "sleeve.position.z": 0.0,
        "sleeve.velocity.z": 0.0,
        "lower.gap": 0.0,
        "tilt.angular_velocity": 0.0,
        "hinge.angle": -0.35,
        "hinge.angular_velocity": -10.5,
    }
    guess = {"tilt.angle": -0.1}
