"""Ways to look at one scene: turned, moved, renamed and reordered, or of another size. Answers are the same in each."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from atwood import Component, Scene

G = 9.81
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class View:
    """Where a scene is, how it is turned, how large it is, and what its parts are called.

    Attributes
    ----------
    turn
        Angle by which all is turned with gravity, rad; in space by a second rotation, too.
    move
        How far away the origin is along each axis, in sizes of the scene.
    size
        All lengths are as many times longer. Masses and gravity stay, so times are longer by the root of it.
    renamed
        Whether parts have names in the opposite order, and are added in it.
    """

    turn: float = 0.0
    move: float = 0.0
    size: float = 1.0
    renamed: bool = False

    @property
    def time(self) -> float:
        """The unit of time."""
        return math.sqrt(self.size)

    @property
    def speed(self) -> float:
        """The unit of speeds, which is that of times, too, as gravity stays."""
        return math.sqrt(self.size)

    @cached_property
    def matrix(self) -> np.ndarray:
        """The rotation in the plane of x and z, from x to z."""
        c, s = math.cos(self.turn), math.sin(self.turn)
        return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])

    @cached_property
    def matrix_in_space(self) -> np.ndarray:
        """The same with another one before it, about x."""
        c, s = math.cos(1.3 * self.turn), math.sin(1.3 * self.turn)
        return np.asarray(self.matrix @ np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]]))

    def way(self, x: float, y: float, z: float, in_space: bool = False) -> Vector:
        """Return a direction."""
        found = (self.matrix_in_space if in_space else self.matrix) @ np.array([x, y, z])
        return float(found[0]), float(found[1]), float(found[2])

    def point(self, x: float, y: float, z: float, in_space: bool = False) -> Vector:
        """Return a place, m."""
        a, b, c = self.way(x, y, z, in_space)
        return self.size * (a + self.move), self.size * (b + self.move * in_space), self.size * (c + self.move)

    def velocity(self, x: float, y: float, z: float, in_space: bool = False) -> Vector:
        """Return a velocity, m/s."""
        a, b, c = self.way(x, y, z, in_space)
        return self.speed * a, self.speed * b, self.speed * c


VIEWS: Mapping[str, View] = {
    "as it is": View(),
    "turned": View(turn=0.7),
    "moved": View(move=1e3),
    "renamed": View(renamed=True),
    "small": View(size=1e-3),
    "large": View(size=1e3),
}


@dataclass
class Draft:
    """A scene before its parts have names: parts, pairs of connectors, and starts by path."""

    view: View
    space: str = "plane"
    gravity: float = G
    parts: dict[str, Component] = field(default_factory=dict)
    joins: list[tuple[str, str]] = field(default_factory=list)
    start: dict[str, float] = field(default_factory=dict)

    @property
    def in_space(self) -> bool:
        """Whether it has three directions."""
        return self.space == "space"

    def way(self, x: float, y: float, z: float) -> Vector:
        """Return a direction in this scene."""
        return self.view.way(x, y, z, self.in_space)

    def place(self, name: str, x: float, y: float, z: float) -> None:
        """Start with a part at a place."""
        self._start(f"{name}.position", self.view.point(x, y, z, self.in_space))

    def throw(self, name: str, x: float, y: float, z: float) -> None:
        """Start with a velocity of a part."""
        self._start(f"{name}.velocity", self.view.velocity(x, y, z, self.in_space))

    def _start(self, path: str, values: Vector) -> None:
        axes = zip("xyz", values, strict=True)
        self.start |= {f"{path}.{axis}": value for axis, value in axes if self.in_space or axis != "y"}

    def name(self, name: str) -> str:
        """Return what a part is called."""
        names = list(self.parts)
        return f"p{len(names) - names.index(name):02d}" if self.view.renamed else name

    def build(self) -> Scene:
        """Return the scene."""
        line = self.space == "line" and self.view.turn
        scene = Scene(
            space="plane" if line else self.space, gravity=self.gravity, gravity_direction=self.way(0.0, 0.0, -1.0)
        )
        turned = reversed if self.view.renamed else iter
        for name in turned(list(self.parts)):
            scene.add(self.name(name), self.parts[name])
        for ends in turned(self.joins):
            one, other = (self._end(scene, path) for path in ends)
            scene.connect(one, other)
        for path in turned(list(self.start)):
            part, _, rest = path.partition(".")
            scene.start[f"{self.name(part)}.{rest}"] = self.start[path]
        return scene

    def _end(self, scene: Scene, path: str) -> object:
        part, _, rest = path.partition(".")
        return getattr(getattr(scene, self.name(part)), rest)
