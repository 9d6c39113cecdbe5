"""Scenes: the model that is simulated, with its gravity and its start."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from atwood.model.composite import Model
from atwood.model.fields import parameter

__all__ = ["Scene"]


class Scene(Model):
    """The model that is simulated: a model with its space, its gravity and its start.

    Axes: x right, y into the page, z up; a planar scene lives in the x-z plane, gravity is along -z. A scene can be
    declared as a class, like any model, or put together step by step::

        scene = Scene()
        ground = scene.add("ground", Ground())
        rod = scene.add("rod", Rod(length=1.0))
        scene.connect(ground.frame, rod.a)
        scene.start["rod.angle"] = 0.5

    As a part of another scene it is a model like any other; of its own settings only its start is then used.

    Attributes
    ----------
    start
        What holds exactly at the start, by path: any mix of coordinates, positions and velocities.
    guess
        What holds roughly at the start; used where the start leaves a choice.
    """

    space: str = parameter("plane", choices=("line", "plane", "space"), doc="What the scene lives in.")
    line_axis: tuple[float, float, float] = parameter(
        (1.0, 0.0, 0.0), size=3, doc="Direction of the line, for a scene on a line."
    )
    gravity: float = parameter(9.81, unit="m/s^2", doc="Acceleration of free fall, along -z.")
    t_start: float = parameter(0.0, unit="s", doc="Time of the start.")
    t_end: float = parameter(10.0, unit="s", doc="Time of the end, unless a run is given another.")

    start: ClassVar[Mapping[str, Any]] = {}
    guess: ClassVar[Mapping[str, Any]] = {}

    def _assemble(self) -> None:
        # A fresh dictionary of the class's own values for each scene: what is added in `build` or later is its own.
        for name in ("start", "guess"):
            kept = self.__dict__.get(name)
            object.__setattr__(self, name, dict(getattr(type(self), name) if kept is None else kept))
        super()._assemble()

    def copy(self) -> Any:
        """Return a scene with the same settings and its own parts and start."""
        twin = super().copy()
        object.__setattr__(twin, "start", dict(self.start))
        object.__setattr__(twin, "guess", dict(self.guess))
        return twin
