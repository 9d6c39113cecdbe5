"""Inertia: a rotor on bearings that are fixed in the world."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from atwood import (
    BodyInertia,
    Component,
    Frame,
    Number,
    Outline,
    Placement,
    Scalar,
    Shaft,
    Triple,
    Vector,
    as_vector,
    atan2,
    connector,
    constraint,
    dot,
    inertia,
    joint,
    normals,
    observable,
    parameter,
    turn,
)

_STEEL = 7850.0
"""Density of steel, kg/m^3."""


class Inertia(Component):
    """A rotor on bearings that are fixed in the world, with a moment of inertia about its axis alone.

    It needs no geometry: drives are built of rotors, gears, springs and dampers on their flanges. Bodies can be mounted
    on its `rotor` all the same.
    """

    synonyms = ("Flywheel", "Rotor", "Rotational.Components.Inertia")
    spaces = ("plane", "space")

    moment: Number = parameter(1.0, unit="kg*m^2", minimum=0.0, doc="Moment of inertia about the axis.")
    position: Triple = parameter((0.0, 0.0, 0.0), unit="m", size=3, place=True, doc="Where it is in the world.")
    axis: Triple = parameter(
        (0.0, -1.0, 0.0), turning=True, doc="Axis in the world; the angle is right-handed about it."
    )
    rotor: Frame = connector(Frame, "The frame that turns.")
    flange: Shaft = connector(Shaft, "The angle, where gears and springs take hold of it.", of="angle")

    def outline(self) -> Outline:
        """Return what it looks like: a disc of steel of its moment of inertia, a fifth as thick as wide."""
        r = (5.0 * self.moment / (math.pi * _STEEL)) ** 0.2  # J = rho pi r^4 h/2 with h = 2 r/5
        profile = ((0.0, -0.2 * r), (r, -0.2 * r), (r, 0.2 * r), (0.0, 0.2 * r))
        return Outline.revolved(profile, tuple(self.axis))

    def place(self) -> Vector:
        """Return where it is; in a plane it cannot leave that."""
        place = as_vector(self.position)
        return place if self.in_space else Vector(place.x, 0.0, place.z)

    @inertia
    def moment_of_inertia(self) -> Iterable[BodyInertia]:
        """Return the inertia: a moment, and no mass."""
        n = as_vector(self.axis)  # across the axis as a disc has it, which the bearings keep from showing
        half = 0.5 * self.moment
        tensor: Any = tuple(
            tuple(half * (a * b + (1.0 if i == k else 0.0)) for k, b in enumerate(n)) for i, a in enumerate(n)
        )
        yield BodyInertia(self.rotor, 0.0, Vector(0.0, 0.0, 0.0), self.moment, tensor if self.in_space else None)

    @constraint(reaction="force", unit="N", doc="Force of the bearings on the rotor, in world axes.")
    def coincidence(self) -> Vector:
        """Return the distance of the rotor from its bearings."""
        return self.rotor.position - self.place()

    @constraint(
        reaction=("bearing_1", "bearing_2"),
        unit="N*m",
        doc="Multiplier of the bearings, about a normal of the axis.",
        spaces=("space",),
    )
    def bearing(self) -> tuple[Scalar, Scalar]:
        """Return by how much the axis of the rotor is off."""
        first, second = normals(as_vector(self.axis))
        turned = self.rotor.to_world(as_vector(self.axis))
        return dot(turned, first), dot(turned, second)

    @joint("world", "rotor", coordinates=("angle",), solves=("coincidence",))
    def turn(self, angle: Scalar) -> Placement:
        """Place the rotor."""
        return Placement(self.place(), -as_vector(self.axis).y * angle)

    @joint("world", "rotor", coordinates=("angle",), solves=("coincidence", "bearing"), spaces=("space",))
    def turn_in_space(self, angle: Scalar) -> Placement:
        """Place the rotor."""
        return Placement(self.place(), turn(as_vector(self.axis), angle))

    @observable(unit="rad", doc="Angle about the axis.", periodic=True, rate="angular_velocity")
    def angle(self) -> Scalar:
        """Return the angle."""
        if not self.in_space:
            return -as_vector(self.axis).y * self.rotor.angle
        first, second = normals(as_vector(self.axis))
        turned = self.rotor.to_world(first)
        return atan2(dot(turned, second), dot(turned, first))

    @observable(unit="rad/s", doc="Rate of the angle.")
    def angular_velocity(self) -> Scalar:
        """Return the rate of the angle."""
        return dot(self.rotor.angular_velocity, as_vector(self.axis))
