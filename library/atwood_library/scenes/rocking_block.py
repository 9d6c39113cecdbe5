"""rocking-block: a slender block that rocks from corner to corner."""

from __future__ import annotations

from atwood import Number, Scene, connect, parameter
from atwood_library.contacts.box_contact import BoxContact
from atwood_library.parts.box import Box
from atwood_library.parts.ground import Ground


class RockingBlock(Scene):
    """A slender block, tilted on one of its corners, rocks on a floor that does not let it slip.

    Each impact leaves ``1 - 3/2 sin(alpha)^2`` of its rate, where the diagonal is tilted by alpha, and it comes to rest
    (G. Housner, Bulletin of the Seismological Society of America 53, 1963).
    """

    width: Number = parameter(0.5, unit="m", above=0.0, doc="Width of the block.")
    height: Number = parameter(2.0, unit="m", above=0.0, doc="Height of the block.")
    mass: Number = parameter(1.0, unit="kg", above=0.0, doc="Mass of the block.")
    friction: Number = parameter(10.0, minimum=0.0, doc="Coefficient of friction; so much that no corner slips.")
    tilt: Number = parameter(0.15, unit="rad", doc="Angle at the start.")
    t_end = 9.0

    ground: Ground = Ground()
    block: Box = Box(mass=mass, length_x=width, length_z=height)
    floor: BoxContact = BoxContact(length=width, height=height, friction=friction)
    connections = [connect(ground.frame, floor.plane), connect(block.frame, floor.box)]
    start = {
        "block.angle": tilt,
        "block.angular_velocity.y": 0.0,
        "floor.corner[0].gap": 0.0,
        "floor.corner[0].slip": 0.0,
    }
