"""Rotor: what turns in a bearing on a body that may move, with a moment of inertia about its axis alone."""

from __future__ import annotations

from atwood import Number, Scalar, as_vector, dot, lagrangian, parameter
from atwood_library.joints.pivot import Pivot


class Rotor(Pivot):
    """A rotor in a bearing on a body that may move and turn, with a moment of inertia about its axis alone.

    Its energy is ``J (w . n + angle')^2/2`` with the angular velocity w of the body and the axis n, so that a body with
    spinning rotors feels their gyroscopic torque. Mass and moments across the axis belong to the body that carries it.
    Frame a is on the body; gears and springs take hold of the shaft, and frame b turns.
    """

    synonyms = (
        "MultiBody.Parts.Rotor1D",
        "Mounting1D",
        "Reaction wheel",
        "Momentum wheel",
        "Gyrostat",
        "Motor's rotor",
    )
    spaces = ("plane", "space")

    moment: Number = parameter(1.0, unit="kg*m^2", above=0.0, doc="Moment of inertia about the axis.")

    @lagrangian
    def energy(self) -> Scalar:
        """Return the kinetic energy."""
        rate = dot(self.b.angular_velocity, self.b.to_world(as_vector(self.axis)))
        return 0.5 * self.moment * rate * rate
