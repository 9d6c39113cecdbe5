"""How the examples of the Modelica Standard Library are put together, and read, in Atwood's own parts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from atwood import Component, Result, Scene

__all__ = ["STANDARD_GRAVITY", "Example", "Signal", "made"]

STANDARD_GRAVITY = 9.80665
"""Modelica.Constants.g_n, which is the gravity of its worlds, m/s^2."""


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
    reference_errs
        Signals in which the published trajectory errs by more than 1e-4 of the range after the first fifth of the run.
    options
        Further arguments of `simulate`.
    """

    make: Callable[[], Scene]
    signals: Mapping[str, Signal | str]
    reference_errs: tuple[str, ...] = ()
    options: Mapping[str, Any] = field(default_factory=dict)

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
        name, _, rest = text.strip().partition(".")
        return getattr(parts[name], rest)

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
