"""Nominal sizes of quantities: beside which their errors are small."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, UsageError, suggestion_in_parts
from atwood.expr import evaluate, vjp
from atwood.forms.assembly import Assembly
from atwood.mechanics.dynamics.equations import Equations
from atwood.model.values.units import parse_quantity, parse_si_unit
from atwood.simulation.dynamics.scales import motion_names


def read_nominal(assembly: Assembly, given: Mapping[str, Any] | None) -> dict[str, float]:
    """Return nominal sizes in SI units."""
    found = {}
    for path, size in (given or {}).items():
        if path not in assembly.observables:
            raise UsageError(
                "nominal= names no quantity of the scene",
                where=path,
                advice=suggestion_in_parts(path, list(assembly.observables)),
            )
        unit = assembly.observables[path].unit
        try:
            value = parse_quantity(size, parse_si_unit(unit), path) if isinstance(size, str) else float(size)
        except AtwoodError as error:
            raise UsageError(f"nominal=: {error.message}", where=path, advice=error.advice) from None
        if not (np.isfinite(value) and value > 0.0):
            raise UsageError(f"its nominal size cannot be {size!r}", where=path, advice="Give a size above 0.")
        found[path] = value
    return found


def with_nominal(
    assembly: Assembly, equations: Equations, sizes: tuple[FloatArray, FloatArray], nominal: Mapping[str, float]
) -> tuple[FloatArray, FloatArray]:
    """Return the sizes of coordinates and speeds, with those that quantities give in their place.

    A quantity that is linear in one coordinate, such as the displacement of a mass or the angle of a geared shaft, says
    the size of that; one that is linear in several, such as an angle between two bodies, says that none is larger. A
    speed is sized as its coordinate in the scene's time, unless a rate is given.
    """
    places, speeds = (one.copy() for one in sizes)
    found = [(size, _slopes(assembly, equations, path)) for path, size in nominal.items()]
    for size, (by_place, by_speed) in found:
        if not by_speed:
            _take(places, by_place, size)
    for k, name in enumerate(motion_names(equations)):
        numbers = [i for i, one in enumerate(equations.names) if one.name == name]
        if numbers:
            speeds[k] *= places[numbers[0]] / sizes[0][numbers[0]]
    for size, (by_place, by_speed) in found:
        if not by_place:
            _take(speeds, by_speed, size)
    return places, speeds


def _take(sizes: FloatArray, slopes: Mapping[int, float], size: float) -> None:
    for i, slope in slopes.items():
        own = size / abs(slope)
        sizes[i] = own if len(slopes) == 1 else min(own, sizes[i])


def _slopes(assembly: Assembly, equations: Equations, path: str) -> tuple[dict[int, float], dict[int, float]]:
    """Return the derivatives of a quantity by coordinates and speeds, where they are the same everywhere."""
    value, numbers = (
        assembly.observables[path].value,
        dict(zip(assembly.parameters, assembly.parameter_values, strict=True)),
    )
    found = []
    for symbols in (equations.coordinates, equations.speeds):
        slopes = vjp([value], [value.graph.constant(1.0)], list(symbols))
        used = {i: one for i, one in enumerate(slopes) if not one.is_zero}
        if not all(one.is_parametric for one in used.values()):
            return {}, {}
        values = evaluate(list(used.values()), numbers)
        found.append({i: float(x) for i, x in zip(used, values, strict=True) if x})
    return found[0], found[1]
