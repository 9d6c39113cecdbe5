"""Bushing: springs and dampers along and about three axes between two frames."""

from __future__ import annotations

from atwood import (
    Component,
    Frame,
    Scalar,
    Triple,
    Vector,
    as_vector,
    connector,
    dissipation,
    dot,
    event,
    is_zero,
    observable,
    parameter,
    potential,
)
from atwood_library.interfaces.bearings import velocity_seen
from atwood_library.interfaces.rotation_vector import half_turn_margin, rotation_vector

_ZERO = (0.0, 0.0, 0.0)


class Bushing(Component):
    """An elastic mount: three springs and dampers along the axes of frame a and three about them.

    With the displacement d of frame b in the axes of frame a and the rotation vector psi of frame b from frame a
    (its direction is the axis of the rotation, its size the angle), the potential energy is
    ``1/2 sum k_i (d_i - d0_i)^2 + 1/2 sum c_i (psi_i - psi0_i)^2``, and forces and torques are its derivatives on both
    frames; so without damping energy is kept, however far it is turned. For a turn about one of the axes the torque
    is linear in the angle (rotation vector: Shuster, A survey of attitude representations, J. Astronaut. Sci. 41,
    1993). The dampers act on the velocity of frame b as seen from frame a and on the relative
    angular velocity, along the axes of frame a.

    It is regular for turns of less than half a turn; where they come near that in space, the run stops. In a plane two
    displacements and one rotation are left, about y, which counts turns; on a line one displacement.
    """

    synonyms = ("Rubber mount",)

    stiffness: Triple = parameter(
        (1.0, 1.0, 1.0), unit="N/m", size=3, minimum=0.0, doc="Stiffness along the axes of frame a."
    )
    damping: Triple = parameter(_ZERO, unit="N*s/m", size=3, minimum=0.0, doc="Damping along the axes of frame a.")
    free_displacement: Triple = parameter(
        _ZERO,
        unit="m",
        size=3,
        doc="Displacement of frame b without force, in the axes of frame a.",
        symbol="d_0",
    )
    turning_stiffness: Triple = parameter(
        (1.0, 1.0, 1.0),
        unit="N*m/rad",
        size=3,
        minimum=0.0,
        doc="Stiffness about the axes of frame a.",
        symbol="kappa",
    )
    turning_damping: Triple = parameter(
        _ZERO,
        unit="N*m*s/rad",
        size=3,
        minimum=0.0,
        doc="Damping about the axes of frame a.",
        symbol="c_phi",
    )
    free_rotation: Triple = parameter(
        _ZERO,
        unit="rad",
        size=3,
        doc="Rotation vector of frame b without torque; about y, clockwise in a plane.",
        symbol="phi_0",
    )
    a: Frame = connector(Frame, "The frame that displacement and rotation are measured from.")
    b: Frame = connector(Frame, "The other frame.")

    @potential
    def elastic_energy(self) -> Scalar:
        """Return the elastic energy."""
        stretch = self.displaced() - as_vector(self.free_displacement)
        turned = self.turned() - as_vector(self.free_rotation)
        energy = _half_square(as_vector(self.stiffness), self._kept(stretch))
        return energy + _half_square(as_vector(self.turning_stiffness), self._kept_turns(turned))

    @dissipation
    def rayleigh_function(self) -> Scalar:
        """Return half the dissipated power."""
        seen = velocity_seen(self.a, self.b)
        spin = self.a.to_frame(self.b.angular_velocity - self.a.angular_velocity)
        power = _half_square(as_vector(self.damping), self._kept(self.a.to_frame(seen)))
        return power + _half_square(as_vector(self.turning_damping), self._kept_turns(spin))

    def displaced(self) -> Vector:
        """Return the displacement in the axes of frame a."""
        return self.a.to_frame(self.b.position - self.a.position)

    def turned(self) -> Vector:
        """Return the rotation vector."""
        if self.in_space:
            return rotation_vector(self.a, self.b)
        return Vector(0.0, self.a.angle - self.b.angle, 0.0)

    def _kept(self, along: Vector) -> Vector:
        """Return what a vector has in the directions of the scene's space."""
        if self.on_a_line:
            kept: Vector = self.line * dot(along, self.line)
            return kept
        return along if self.in_space else Vector(along.x, 0.0, along.z)

    def _kept_turns(self, turns: Vector) -> Vector:
        """Return the turns that there are in the scene's space."""
        if self.on_a_line:
            return Vector(0.0, 0.0, 0.0)
        return turns if self.in_space else Vector(0.0, turns.y, 0.0)

    @event(direction=-1, target="stop", message="the bushing is turned by half a turn", spaces=("space",))
    def comes_to_half_a_turn(self) -> Scalar:
        """Return how far the rotation is from half a turn; nothing that matters where nothing resists turning."""
        if all(is_zero(c) for c in as_vector(self.turning_stiffness)):
            return 1.0
        return half_turn_margin(self.a, self.b)

    @observable(unit="m", doc="Displacement of frame b from frame a, in the axes of frame a.")
    def displacement(self) -> Vector:
        """Return the displacement."""
        return self.displaced()

    @observable(unit="rad", doc="Rotation vector of frame b from frame a.", spaces=("space",))
    def rotation(self) -> Vector:
        """Return the rotation vector."""
        return self.turned()

    @observable(unit="rad", doc="Angle of frame b from frame a, counter-clockwise.", spaces=("plane",))
    def angle(self) -> Scalar:
        """Return the angle."""
        return self.b.angle - self.a.angle


def _half_square(factors: Vector, values: Vector) -> Scalar:
    """Return half the sum of squares times factors."""
    return 0.5 * (factors.x * values.x * values.x + factors.y * values.y * values.y + factors.z * values.z * values.z)
