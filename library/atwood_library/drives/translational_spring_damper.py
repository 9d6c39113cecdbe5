"""TranslationalSpringDamper: a spring and a damper side by side between two displacements."""

from __future__ import annotations

from atwood import Component, Number, Scalar, Slide, connector, dissipation, observable, parameter, potential
from atwood_library.interfaces.along_coordinates import between


class TranslationalSpringDamper(Component):
    """A linear spring and a damper side by side, between two displacements or from one to the ground."""

    synonyms = (
        *("Kelvin-Voigt element", "Translational.Components.SpringDamper"),
        *("Translational.Components.Spring", "Translational.Components.Damper"),
    )

    stiffness: Number = parameter(0.0, unit="N/m", minimum=0.0, doc="Force for a unit of extension.")
    damping: Number = parameter(0.0, unit="N*s/m", minimum=0.0, doc="Force for a unit of its rate.")
    natural: Number = parameter(0.0, unit="m", doc="Extension at which the spring has no force.", symbol="l_0")
    against: str = parameter("flange", choices=("flange", "ground"), doc="What it acts against.")
    a: Slide = connector(Slide, "The displacement that it acts against.", when={"against": ("flange",)})
    b: Slide = connector(Slide, "The displacement that it acts on.")

    @potential
    def elastic_energy(self) -> Scalar:
        """Return the energy of the spring."""
        return 0.5 * self.stiffness * (between(self)[0] - self.natural) ** 2

    @dissipation
    def damper_function(self) -> Scalar:
        """Return half the power of the damper."""
        return 0.5 * self.damping * between(self)[1] ** 2

    @observable(unit="m", doc="By how much b is ahead of a.")
    def extension(self) -> Scalar:
        """Return the extension."""
        return between(self)[0]

    @observable(unit="N", doc="Force that pulls b back.")
    def force(self) -> Scalar:
        """Return the force of both."""
        extension, rate = between(self)
        return self.stiffness * (extension - self.natural) + self.damping * rate
