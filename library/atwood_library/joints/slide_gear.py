"""SlideGear: a fixed ratio between the displacements of two joints."""

from __future__ import annotations

from atwood import Component, Number, Scalar, Slide, connector, constraint, observable, parameter


class SlideGear(Component):
    """An ideal transmission between two joints that slide: a pair of pistons on one pipe, a tackle, a pantograph.

    ``displacement_a = ratio * displacement_b + offset``.
    """

    synonyms = ("Hydraulic transmission",)

    ratio: Number = parameter(-1.0, doc="Displacement of joint a for one metre of joint b.")
    offset: Number = parameter(0.0, unit="m", doc="Displacement of joint a where that of joint b is zero.")
    a: Slide = connector(Slide, "The displacement of one joint.")
    b: Slide = connector(Slide, "The displacement of the other joint.")

    @constraint(reaction="force_a", unit="N", doc="Force of the gear on frame b of joint a, along its axis.")
    def mesh(self) -> Scalar:
        """Return by how much the displacements are out of their ratio."""
        return self.a.value - self.ratio * self.b.value - self.offset

    @observable(unit="N", doc="Force of the gear on frame b of joint b, along its axis.")
    def force_b(self) -> Scalar:
        """Return the force, which does the opposite work."""
        return -(self.ratio * self.reaction("force_a"))
