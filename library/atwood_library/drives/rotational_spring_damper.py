"""RotationalSpringDamper: a spring and a damper side by side between two angles."""

from __future__ import annotations

from atwood import Component, Number, Scalar, Shaft, connector, dissipation, observable, parameter, potential
from atwood_library.interfaces.along_coordinates import between


class RotationalSpringDamper(Component):
    """A linear spring and a damper side by side, between two angles or from one to the ground; either may be absent."""

    synonyms = (
        *("Kelvin-Voigt element", "Rotational.Components.SpringDamper"),
        *("Rotational.Components.Spring", "Rotational.Components.Damper"),
    )
    spaces = ("plane", "space")

    stiffness: Number = parameter(0.0, unit="N*m/rad", minimum=0.0, doc="Torque for a unit of extension.")
    damping: Number = parameter(0.0, unit="N*m*s/rad", minimum=0.0, doc="Torque for a unit of its rate.")
    natural: Number = parameter(0.0, unit="rad", doc="Extension at which the spring has no torque.", symbol="theta_0")
    against: str = parameter("flange", choices=("flange", "ground"), doc="What it acts against.")
    a: Shaft = connector(Shaft, "The angle that it acts against.", when={"against": ("flange",)})
    b: Shaft = connector(Shaft, "The angle that it acts on.")

    @potential
    def elastic_energy(self) -> Scalar:
        """Return the energy of the spring."""
        return 0.5 * self.stiffness * (between(self)[0] - self.natural) ** 2

    @dissipation
    def damper_function(self) -> Scalar:
        """Return half the power of the damper."""
        return 0.5 * self.damping * between(self)[1] ** 2

    @observable(unit="rad", doc="By how much b is ahead of a.")
    def extension(self) -> Scalar:
        """Return the extension."""
        return between(self)[0]

    @observable(unit="N*m", doc="Torque that pulls b back.")
    def torque(self) -> Scalar:
        """Return the torque of both."""
        extension, rate = between(self)
        return self.stiffness * (extension - self.natural) + self.damping * rate
