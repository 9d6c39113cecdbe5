"""What a run is differentiated by: parameters and start values, each with the scene a little to both sides of it.

What Python works out from a value - the parameters of leaves below a model, and a consistent start - has no graph. Its
derivatives are central differences of three lengths, extrapolated (L. F. Richardson, Phil. Trans. R. Soc. A 226, 1927,
section 1); they are of numbers known to rounding, and not of a run. What is then known of a start is made exact by the
derivatives of the constraints; see `atwood.study.sensitivities.augmented`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, UsageError
from atwood.expr import read_by
from atwood.forms.assembly import Assembly
from atwood.forms.other_values import starting
from atwood.forms.quantities import observer
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import owner_of
from atwood.model.declare.component import Component
from atwood.pipeline import scene_of
from atwood.simulation.dynamics.scales import scene_length
from atwood.simulation.initialization.start import Start, find_start, own_state
from atwood.simulation.initialization.system import sort_targets

SHARES: tuple[float, ...] = (2.0**-7, 2.0**-8, 2.0**-9)
"""Lengths of the differences, in units of a column."""


def extrapolated(function: Callable[[float], FloatArray]) -> FloatArray:
    """Return the derivative of a smooth function at zero, with an error of the sixth power of the lengths."""
    return differentiated(function)[0]


def differentiated(function: Callable[[float], FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return the same, and how far two of an error of the fourth power are apart."""
    slopes = [(function(h) - function(-h)) / (2.0 * h) for h in SHARES]
    first, second = [(4.0 * finer - one) / 3.0 for one, finer in pairwise(slopes)]
    return (16.0 * second - first) / 15.0, second - first


@dataclass(frozen=True, eq=False)
class Column:
    """One thing that a run is differentiated by.

    Attributes
    ----------
    path, unit
        Of the parameter or start value.
    is_start
        Whether it is a start value.
    value
        In SI units.
    scale
        What a change of it is measured by: the parameter itself, or for starts a size of the scene.
    near
        Gives the scene with the value moved by a share of the scale.
    symbols
        The names of the parameters of the equations that it is, and no other follows; empty where that is not known.
    leaves_start
        Whether the start does not depend on it for certain.
    """

    path: str
    unit: str
    is_start: bool
    value: float
    scale: float
    near: Callable[[float], Assembly]
    symbols: frozenset[str]
    leaves_start: bool

    def start(self, state: tuple[FloatArray, FloatArray], length: float) -> FloatArray:
        """Return by how much coordinates and speeds at the start change with a change by the scale."""
        if self.leaves_start:
            return np.zeros(len(state[0]) + len(state[1]))
        here, farthest = np.concatenate(state), 0.3 * max(1.0, length)

        def there(share: float) -> FloatArray:
            assembly = self.near(share)
            found = np.concatenate(own_state(assembly, find_start(assembly)))
            if found.shape != here.shape or not np.max(np.abs(found - here), initial=0.0) < farthest + np.max(
                np.abs(here), initial=0.0
            ):
                raise UsageError(
                    "the start goes over to another place with a small change of it",
                    where=self.path,
                    advice="Give more start values, so that they say where the scene is.",
                )
            return found

        if all(np.array_equal(there(share), here) for share in (SHARES[0], -SHARES[1])):
            return np.zeros(len(here))
        return extrapolated(there)


def find_columns(
    assembly: Assembly,
    start: Start,
    parameters: Iterable[str],
    starts: Iterable[str],
    inputs: Sequence[Column] = (),
) -> tuple[Column, ...]:
    """Return what a run is differentiated by; what it cannot be is refused by name."""
    reads = cache(lambda: _read_by_start(assembly))
    found = [_parameter(assembly, path, reads) for path in parameters]
    found += [_start_value(assembly, start, path) for path in starts]
    found += inputs
    if not found:
        raise UsageError(
            "nothing is said that it is to be differentiated by",
            where=assembly.flat.name,
            advice="Give paths, such as parameters=['bob.mass'] or start=['rod1.angle'].",
        )
    paths = [(one.path, one.is_start) for one in found]
    twice = next((path for path, _ in paths if paths.count((path, _)) > 1), None)
    if twice is not None:
        raise UsageError("it is given twice", where=twice, advice="Name each parameter and start value once.")
    return tuple(found)


def value_of(assembly: Assembly, path: str) -> tuple[Any, str]:
    """Return the value of a parameter in SI units, and its unit."""
    scene = scene_of(assembly)
    part, name = owner_of(scene, path)
    try:
        value = part._value(name)
    except (KeyError, AttributeError):
        scene.copy().set(path, 1.0)  # says what there is instead
        raise
    unit = getattr(getattr(part._field(name), "unit", None), "text", "")
    return value, unit


def _parameter(assembly: Assembly, path: str, reads: Callable[[], frozenset[str]]) -> Column:
    value, unit = value_of(assembly, path)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise UsageError(
            f"it is {value!r}, and there are derivatives by single numbers only",
            where=path,
            advice="Name parameters that are numbers, as masses and lengths are.",
        )
    number = float(value)
    scale = abs(number) or 1.0
    whole = f"it is the whole number {value}, which shapes the equations" if isinstance(value, int) else ""

    @cache
    def near(share: float) -> Assembly:
        return _other(assembly, path, {path: number + share * scale}, {}, whole)

    is_own = number != 0.0 and not whole and _is_own(assembly, path)
    if is_own:
        return Column(path, unit, False, number, scale, near, frozenset([path]), path not in reads())
    found = near(SHARES[0])
    if found.shared is not assembly.shared or found.why_new:
        zero = "it is exactly zero, and the equations are made without it"
        raise UsageError(
            zero if number == 0.0 else f"it shapes the equations: {found.why_new}",
            where=path,
            advice="Give it a small value other than zero, such as a thousandth of what it could be."
            if number == 0.0
            else "Leave it out; a sweep runs the scene with other values of it.",
        )
    symbols = _handed_on(assembly, found, number, number + SHARES[0] * scale)
    is_kept = (found.flat.start, found.flat.guess) == (assembly.flat.start, assembly.flat.guess)
    leaves_start = bool(symbols) and is_kept and not symbols & reads()
    return Column(path, unit, False, number, scale, near, symbols, leaves_start)


def _is_own(assembly: Assembly, path: str) -> bool:
    """Return whether a value of a leaf is a parameter of the equations; nothing else is made of that."""
    leaf = path.rpartition(".")[0]
    is_own = leaf in assembly.flat.parts and any(one.name == path for one in assembly.parameters)
    return is_own and not assembly.mechanism.constants


def _handed_on(assembly: Assembly, near: Assembly, value: float, moved: float) -> frozenset[str]:
    """Return the parameters of the equations that a value is handed on to as it is; none if any is made of it."""
    here, there = assembly.parameter_values, near.parameter_values
    changed = np.flatnonzero(here != there)
    is_same = np.all(here[changed] == value) and np.all(there[changed] == moved)
    return frozenset(assembly.parameters[k].name for k in changed) if is_same else frozenset()


def _read_by_start(assembly: Assembly) -> frozenset[str]:
    """Return the names of the parameters of the equations on which the start may depend."""
    equations, flat = assembly.reduced, assembly.flat
    said = {path.rpartition(".")[0] for path in (*flat.start, *flat.guess)} & set(flat.parts)
    restates = any(type(flat.parts[one].component).restate_start is not Component.restate_start for one in said)
    # What touches at the start is held there, too.
    is_held = bool(equations.contacts or assembly.own_equations.contacts)
    if is_held or restates or starting(assembly) is not assembly or assembly.mechanism.table.origin:
        return frozenset(one.name for one in assembly.parameters)
    values = [
        one.observable.value for some in sort_targets(assembly, equations) for one in (*some.fixed, *some.guessed)
    ]
    if equations.constraints or equations.solved_speeds or equations.eliminated or assembly.form == "dae":
        moved = equations.kinematics
        places = (*moved.placements.positions.values(), *moved.velocities.values(), *moved.angular_velocities.values())
        values += [component for one in places for component in one]
    for one in equations.constraints:
        values += [one.rate, *(() if one.value is None else (one.value,))]
    return frozenset(one.name for one in read_by(values, assembly.parameters))


def _other(
    assembly: Assembly, path: str, values: dict[str, float], start: dict[str, float], whole: str = ""
) -> Assembly:
    try:
        return assembly.with_values(values, start=start)
    except AtwoodError as error:
        raise UsageError(
            whole or f"the scene is not sound a little beside its value: {error.message}",
            where=path,
            advice="Leave it out; a sweep runs the scene with other values of it."
            if whole
            else "Move it away from the bound, or leave it out.",
        ) from error


def _start_value(assembly: Assembly, start: Start, path: str) -> Column:
    given = {**assembly.flat.guess, **assembly.flat.start}
    if path not in assembly.start_observables and path not in given:
        assembly.with_values(start={path: 0.0})  # says what there is instead
    observable = assembly.start_observables.get(path)
    unit = "" if observable is None else observable.unit
    value = given[path] if path in given else _observed(assembly, start, path)
    scale = _start_scale(assembly, unit)
    near = cache(lambda share: _other(assembly, path, {}, {path: value + share * scale}))
    if near(SHARES[0]).shared is not assembly.shared:
        raise UsageError("it shapes the equations", where=path, advice="Leave it out; a sweep can vary it.")
    return Column(path, unit, True, value, scale, near, frozenset(), False)


def _observed(assembly: Assembly, start: Start, path: str) -> float:
    """Return the value that a quantity has at the start of itself."""
    program = observer(assembly, (path,))
    q, u = own_state(assembly, start)
    idle = [0.0] * len(assembly.reactions)
    return float(assembly.kernel(program)([start.time], q, u, np.zeros_like(u), idle)[0][0])


def _start_scale(assembly: Assembly, unit: str) -> float:
    """Return the size by which changes of a start value are measured."""
    length = scene_length(assembly)
    fall = math.sqrt(length / assembly.flat.gravity) if assembly.flat.gravity else 1.0
    sizes = {"m": length, "rad": 1.0, "m/s": length / fall, "rad/s": 1.0 / fall}
    return sizes.get(unit, 1.0)
