"""RotationalMaxwell: a spring and a damper in series between two angles."""

from __future__ import annotations

from collections.abc import Iterable

from atwood import (
    Component,
    CoordinateLoad,
    Number,
    Scalar,
    Shaft,
    connector,
    derivative,
    force,
    observable,
    parameter,
    state,
)
from atwood_library.interfaces.along_coordinates import between, push


class RotationalMaxwell(Component):
    """A linear spring and a damper one after the other, which lets through what is slow; its extension is a state."""

    synonyms = ("Maxwell element", "Rotational spring and damper in series", "Relaxation")
    spaces = ("plane", "space")

    stiffness: Number = parameter(1.0, unit="N*m/rad", above=0.0, doc="Torque for a unit of extension of the spring.")
    damping: Number = parameter(1.0, unit="N*m*s/rad", above=0.0, doc="Torque for a unit of the damper's rate.")
    against: str = parameter("flange", choices=("flange", "ground"), doc="What it acts against.")
    a: Shaft = connector(Shaft, "The angle that it acts against.", when={"against": ("flange",)})
    b: Shaft = connector(Shaft, "The angle that it acts on.")
    extension: Scalar = state(0.0, unit="rad", doc="Extension of the spring alone.")

    @derivative("extension")
    def rate(self) -> Scalar:
        """Return what the damper leaves of the rate."""
        return between(self)[1] - self.stiffness * self.extension / self.damping

    @force
    def pull(self) -> Iterable[CoordinateLoad]:
        """Return what pulls b back."""
        yield from push(self, -self.torque())

    @observable(unit="N*m", doc="Torque that pulls b back.")
    def torque(self) -> Scalar:
        """Return the torque, the same in both."""
        return self.stiffness * self.extension
