"""Reactions that laws of force read must be determined, as far as the laws depend on them."""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import UnsupportedError
from atwood.expr import Expression, depends_on, evaluate
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.numerics.matrices import to_array
from atwood.numerics.rank import decompose
from atwood.simulation.dynamics.balance import Balance, balance_of
from atwood.simulation.dynamics.reactions import maximal_state
from atwood.simulation.dynamics.redundancy import find_rank
from atwood.simulation.dynamics.scales import motion_scales
from atwood.tolerances import tolerances

_TRIALS = 3
"""So many multipliers at random are tried."""

_SHOWN = 6
"""So many constraints are named."""


def check_read_reactions(assembly: Assembly, t: float, q: FloatArray, u: FloatArray, length: float) -> None:
    """Refuse a scene with redundant constraints in which a force depends on what these leave open.

    Reactions of redundant constraints are determined up to those that balance each other: a null vector of the
    transposed constraint Jacobian. A force may read what these do not change, such as the force of a hinge within the
    plane of its loop.
    """
    if not assembly.own_equations.read:
        return
    maximal, balance = assembly.maximal, balance_of(assembly, "dae")
    big_q, big_u = (one[:, 0] for one in maximal_state(assembly, np.array([t]), q[:, None], u[:, None]))
    scales = motion_scales(maximal, length)
    finding = find_rank(balance, t, big_q, scales)
    if not finding.redundant:
        return
    open_ways = _balancing(balance, t, big_q, scales, len(finding.kept))
    known = dict(zip(assembly.parameters, assembly.parameter_values.tolist(), strict=True)) | {maximal.time: t}
    known |= dict(zip((*maximal.coordinates, *maximal.speeds), (*big_q, *big_u), strict=True))
    known |= dict.fromkeys(maximal.accelerations, 0.0)
    if _depend_on(assembly, known, scales, open_ways):
        raise _not_determined(assembly, open_ways.in_units)


@dataclass(frozen=True, eq=False)
class _OpenWays:
    """How multipliers can change and still balance each other.

    Attributes
    ----------
    in_units
        Orthonormal, with each multiplier in units of its constraint, shape (constraints, ways).
    units
        What one unit of each multiplier is, shape (constraints,).
    motions
        Speeds that the constraints allow, each of the size of its scale, shape (speeds, motions).
    """

    in_units: FloatArray
    units: FloatArray
    motions: FloatArray


def _balancing(balance: Balance, t: float, q: FloatArray, scales: FloatArray, rank: int) -> _OpenWays:
    now = balance.constraints_at(t, q, np.zeros_like(scales))
    rows = balance.row_scales(now, t, q, scales)
    found = decompose(to_array(now.jacobian) * scales / rows[:, None], rank=rank)
    return _OpenWays(found.left_null_space, 1.0 / rows, scales[:, None] * found.null_space)


def _depend_on(assembly: Assembly, known: dict[Expression, float], scales: FloatArray, ways: _OpenWays) -> bool:
    """Return whether forces, or rates of states, change with what redundant constraints leave open."""
    maximal, read = assembly.maximal, list(assembly.maximal.read)
    used = [i for i, row in enumerate(maximal.rows_with_multipliers) if depends_on(row, read)]
    rates = [rate for rate in maximal.rates_with_multipliers if depends_on(rate, read)]
    values = [*(maximal.rows_with_multipliers[i] for i in used), *rates]
    units = np.array([*(scales[i] for i in used), *(1.0 for _ in rates)])
    count, open_count = ways.in_units.shape
    now = np.array([known[speed] for speed in maximal.speeds])
    chance = np.random.default_rng(1)

    def at(multipliers: FloatArray) -> FloatArray:
        numbers = dict(zip(maximal.multipliers, (multipliers * ways.units).tolist(), strict=True))
        numbers |= dict(zip(maximal.speeds, speeds.tolist(), strict=True))
        found: FloatArray = units * np.array(evaluate(values, {**known, **numbers}))
        return found

    for _ in range(_TRIALS):
        size = 10.0 ** chance.uniform(-2.0, 2.0)
        # Also other speeds than those of the start: from rest on, friction reads nothing yet.
        speeds = now + ways.motions @ chance.normal(size=ways.motions.shape[1])
        first, other = size * chance.normal(size=(2, count))
        changes = np.abs([at(first + size * (ways.in_units @ chance.normal(size=open_count))), at(other)] - at(first))
        forces, alone = changes[:, : len(used)].max(axis=1, initial=0.0), changes[:, len(used) :]
        if forces[0] > tolerances.FREE * forces[1] or np.any(alone[0] > tolerances.FREE * alone[1]):
            return True
    return False


def _not_determined(assembly: Assembly, ways: FloatArray) -> UnsupportedError:
    """Return the error with the reactions that are read and not determined, and the constraints that share them."""
    constraints, read = assembly.maximal.constraints, assembly.maximal.read
    shared = np.abs(ways @ ways.T) > tolerances.FREE
    asked = [i for i, one in enumerate(constraints) if one.multiplier in read and shared[i, i]]
    names = [f"{constraints[i].key[0]}.{constraints[i].reaction}" for i in asked]
    others = [one.label for j, one in enumerate(constraints) if np.any(shared[asked, j])]
    more = f" and {len(others) - _SHOWN} more" if len(others) > _SHOWN else ""
    return UnsupportedError(
        f"a force depends on {', '.join(names)}, which is not determined: redundant constraints share the load in any "
        f"way ({', '.join(others[:_SHOWN])}{more})",
        where=constraints[asked[0]].key[0],
        advice="Read what they determine, such as a hinge's force within the plane of its loop; or replace a joint by "
        "one that leaves free what other joints already constrain, as a Spherical for a Pivot.",
    )
