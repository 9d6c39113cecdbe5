"""From a scene to its leaves: parts with their values by path, and who is joined with whom."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from atwood.errors import DeclarationError, StartError, UsageError
from atwood.model.component import Component
from atwood.model.composite import Model
from atwood.model.connectors import Connector
from atwood.model.fields import Deferred
from atwood.model.scene import Scene
from atwood.model.units import parse_unit

__all__ = ["FlatScene", "Part", "flatten"]


@dataclass(frozen=True)
class Part:
    """A leaf of a scene.

    Attributes
    ----------
    path
        Its dotted path.
    component
        The component, for its laws.
    values
        Its parameters by name.
    signals
        Its inputs by name: a number, or a function of time.
    """

    path: str
    component: Component
    values: Mapping[str, Any]
    signals: Mapping[str, Any]


@dataclass(frozen=True)
class FlatScene:
    """A scene as plain data: leaves, connections, start.

    Attributes
    ----------
    name
        Name of the scene.
    space
        ``"line"``, ``"plane"`` or ``"space"``.
    line_axis
        Unit vector of the line.
    gravity
        Acceleration of free fall along -z, m/s^2.
    t_start, t_end
        Time span, s.
    parts
        The leaves by path, in the order of declaration.
    connections
        Pairs of connector paths.
    links
        For each linked input (part path, input name): the output (part path, observable name).
    start, guess
        Start values by path.
    """

    name: str
    space: str
    line_axis: tuple[float, float, float]
    gravity: float
    t_start: float
    t_end: float
    parts: Mapping[str, Part]
    connections: tuple[tuple[str, str], ...]
    links: Mapping[tuple[str, str], tuple[str, str]]
    start: Mapping[str, float]
    guess: Mapping[str, float]


def flatten(scene: Model, name: str | None = None) -> FlatScene:
    """Take a scene apart into its leaves.

    Parameters
    ----------
    scene
        The scene; a plain model is taken as a scene with the usual settings.
    name
        What to call it; the name of its class otherwise.

    Raises
    ------
    DeclarationError
        If it holds no parts.
    ParameterError
        If a value that is bound to the parameters of an enclosing model is not admissible.
    StartError
        If a start value is no number.
    """
    if not isinstance(scene, Model):
        raise UsageError(f"{scene!r} is no scene", advice="Pass a Scene or a Model.")
    leaves: dict[str, Part] = {}
    joined: list[tuple[str, str]] = []
    start: dict[str, float] = {}
    guess: dict[str, float] = {}
    _collect(scene, leaves, joined, start, guess)
    if not leaves:
        raise DeclarationError("the scene has no parts", where=name or type(scene).__name__)
    connections, links = _split_links(joined, leaves)
    settings = scene if isinstance(scene, Scene) else Scene()
    return FlatScene(
        name=name or type(scene).__name__,
        space=settings.space,
        line_axis=_unit_vector(settings.line_axis),
        gravity=settings.gravity,
        t_start=settings.t_start,
        t_end=settings.t_end,
        parts=leaves,
        connections=connections,
        links=links,
        start=start,
        guess=guess,
    )


def _collect(
    model: Model,
    leaves: dict[str, Part],
    joined: list[tuple[str, str]],
    start: dict[str, float],
    guess: dict[str, float],
) -> None:
    prefix = f"{model.path}." if model.path else ""
    joined.extend((prefix + a, prefix + b) for a, b in model._connections)
    for part in model.parts.values():
        if isinstance(part, Model):
            _collect(part, leaves, joined, start, guess)
        else:
            path = part.path
            signals = {name: part._value(name) for name in part.signal_specs()}
            leaves[path] = Part(path, part, part.parameters(), signals)
    if isinstance(model, Scene):  # after the parts, so that the outer scene has the last word
        for target, given in ((start, model.start), (guess, model.guess)):
            target.update({prefix + key: _number(value, model, prefix + key) for key, value in given.items()})


def _number(value: Any, model: Model, path: str) -> float:
    if isinstance(value, Deferred):
        value = value.value_in(model)
    if isinstance(value, str):
        number, _, unit = value.strip().partition(" ")
        value = float(number) * (parse_unit(unit).factor if unit else 1.0)
    try:
        number_value = float(value)
    except (TypeError, ValueError):
        raise StartError(f"{value!r} is not a number", where=path) from None
    if not math.isfinite(number_value):
        raise StartError(f"{number_value} is not a finite number", where=path)
    return number_value


def _split_links(
    joined: list[tuple[str, str]], leaves: Mapping[str, Part]
) -> tuple[tuple[tuple[str, str], ...], dict[tuple[str, str], tuple[str, str]]]:
    connections: list[tuple[str, str]] = []
    links: dict[tuple[str, str], tuple[str, str]] = {}
    for a, b in joined:
        ends = [_signal_end(path, leaves) for path in (a, b)]
        if all(end is None for end in ends):
            connections.append((a, b))
            continue
        inputs = [end for end in ends if end is not None and end[1] in leaves[end[0]].signals]
        outputs = [end for end in ends if end is not None and end not in inputs]
        (target,), (source,) = inputs, outputs
        if target in links:
            raise DeclarationError("it is connected to two outputs", where=".".join(target))
        links[target] = source
    return tuple(connections), links


def _signal_end(path: str, leaves: Mapping[str, Part]) -> tuple[str, str] | None:
    """Return (part, name) if the path ends in an input or an observable of a leaf."""
    steps = path.split(".")
    for cut in range(len(steps) - 1, 0, -1):
        owner, name = ".".join(steps[:cut]), ".".join(steps[cut:])
        if owner in leaves:
            connectors: Mapping[str, Connector] = leaves[owner].component.connectors()
            return None if name in connectors else (owner, name)
    return None


def _unit_vector(axis: tuple[float, float, float]) -> tuple[float, float, float]:
    length = math.sqrt(sum(a * a for a in axis))
    if length == 0.0:
        raise DeclarationError("the direction of the line has no length", where="line_axis")
    x, y, z = (a / length for a in axis)
    return x, y, z
