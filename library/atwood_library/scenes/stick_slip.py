"""stick-slip: a mass on a belt, held by a spring, that sticks and slips in turn."""

from __future__ import annotations

from atwood import Number, Scene, connect, parameter
from atwood_library.contacts.point_contact import PointContact
from atwood_library.forces.spring import Spring
from atwood_library.parts.ground import Ground
from atwood_library.parts.point_mass import PointMass


class StickSlip(Scene):
    """A belt takes a mass along until the spring that holds it is stronger than static friction; it slips back.

    The motion repeats: it is how a violin's string, a creaking door and a chattering tool move.
    """

    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass.")
    stiffness: Number = parameter(100.0, unit="N/m", above=0.0, doc="Stiffness of the spring.")
    belt_speed: Number = parameter(0.2, unit="m/s", doc="Speed of the belt.")
    friction: Number = parameter(0.4, minimum=0.0, doc="Coefficient of friction while it slips.")
    static_friction: Number = parameter(0.6, minimum=0.0, doc="The same while it sticks.")
    t_end = 3.0

    ground: Ground = Ground()
    wall: Ground = Ground(position=(-5.0, 0.0, 0.0))
    body: PointMass = PointMass(mass=mass)
    belt: PointContact = PointContact(friction=friction, static_friction=static_friction, surface_velocity=belt_speed)
    spring: Spring = Spring(stiffness=stiffness, natural_length=5.0)
    connections = [
        connect(ground.frame, belt.plane),
        connect(body.point, belt.point),
        connect(wall.frame, spring.a),
        connect(body.point, spring.b),
    ]
    start = {"body.position.x": 0.0, "body.velocity.x": belt_speed, "belt.gap": 0.0, "body.velocity.z": 0.0}
