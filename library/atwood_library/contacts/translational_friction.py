"""TranslationalFriction: dry friction between two displacements: a brake, a clutch, a bearing."""

from __future__ import annotations

from typing import Any, ClassVar

from atwood import Number, Scalar, Slide, connector, dry_friction, parameter, signal
from atwood_library.interfaces.along_coordinates import between
from atwood_library.interfaces.rubbing import Rubbing

__all__ = ["TranslationalFriction"]


class TranslationalFriction(Rubbing):
    """Dry friction between two displacements, or from one to the ground. It holds what it has brought to rest.

    While it slips its size is ``level (sliding(v) + viscous v)``; while it sticks it bears `peak` times as much as it
    has just above rest. The input `level` is how far a brake or a clutch is pressed; at or below zero it is free.
    """

    synonyms: ClassVar[tuple[str, ...]] = (
        *("Friction", "SupportFriction", "Translational.Components.Brake", "Guide friction", "Stick-slip"),
    )

    sliding: Any = parameter(
        "1.0", unit="N", function_of={"v": "m/s"}, doc="Friction at a speed v of slip, of its size, at level 1."
    )
    viscous: Number = parameter(0.0, unit="N*s/m", minimum=0.0, doc="Friction for a unit of speed besides.")
    peak: Number = parameter(1.0, minimum=1.0, doc="What it bears at rest, over what it has just above rest.")
    level: Number = signal(1.0, doc="How far it is pressed.")
    against: str = parameter("flange", choices=("flange", "ground"), doc="What it acts against.")
    a: Slide = connector(Slide, "The displacement that it acts against.", when={"against": ("flange",)})
    b: Slide = connector(Slide, "The displacement that it acts on.")

    @dry_friction(reaction="force", unit="N", limit="largest", static_limit="largest_static", doc="Friction on b.")
    def slip(self) -> Scalar:
        """Speed of b past a."""
        return between(self)[1]
