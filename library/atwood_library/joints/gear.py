"""Gear: a fixed ratio between the angles of two joints."""

from __future__ import annotations

from typing import ClassVar

from atwood import Component, Number, Scalar, Shaft, connector, constraint, observable, parameter


class Gear(Component):
    """An ideal gear between two joints that turn: hinges, screws, or any other with a shaft.

    ``angle_a = ratio * angle_b + offset``, with the angles of the two joints, turns counted. For two outer wheels on
    one carrier the ratio is minus the teeth of b over the teeth of a; for an inner wheel, or a belt, it is positive.
    It passes torques on to both frames of both joints, without loss. With ``support="flange"`` both angles are measured
    from that of a housing, which takes the torque that is left.
    """

    synonyms: ClassVar[tuple[str, ...]] = (
        "IdealGear",
        "Gear pair",
        "Transmission",
        "GearConstraint",
        "Gearbox",
        "BevelGear1D",
    )

    ratio: Number = parameter(-1.0, doc="Turns of joint a for one turn of joint b; negative for outer wheels.")
    offset: Number = parameter(0.0, unit="rad", doc="Angle of joint a where that of joint b is zero.")
    support: str = parameter("ground", choices=("flange", "ground"), doc="What the housing is fixed to.")
    a: Shaft = connector(Shaft, "The angle of one joint.")
    b: Shaft = connector(Shaft, "The angle of the other joint.")
    housing: Shaft = connector(Shaft, "The angle of the housing.", when={"support": ("flange",)})

    @constraint(reaction="torque_a", unit="N*m", doc="Torque of the gear on frame b of joint a, about its axis.")
    def mesh(self) -> Scalar:
        """Return by how much the angles are out of their ratio."""
        turned = self.a.value - self.ratio * self.b.value - self.offset
        return turned if self.support == "ground" else turned - (1.0 - self.ratio) * self.housing.value

    @observable(unit="N*m", doc="Torque of the gear on frame b of joint b, about its axis.")
    def torque_b(self) -> Scalar:
        """Return the torque, which does the opposite work."""
        return -(self.ratio * self.reaction("torque_a"))

    @observable(unit="N*m", doc="Torque of the gear on its housing.")
    def housing_torque(self) -> Scalar:
        """Return the torque that is left: the three add up to zero."""
        return (self.ratio - 1.0) * self.reaction("torque_a")
