"""TranslationalMaxwell: a spring and a damper in series between two displacements."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import (
    Component,
    CoordinateLoad,
    Number,
    Scalar,
    Slide,
    connector,
    derivative,
    force,
    observable,
    parameter,
    state,
)
from atwood_library.interfaces.along_coordinates import between, push


class TranslationalMaxwell(Component):
    """A linear spring and a damper one after the other, which lets through what is slow; its extension is a state."""

    synonyms = ("Maxwell element", "Translational spring and damper in series", "Relaxation")

    stiffness: Number = parameter(1.0, unit="N/m", above=0.0, doc="Force for a unit of extension of the spring.")
    damping: Number = parameter(1.0, unit="N*s/m", above=0.0, doc="Force for a unit of the damper's rate.")
    against: str = parameter("flange", choices=("flange", "ground"), doc="What it acts against.")
    a: Slide = connector(Slide, "The displacement that it acts against.", when={"against": ("flange",)})
    b: Slide = connector(Slide, "The displacement that it acts on.")
    extension: Scalar = state(0.0, unit="m", doc="Extension of the spring alone.")

    @derivative("extension")
    def rate(self) -> Scalar:
        """Return what the damper leaves of the rate."""
        return between(self)[1] - self.stiffness * self.extension / self.damping

    @force
    def pull(self) -> Iterable[CoordinateLoad]:
        """Return what pulls b back."""
        yield from push(self, -self.force())

    @observable(unit="N", doc="Force that pulls b back.")
    def force(self) -> Scalar:
        """Return the force, the same in both."""
        return self.stiffness * self.extension
