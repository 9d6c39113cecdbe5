"""Formulas of what joints carry: springs, stops, dampers, each of one coordinate; all are zero where not asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeAlias

from atwood import (
    Component,
    Frame,
    Load,
    ParameterError,
    Point,
    Scalar,
    Vector,
    cos,
    cross,
    dot,
    is_zero,
    maximum,
    parameter,
    sin,
    unilateral,
)

__all__ = [
    "check_stops",
    "damper_function",
    "elastic_energy",
    "elastic_stop",
    "past_bend",
    "past_rim",
    "push_apart",
    "rigid_stops",
    "stop_restitution",
    "stops_of",
    "turn_apart",
]

Stops: TypeAlias = tuple[float, float | None, float | None]
"""Force or torque of a stop for one unit beyond it, and where the lower and the upper stop are."""


def elastic_energy(
    coordinate: Callable[[], Scalar],
    spring: tuple[float, float],
    stops: Stops,
) -> Scalar:
    """Return the energy in a linear spring and in two elastic stops, J, each of which may be missing.

    Parameters
    ----------
    coordinate
        Gives displacement, m, or angle, rad; asked only where something acts on it, since what is read must be known.
    spring
        Force or torque for one unit of the coordinate, and the coordinate at which the spring is at rest.
    stops
        Force or torque of a stop for one unit beyond it, and where the lower and the upper stop are.
    """
    stiffness, natural = spring
    stop_stiffness, lower, upper = stops
    energy: Scalar = 0.0
    if not is_zero(stiffness):
        stretch = coordinate() - natural
        energy = energy + 0.5 * stiffness * stretch * stretch
    if lower is not None:
        energy = energy + elastic_stop(lower - coordinate(), stop_stiffness)
    if upper is not None:
        energy = energy + elastic_stop(coordinate() - upper, stop_stiffness)
    return energy


def stop_restitution() -> Any:
    """Return the parameter of a joint with which its stops are rigid."""
    doc = "Share of the speed that a stop leaves, which is rigid then; stops are elastic if not given."
    return parameter(None, minimum=0.0, maximum=1.0, doc=doc, symbol="e_s")


def stops_of(stiffness: float, restitution: float | None, *bounds: float | None) -> Stops:
    """Return the elastic stops of a joint: none where these are rigid."""
    lower, upper = bounds if restitution is None else (None, None)
    return stiffness, lower, upper


def check_stops(part: Component, stiffness: float, restitution: float | None, *bounds: float | None) -> None:
    """Refuse stops that are rigid and elastic, those that are neither, and those that are nowhere."""
    if restitution is None:
        if not stiffness and any(one is not None for one in bounds):
            raise ParameterError(
                "its stops are neither elastic nor rigid, and hold nothing",
                where=part.path,
                advice="Give stop_stiffness, or stop_restitution for rigid ones; or leave away where they are.",
            )
        return
    if stiffness:
        raise ParameterError(
            "its stops cannot be elastic and rigid",
            where=part.path,
            advice="Give a stiffness of them or a restitution.",
        )
    if all(one is None for one in bounds):
        raise ParameterError(
            "its rigid stops are nowhere", where=part.path, advice="Give where the lower or the upper is."
        )


def rigid_stops(
    coordinate: Callable[[Any], Scalar],
    bounds: tuple[str, str],
    restitution: str,
    *,
    unit: str,
    doc: str,
    reaction_doc: str,
    spaces: Sequence[str] = ("plane", "space"),
) -> tuple[Any, Any]:
    """Return two laws, `above_` and `below_` the bounds, which hold where a bound and the restitution are given.

    Parameters
    ----------
    coordinate
        Gives displacement, m, or angle, rad, of a part.
    bounds, restitution
        Names of the parameters of the part: the lower and the upper bound, and what is left of a speed.
    unit
        Of the reactions, which are named after the bounds.
    doc, reaction_doc
        What is said of each gap and of its reaction; ``{way}`` is above or below, and ``{end}`` lower or upper.
    spaces
        The spaces in which they hold.
    """

    def law(bound: str, end: str, way: str) -> Any:
        def gap(part: Any) -> Scalar:
            value, limit = coordinate(part), getattr(part, bound)
            return value - limit if way == "above" else limit - value

        gap.__name__, gap.__doc__ = f"{way}_{bound}", doc.format(way=way, end=end)
        return unilateral(
            reaction=f"{bound}_{'force' if unit == 'N' else 'torque'}",
            unit=unit,
            restitution=restitution,
            given=(bound, restitution),
            doc=reaction_doc.format(end=end),
            spaces=spaces,
        )(gap)

    lower, upper = bounds
    return law(lower, "lower", "above"), law(upper, "upper", "below")


def damper_function(rates: Callable[[], Sequence[Scalar]], damping: float) -> Scalar:
    """Return half the power of a linear damper, W (Rayleigh's function; Goldstein, section 1.5).

    Parameters
    ----------
    rates
        Gives rates along square directions; asked only where there is a damper.
    damping
        Force or torque for a rate of one.
    """
    if is_zero(damping):
        return 0.0
    total: Scalar = 0.0
    for rate in rates():
        total = total + rate * rate
    return 0.5 * damping * total


def past_rim(arm: Vector, rim: float) -> Scalar:
    """Return ``(r^2 - R^2)/(2 R)``, m: how far a point is beyond a rim, while that is small, without a corner at r = 0.

    Parameters
    ----------
    arm
        From the centre to the point, of length r, m.
    rim
        Radius R of the rim, m.
    """
    return (dot(arm, arm) - rim * rim) / (2.0 * rim)


def past_bend(cosine: Scalar, limit: float) -> Scalar:
    """Return ``(cos L - cos x)/sin L``, rad: how far an axis is beyond a cone, while that is small, smooth at x = 0.

    Parameters
    ----------
    cosine
        Of the angle x between the axes.
    limit
        Half the opening L of the cone, rad, between 0 and pi.
    """
    return (cos(limit) - cosine) / sin(limit)


def elastic_stop(past: Scalar, stiffness: float) -> Scalar:
    """Return the energy in an elastic stop, J.

    Parameters
    ----------
    past
        How far something is beyond it, m or rad; nothing where negative.
    stiffness
        Force or torque for one unit beyond it.
    """
    beyond = maximum(past, 0.0)
    energy: Scalar = 0.5 * stiffness * beyond * beyond
    return energy


def turn_apart(a: Frame, b: Frame, torque: Vector) -> Iterator[Load]:
    """Yield a torque on frame b, in world axes, N m, and its reaction on frame a."""
    yield Load(b, torque=torque)
    yield Load(a, torque=-torque)


def push_apart(a: Frame, b: Point, push: Vector) -> Iterator[Load]:
    """Yield a force on b, in world axes, N, and its reaction on frame a at the place of b."""
    yield Load(b, force=push)
    yield Load(a, force=-push, torque=cross(b.position - a.position, -push))
