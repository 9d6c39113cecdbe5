"""Touching: what contacts with dry friction between two bodies have in common."""

from __future__ import annotations

from typing import ClassVar

from atwood import (
    Component,
    Number,
    Scalar,
    Vector,
    dot,
    dry_friction,
    observable,
    parameter,
    unilateral,
)
from atwood_library.interfaces.bounds import check_static_friction

__all__ = ["Touching", "across"]

_FIRST, _SECOND, _FROM = Vector(0.8, 0.0, -0.6), Vector(-0.36, 0.8, -0.48), Vector(0.48, 0.6, 0.64)
"""A right-handed triad along which no scene lies: directions across a normal have no limit opposite to its last."""


def across(normal: Vector) -> tuple[Vector, Vector]:
    """Return two directions across a unit normal in space: those of a triad that is turned there the shortest way.

    Parameters
    ----------
    normal
        In any axes; the directions are in the same.
    """
    both = (_FROM + normal) / (1.0 + dot(_FROM, normal))
    first, second = (one - both * dot(one, normal) for one in (_FIRST, _SECOND))
    return first, second


class Touching(Component):
    """A contact of two bodies in one point: nothing passes the other, and dry friction acts where they touch.

    Subclasses say how far the bodies are apart, along which normal, and how fast their material moves past each other
    (F. Pfeiffer and C. Glocker, *Multibody Dynamics with Unilateral Contacts*, 1996, chapter 5).
    """

    spaces: ClassVar[tuple[str, ...]] = ("plane", "space")
    synonyms: ClassVar[tuple[str, ...]] = ()

    restitution: Number = parameter(
        0.0, minimum=0.0, maximum=1.0, doc="Share of the speed of approach with which it opens after an impact."
    )
    impact_law: str = parameter(
        "newton", choices=("newton", "poisson"), doc="Whether restitution is a share of the speed, or of the impulse."
    )
    friction: Number = parameter(0.0, minimum=0.0, doc="Coefficient of friction while it slips.")
    static_friction: Number = parameter(
        None, minimum=0.0, doc="Coefficient of friction while it sticks; that of slipping if not given."
    )
    stiffness: Number = parameter(
        None,
        unit="N/m",
        above=0.0,
        doc="How more places than are needed share a load: as springs of such stiffnesses. Nothing gives way.",
    )

    def check_values(self) -> None:
        """Refuse static friction below that of slipping."""
        check_static_friction(self.static_friction, self.friction, self.path)

    def normal_in_world(self) -> Vector:
        """Return the unit normal, towards what the force acts on, in world axes."""
        raise NotImplementedError

    def apart(self) -> Scalar:
        """Return the distance of the two bodies, negative inside, m."""
        raise NotImplementedError

    def material_slip(self) -> Vector:
        """Return how fast the material of one body moves past that of the other, in world axes, m/s."""
        raise NotImplementedError

    def directions_in_world(self) -> tuple[Vector, Vector]:
        """Return two directions across the normal, in world axes; in a plane the first is to its right."""
        raise NotImplementedError

    @unilateral(
        reaction="normal_force",
        unit="N",
        restitution="restitution",
        impact_law="impact_law",
        stiffness="stiffness",
        doc="Force along the normal; it only pushes.",
    )
    def gap(self) -> Scalar:
        """Distance of the two bodies."""
        return self.apart()

    @dry_friction(
        reaction="friction_force",
        unit="N",
        limit="largest_friction",
        static_limit="largest_static_friction",
        at="gap",
        doc="Force of friction along the slip, to the right of the normal.",
        spaces=("plane",),
    )
    def slip(self) -> Scalar:
        """Speed of the material past the other body's, to the right of the normal."""
        return dot(self.material_slip(), self.directions_in_world()[0])

    @dry_friction(
        reaction=("friction_1", "friction_2"),
        unit="N",
        limit="largest_friction",
        static_limit="largest_static_friction",
        at="gap",
        doc="Force of friction along a direction of the slip.",
        spaces=("space",),
    )
    def slip_in_space(self) -> tuple[Scalar, Scalar]:
        """Speed of the material past the other body's, along a direction across the normal."""
        slip = self.material_slip()
        first, second = self.directions_in_world()
        return dot(slip, first), dot(slip, second)

    def largest_friction(self) -> Scalar:
        """Return the largest friction while it slips, N."""
        return self.friction * self.reaction("normal_force")

    def largest_static_friction(self) -> Scalar:
        """Return the largest friction while it sticks, N."""
        share = self.friction if self.static_friction is None else self.static_friction
        return share * self.reaction("normal_force")

    @observable(unit="N", doc="Force of the contact in world axes.", spaces=("plane", "space"))
    def force(self) -> Vector:
        """Return the force: the normal force and friction."""
        first, second = self.directions_in_world()
        total: Vector = self.normal_in_world() * self.reaction("normal_force")
        if not self.in_space:
            total = total + first * self.reaction("friction_force")
        else:
            total = total + first * self.reaction("friction_1") + second * self.reaction("friction_2")
        return total
