"""From a scene to its leaves: parts with their values by path, and who is joined with whom."""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import field
from types import FrameType
from typing import Any

from atwood.errors import AtwoodError, DeclarationError, ParameterError, StartError, UsageError
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import Model
from atwood.model.compose.connection_rules import find_end
from atwood.model.compose.scene import Scene
from atwood.model.declare.component import Component
from atwood.model.declare.connectors import InputRef, OutputRef
from atwood.model.declare.fields import LARGEST_ANGLE, FieldReference, too_large_an_angle
from atwood.model.declare.function_values import Function
from atwood.model.declare.parameter_expressions import ParameterExpression
from atwood.model.declare.time_functions import write_function
from atwood.model.values.space import Space, make_space
from atwood.model.values.units import Unit, parse_quantity, parse_si_unit, parse_unit, split_quantity, unit_of


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
    steps
        Of these functions, by name, the steps that they took when the scene was taken apart; not of those that call an
        external function.
    """

    path: str
    component: Component
    values: Mapping[str, Any]
    signals: Mapping[str, Any]
    steps: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class FlatScene:
    """A scene as plain data: leaves, connections, start.

    Attributes
    ----------
    name
        Name of the scene.
    space
        What it lives in: a line, a plane or space.
    gravity
        Acceleration of free fall, m/s^2.
    gravity_direction
        Unit vector along it.
    gravity_potential
        Energy of a kilogram as a function of x, y, z and t, besides that; None where there is none.
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
    varied
        Inputs (part path, input name) that have a variation: a quadratic function of the time since the start, whose
        three coefficients are parameters and zero. Derivatives by these are those by the input, its rate, and its
        second derivative.
    symbols
        Letters in formulas by path.
    contact_states
        States and directions of all gaps and slips by path, where one set of them is chosen: what holds in it is an
        ordinary constraint, and what slips an ordinary load.
    """

    name: str
    space: Space
    gravity: float
    gravity_direction: tuple[float, float, float]
    gravity_potential: Function | None
    t_start: float
    t_end: float
    parts: Mapping[str, Part]
    connections: tuple[tuple[str, str], ...]
    links: Mapping[tuple[str, str], tuple[str, str]]
    start: Mapping[str, float]
    guess: Mapping[str, float]
    varied: frozenset[tuple[str, str]] = frozenset()
    symbols: Mapping[str, str] = field(default_factory=dict)
    contact_states: Mapping[str, float] = field(default_factory=dict)


def flatten(scene: Model, name: str | None = None) -> FlatScene:
    """Take a scene apart into its leaves."""
    if not isinstance(scene, Model):
        raise UsageError(f"{scene!r} is no scene", advice="Pass a Scene or a Model.")
    for setting in scene._settings if scene._parent is None else ():
        if isinstance(bound := scene._value(setting), ParameterExpression):
            raise ParameterError(f"it is bound to {bound!r}, and there is no model around it", where=setting)
    leaves: dict[str, Part] = {}
    joined: list[tuple[str, str]] = []
    start: dict[str, float] = {}
    guess: dict[str, float] = {}
    symbols: dict[str, str] = {}
    _collect(scene, leaves, joined, start, guess, symbols)
    if not leaves:
        where, advice = name or title(scene), "Add some: scene.add('bob', PointMass())."
        raise DeclarationError("the scene has no parts", where=where, advice=advice)
    connections, links = _split_links(scene, joined, leaves)
    settings = scene if isinstance(scene, Scene) else Scene()
    return FlatScene(
        name=name or title(scene),
        space=make_space(settings.space, _unit_vector(settings.line_axis)),
        gravity=settings.gravity,
        gravity_direction=settings.gravity_direction,
        gravity_potential=settings.gravity_potential,
        t_start=settings.t_start,
        t_end=settings.t_end,
        parts=leaves,
        connections=connections,
        links=links,
        start=start,
        guess=guess,
        symbols=symbols,
    )


def title(scene: Model) -> str:
    """Return what to call a scene: the name of its class, or of its variable where the class says nothing.

    The variable is that of the nearest caller outside of Atwood who has one, unless it only says what the scene is, as
    ``scene`` does.
    """
    kind = type(scene).__name__
    if type(scene) not in (Scene, Model):
        return kind
    frame: FrameType | None = sys._getframe(1)
    while frame is not None:
        if str(frame.f_globals.get("__name__", "")).partition(".")[0] != "atwood":
            for name, value in frame.f_locals.items():
                if value is scene and name.isidentifier() and name.lower() not in _GENERIC and name[0] != "_":
                    return name
        frame = frame.f_back
    return kind


_GENERIC = ("scene", "model", "self", "made", "result", "mechanism", "system")
"""Names of variables that say no more than the class."""


def _collect(
    model: Model,
    leaves: dict[str, Part],
    joined: list[tuple[str, str]],
    start: dict[str, float],
    guess: dict[str, float],
    symbols: dict[str, str],
) -> None:
    prefix = f"{model.path}." if model.path else ""
    joined.extend((prefix + a, prefix + b) for a, b in model._connections)
    for part in model.parts.values():
        if isinstance(part, Model):
            _collect(part, leaves, joined, start, guess, symbols)
        else:
            path = part.path
            signals = {name: part._value(name) for name in part.signal_specs()}
            part.check_values()
            leaves[path] = Part(path, part, part.parameters(), signals, _steps(signals))
    if isinstance(model, Scene):  # after the parts, so that the outer scene has the last word
        for target, given in ((start, model.start), (guess, model.guess)):
            target.update({prefix + key: _number(value, model, key, prefix) for key, value in given.items()})
        symbols |= {prefix + key: letter for key, letter in model.symbols.items()}


def _steps(signals: Mapping[str, Any]) -> dict[str, str]:
    found: dict[str, str] = {}
    for name, value in signals.items():
        if callable(value) and not isinstance(value, Function):  # which is compared as it is
            with suppress(ParameterError):  # it calls an external function, and is like no other
                found[name] = repr(write_function(value, name))
    return found


def _number(value: Any, model: Model, key: str, prefix: str) -> float:
    """Return a start value in SI units; text must be in a unit of what it is for, where that is known."""
    path = prefix + key
    wanted = unit_at(model, key)
    if isinstance(value, ParameterExpression):
        if wanted is not None and value.unit is not None and not value.unit.has_dimension_of(wanted):
            raise StartError(
                f"it is bound to {value!r}, which is {value.unit.as_asked} and not {wanted.as_asked}", where=path
            )
        value = value.worked_out(model, path)
    was_text = isinstance(value, str)
    if isinstance(value, str):
        _, unit_text = split_quantity(value) or (0.0, "")
        given = parse_unit(unit_text)
        try:
            value = parse_quantity(value, wanted or parse_si_unit(unit_of(given.exponents).text), path)
        except ParameterError as error:
            raise StartError(error.message, where=path, advice=error.advice) from None
    try:
        number = float(value)
    except (TypeError, ValueError, AtwoodError):
        raise StartError(f"{value!r} is not a number", where=path) from None
    if not math.isfinite(number):
        raise StartError(f"{number} is not a finite number", where=path, advice="Give a finite number.")
    if wanted is not None and wanted.text == "rad" and abs(number) > LARGEST_ANGLE:
        raise too_large_an_angle(number, path, StartError)
    is_typed = isinstance(value, (int, float)) and number == round(number, 2)
    if wanted is not None and wanted.text == "rad" and abs(number) > math.tau and is_typed and not was_text:
        warnings.warn(
            f"{path}: the start {number:g} is taken as radians, {number / math.tau:.3g} turns; "
            f"write '{number:g} deg' or '{number:g} rad'",
            stacklevel=2,
        )
    return number


def unit_at(model: Component, key: str) -> Unit | None:
    """Return the unit of the observable at a path within a model; None if there is no such observable."""
    component, steps = model, key.split(".")
    while steps[0] in component._children():
        component, steps = component._children()[steps[0]], steps[1:]
        if not steps:
            return None
    if len(steps) > 1 and steps[0] in component.connectors():
        return parse_unit(_CONNECTOR_UNITS[steps[1]]) if steps[1] in _CONNECTOR_UNITS else None
    for law in component.laws("observable"):
        if law.name == steps[0]:
            return parse_unit(law.options.unit)
    return None


_CONNECTOR_UNITS = {"position": "m", "velocity": "m/s", "angle": "rad", "angular_velocity": "rad/s"}


def _split_links(
    scene: Model, joined: list[tuple[str, str]], leaves: Mapping[str, Part]
) -> tuple[tuple[tuple[str, str], ...], dict[tuple[str, str], tuple[str, str]]]:
    """Tell connections of connectors from links of outputs to inputs."""
    connections: list[tuple[str, str]] = []
    links: dict[tuple[str, str], tuple[str, str]] = {}
    for a, b in joined:
        first, second = find_end(scene, a), find_end(scene, b)
        if isinstance(second, InputRef):
            first, second = second, first
        if not isinstance(first, InputRef) or not isinstance(second, OutputRef):
            connections.append((a, b))
            continue
        for target in _driven_inputs(first, leaves):
            if target in links:
                raise DeclarationError("it is connected to two outputs", where=".".join(target))
            links[target] = (second.component.path, second.name)
    return tuple(connections), links


def _driven_inputs(end: InputRef, leaves: Mapping[str, Part]) -> Iterator[tuple[str, str]]:
    """Return the inputs of leaves that follow an input, which may be that of a model."""
    if end.component.path in leaves and leaves[end.component.path].component is end.component:
        yield end.component.path, end.name
        return
    for path, part in leaves.items():
        for name in part.signals:
            if any(one is end.component and source == end.name for one, source in passed_on(part.component, name)):
                yield path, name


def passed_on(component: Component, name: str) -> Iterator[tuple[Component, str]]:
    """Yield a field of a component, and the fields of the models around it that are passed on to it as they are."""
    yield component, name
    while component._parent is not None and isinstance(bound := component._settings.get(name), FieldReference):
        component, name = component._parent, bound.name
        yield component, name


def _unit_vector(axis: tuple[float, float, float]) -> tuple[float, float, float]:
    length = math.sqrt(sum(a * a for a in axis))
    if length == 0.0:
        raise DeclarationError("the direction of the line has no length", where="line_axis")
    x, y, z = (a / length for a in axis)
    return x, y, z
