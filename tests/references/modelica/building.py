"""How the examples of the Modelica Standard Library are put together, and read, in Atwood's own parts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from atwood import Component, Frame, Model, Result, Scene, connect, connector, parameter
from atwood_library import Box, Cylinder, RigidBody, Weld

__all__ = [
    "STEEL",
    "WORLD",
    "Body",
    "Example",
    "Signal",
    "bar",
    "box",
    "cylinder",
    "guides",
    "hinges",
    "made",
    "moments",
    "orientation",
    "overlong",
    "rotation",
    "vector",
]

Way = tuple[float, float, float]

WORLD: Mapping[str, Any] = {"space": "space", "gravity": 9.80665, "gravity_direction": (0.0, -1.0, 0.0)}
"""Settings of a scene as of Modelica's worlds: y upwards, and gravity Modelica.Constants.g_n."""

STEEL = 7700.0
"""Density of BodyBox and BodyCylinder, kg/m^3."""


class Body(Model):
    """A rigid body with two frames a given way apart, as BodyShape, BodyBox and BodyCylinder are."""

    way: tuple[float, float, float] = parameter((1.0, 0.0, 0.0), unit="m", size=3, doc="From frame a to frame b.")
    a: Frame = connector(Frame, "Its frame.")
    b: Frame = connector(Frame, "The other end.")
    solid: RigidBody = RigidBody()
    end: Weld = Weld(displacement=way)
    connections = [connect(a, solid.frame), connect(a, end.a), connect(b, end.b)]


def bar(way: Way, mass: float, center: Way, *inertia: float) -> Body:
    """Return a body by its numbers, with moments of 0.001 about its centre of mass if none are given."""
    return Body(way=way, solid=RigidBody(mass=mass, center=center, moments=inertia or (1e-3, 1e-3, 1e-3)))


def box(way: Way, width: float | None = None, height: float | None = None, across: Way = (0.0, 1.0, 0.0)) -> Box:
    """Return a BodyBox of steel: along the way, its width along the part of `across` that is square to it."""
    length = float(np.linalg.norm(way))
    wide = length / 20.0 if width is None else width
    return Box(
        length_x=length,
        length_y=wide,
        length_z=wide if height is None else height,
        direction=way,
        upward=tuple(np.cross(way, across)),
        density=STEEL,
    )


def cylinder(way: Way, diameter: float | None = None) -> Cylinder:
    """Return a BodyCylinder of steel along the way."""
    length = float(np.linalg.norm(way))
    radius = length / 40.0 if diameter is None else diameter / 2.0
    return Cylinder(length=length, radius=radius, axis="direction", direction=way, density=STEEL)


def overlong(way: Way, shape: Box | Cylinder, centre: Way) -> Body:
    """Return a body whose shape is longer than the way from frame a to frame b, with its middle at a given place."""
    return Body(way=way, solid=RigidBody(mass=float(shape.total_mass()), center=centre, moments=moments(shape)))


def moments(shape: Box | Cylinder) -> Way:
    """Return the moments of inertia of a shape along an axis of its frame."""
    tensor = shape.tensor()
    return float(tensor[0][0]), float(tensor[1][1]), float(tensor[2][2])


def rotation(sequence: str, *degrees: float) -> np.ndarray:
    """Return the axes, in columns, of a frame turned about its own axes one after the other."""
    total = np.eye(3)
    for axis, angle in zip(sequence, np.radians(degrees), strict=True):
        j, k = (("xyz".index(axis) + step) % 3 for step in (1, 2))
        one = np.eye(3)
        one[j, j] = one[k, k] = np.cos(angle)
        one[k, j], one[j, k] = np.sin(angle), -np.sin(angle)
        total = total @ one
    return total


def orientation(path: str, axes: np.ndarray) -> dict[str, float]:
    """Return start values of a body's axes."""
    return {f"{path}.{name}.{component}": float(axes[i, k]) for k, name in ((0, "x_axis"), (2, "z_axis"))
            for i, component in enumerate("xyz")}  # fmt: skip


@dataclass(frozen=True)
class Signal:
    """A signal of the published trajectories as a quantity here: ``factor * quantity + offset``.

    Attributes
    ----------
    path
        The quantity.
    factor, offset
        What it is multiplied by, and what is added: signs, and where the two count from.
    """

    path: str
    factor: float = 1.0
    offset: float = 0.0

    def read(self, result: Result) -> np.ndarray:
        """Return its values at the times of a result."""
        return np.asarray(self.factor * np.asarray(result[self.path]) + self.offset)


@dataclass(frozen=True)
class Example:
    """An example of the Modelica Standard Library.

    Attributes
    ----------
    make
        Returns it as a scene, with the start values of the model.
    signals
        What its published signals are here.
    options
        Further arguments of `simulate`.
    long
        Whether a run takes tens of seconds.
    """

    make: Callable[[], Scene]
    signals: Mapping[str, Signal | str]
    options: Mapping[str, Any] = field(default_factory=dict)
    long: bool = False

    def signal(self, name: str) -> Signal:
        """Return a signal by its name in Modelica."""
        found = self.signals[name]
        return found if isinstance(found, Signal) else Signal(found)


def made(parts: Mapping[str, Component], joined: str, start: Mapping[str, Any] | None = None, **settings: Any) -> Scene:
    """Return a scene of parts by name, joined line by line as ``a.shaft - b.flange``.

    Parameters
    ----------
    parts
        Its parts.
    joined
        Connections, each on a line or behind a comma: connectors with ``-`` between them, as many as meet there, or an
        output and an input with ``>``.
    start
        Start values by path.
    settings
        Of the scene.
    """
    scene = Scene(**settings)
    for name, part in parts.items():
        scene.add(name, part)

    def connector(text: str) -> Any:
        part, *rest = text.strip().split(".")
        found: Any = parts[part]
        for step in rest:
            found = getattr(found, step)
        return found

    for line in joined.replace(",", "\n").splitlines():
        if ">" in line:
            source, target = (text.strip().partition(".") for text in line.split(">"))
            scene.connect(parts[source[0]].output(source[2]), parts[target[0]].input(target[2]))
        elif line.strip():
            first, *others = line.split(" - ")
            for other in others:
                scene.connect(connector(first), connector(other))
    scene.start.update(start or {})
    return scene


def vector(theirs: str, ours: str) -> dict[str, str]:
    """Return the three components of a vector."""
    return {f"{theirs}[{i}]": f"{ours}.{axis}" for i, axis in enumerate("xyz", 1)}


def hinges(*names: str) -> dict[str, str]:
    """Return the signals of hinges that have the same names here."""
    return {
        f"{name}.{m}": f"{name}.{ours}" for name in names for m, ours in (("phi", "angle"), ("w", "angular_velocity"))
    }


def guides(*names: str) -> dict[str, str]:
    """Return the signals of guides that have the same names here."""
    return {f"{name}.{m}": f"{name}.{ours}" for name in names for m, ours in (("s", "displacement"), ("v", "speed"))}
