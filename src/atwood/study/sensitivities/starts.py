"""How a consistent start changes: from the conditions that it meets, where these determine it.

Let the start z meet ``F(z, p) = 0``: the constraints, their rates, the values that are given. Then ``F_z dz = -F_p``.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Expression, Program, jacobian
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.other_values import starting
from atwood.forms.quantities import coordinate_program, to_maximal
from atwood.numerics.matrices import least_norm, or_one
from atwood.numerics.rank import rank
from atwood.simulation.dynamics.scales import coordinate_scales, motion_scales
from atwood.simulation.initialization.start import Start
from atwood.simulation.initialization.system import sort_targets
from atwood.study.sensitivities.columns import SHARES, Column

_SLOPES: Key[tuple[Program, tuple[int, ...], tuple[int, ...]]] = Key("slopes of the conditions of a start")

_MISSED = 1e-9
"""Changes that miss the conditions by more, as a share, are none that these allow."""


def exact_changes(
    assembly: Assembly, start: Start, columns: Sequence[Column], seeds: FloatArray
) -> list[FloatArray | None]:
    """Return the change of coordinates and speeds by each column; None where it does not follow from conditions alone.

    Parameters
    ----------
    assembly, start
        The scene and its start.
    columns
        What it is differentiated by.
    seeds
        The change of each parameter by each column, shape (columns, parameters).
    """
    equations, own = assembly.regular, assembly.own_equations
    levels = sort_targets(assembly, equations)
    fixed = [one for level in levels for one in level.fixed]
    is_known = starting(assembly) is assembly and not (assembly.mechanism.constants or assembly.mechanism.table.origin)
    # Gaps that are closed at the start are conditions, too, and quaternions are not determined by any.
    more = equations.orientation_coordinates or own.orientation_coordinates or equations.contacts or own.contacts
    is_other = assembly.form == "reduced" and own is not equations
    if not is_known or more or is_other or any(one.given for one in fixed):
        return [None] * len(columns)
    conditions = [one.value for one in equations.constraints if one.value is not None]
    conditions += [*(one.rate for one in equations.constraints), *(one.observable.value for one in fixed)]
    slopes, direct = _slopes(assembly, tuple(conditions), start)
    sizes = np.concatenate([one(equations, start.length) for one in (coordinate_scales, motion_scales)])
    scaled = slopes * sizes
    rows = or_one(np.max(np.abs(scaled), axis=1, initial=0.0))
    scaled = scaled / rows[:, None]
    if rank(scaled) < len(sizes):
        return [None] * len(columns)
    places = {one.path: len(conditions) - len(fixed) + k for k, one in enumerate(fixed)}
    found: list[FloatArray | None] = []
    for column, seed in zip(columns, seeds, strict=True):
        right = -(direct @ seed)
        if column.is_start and column.path in places:
            right[places[column.path]] += column.scale
        change = least_norm(scaled, right / rows)
        missed = np.max(np.abs(scaled @ change - right / rows), initial=0.0)
        is_met = missed <= _MISSED * np.max(np.abs(right / rows), initial=0.0)
        is_said = column.path in places if column.is_start else _keeps_values(assembly, column)
        found.append(sizes * change if is_met and is_said else None)
    if assembly.form == "reduced":
        return found
    outputs = to_maximal(assembly, "regular").outputs
    by_state, by_parameters = _slopes(assembly, (*outputs[0].expressions, *outputs[1].expressions), start)
    return [
        None if one is None else by_state @ one + by_parameters @ seed for one, seed in zip(found, seeds, strict=True)
    ]


def _keeps_values(assembly: Assembly, column: Column) -> bool:
    """Return whether start values do not follow a parameter of a model."""
    if column.symbols == {column.path}:
        return True
    near = column.near(SHARES[0]).flat
    return (near.start, near.guess) == (assembly.flat.start, assembly.flat.guess)


def _slopes(assembly: Assembly, expressions: tuple[Expression, ...], start: Start) -> tuple[FloatArray, FloatArray]:
    """Return the derivatives of expressions by coordinates and speeds, and by parameters, at the start."""
    equations, parameters = assembly.regular, assembly.parameters
    n = len(equations.coordinates) + len(equations.speeds)

    def make() -> tuple[Program, tuple[int, ...], tuple[int, ...]]:
        made = jacobian(expressions, [*equations.coordinates, *equations.speeds, *parameters])
        program = coordinate_program(assembly, "slopes at the start", equations, made.entries)
        return program, made.rows, made.columns

    program, rows, columns = assembly.shared.get(_SLOPES, make, expressions)
    found = np.zeros((len(expressions), n + len(parameters)))
    if rows:
        found[list(rows), list(columns)] = assembly.kernel(program)([start.time], start.coordinates, start.speeds)[0]
    return found[:, :n], found[:, n:]
