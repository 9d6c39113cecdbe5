"""Accelerations and reactions along a run, for many states at once.

Reactions come from the balance of forces in maximal coordinates, where every joint is a constraint, at the positions
and velocities of either form. Reactions that laws of force read must be determined, as far as the laws depend on them.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.errors import SolveError, UnsupportedError
from atwood.expr import Expression, Program, depends_on, evaluate
from atwood.forms.accelerations import accelerations_of
from atwood.forms.assembly import Assembly, FormName
from atwood.forms.balance_program import BalanceProgram
from atwood.forms.caches import Key
from atwood.forms.quantities import coordinate_program, internal_reactions_of, to_maximal
from atwood.lazy_dataclasses import dataclass
from atwood.numerics.matrices import is_best_full, least_size, or_one, solve_even, to_array
from atwood.numerics.rank import decompose
from atwood.simulation.dynamics.balance import Balance, balance_of, bordered, masses_at
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of
from atwood.simulation.dynamics.redundancy import RankFinding, find_rank, kept_along
from atwood.simulation.dynamics.scales import coordinate_scales, motion_scales, multiplier_sizes, scene_length
from atwood.tolerances import tolerances

if TYPE_CHECKING:
    from atwood.simulation.dynamics.sparse_states import States

_CHUNK = 4_000_000
"""Numbers in the matrices that are solved at once."""


def maximal_state(assembly: Assembly, t: FloatArray, q: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return maximal coordinates and speeds, each of shape (number, samples), from those of the form."""
    if assembly.form == "dae":
        return q, u
    big_q, big_u = assembly.kernel(to_maximal(assembly), vectorized=True)(t[None, :], q, u)
    return kinematic_map_of(assembly, "dae").normalized(big_q), big_u


def accelerations_and_multipliers(
    assembly: Assembly, form: FormName, t: FloatArray, q: FloatArray, u: FloatArray, kept: NDArray[np.intp]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Solve the balance of forces for many states, with the multipliers of all constraints."""
    program = assembly.balance(form)
    values = assembly.kernel(program.program, vectorized=True)(t[None, :], q, u)
    a, multipliers = _solved(assembly, form, (t, q, u), kept, values)
    if len(kept) < program.constraints:
        multipliers = _of_least_size(assembly, form, kept, values[5], multipliers)
    return a, multipliers, np.asarray(values[6])


def accelerations_at(
    assembly: Assembly,
    form: FormName,
    t: FloatArray,
    q: FloatArray,
    u: FloatArray,
    kept: NDArray[np.intp],
    kernel: Callable[..., tuple[FloatArray, ...]] | None = None,
) -> FloatArray:
    """Return the accelerations alone, perhaps with a kernel of the balance; see `accelerations_and_multipliers`."""
    call = kernel or assembly.kernel(assembly.balance(form).program, vectorized=True)
    values = call(t[None, :], q, u)
    return _solved(assembly, form, (t, q, u), kept, values)[0]


_UNITS: Key[FloatArray] = Key("size of a displacement along each speed of a balance")
_STATES: Key[States] = Key("balance of forces at many states")


def _states(assembly: Assembly, form: FormName, kept: NDArray[np.intp]) -> States:
    chosen = tuple(kept.tolist())
    from atwood.simulation.dynamics.sparse_states import States

    return assembly.shared.get(_STATES, lambda: States(assembly.balance(form), chosen), form, chosen)


def _is_full(program: BalanceProgram) -> bool:
    return program.mass_product is not None or is_best_full((program.speeds,) * 2, len(program.mass_rows), many=True)


def _of_least_size(
    assembly: Assembly, form: FormName, kept: NDArray[np.intp], jacobian: FloatArray, multipliers: FloatArray
) -> FloatArray:
    """Return the multipliers of all constraints from those of the independent ones, shape (constraints, samples)."""
    program, samples = assembly.balance(form), jacobian.shape[1]
    # Forces, and moments divided by a length, along displacements and rotations times a length.
    sizes = multiplier_sizes(assembly, form)[:, None]
    columns = motion_scales(assembly.in_coordinates(form), scene_length(assembly))[:, None]
    even, forces = (
        jacobian * sizes[program.jacobian_rows] * columns[program.jacobian_columns],
        multipliers / sizes[kept],
    )
    if not _is_full(program):
        return _states(assembly, form, kept).least_size(even, forces) * sizes
    found = np.full((program.constraints, samples), np.nan)
    known = np.flatnonzero(np.all(np.isfinite(even), axis=0) & np.all(np.isfinite(forces), axis=0))
    step = max(1, _CHUNK // (program.constraints * program.speeds))
    for first in range(0, len(known), step):
        part = known[first : first + step]
        full = np.zeros((len(part), program.constraints, program.speeds))
        full[:, program.jacobian_rows, program.jacobian_columns] = even[:, part].T
        found[:, part] = least_size(full, kept, forces[:, part].T).T
    return found * sizes


def _solved(
    assembly: Assembly,
    form: FormName,
    state: tuple[FloatArray, FloatArray, FloatArray],
    kept: NDArray[np.intp],
    values: tuple[FloatArray, ...],
) -> tuple[FloatArray, FloatArray]:
    """Return accelerations and the multipliers of the independent constraints."""
    program, (t, q, u) = assembly.balance(form), state
    mass, bias, _, _, gamma, jacobian, _ = values
    # Along displacements and rotations of like size, and with forces of the size of masses, so that no unit has a say.
    units = assembly.kept.get(
        _UNITS, lambda: motion_scales(assembly.in_coordinates(form), scene_length(assembly)), form
    )
    step = max(1, _CHUNK // max(1, program.speeds**2))
    if program.mass_product is not None and len(t) > step:
        parts = [slice(first, first + step) for first in range(0, len(t), step)]
        some = [
            _solved(assembly, form, (t[part], q[:, part], u[:, part]), kept, tuple(one[:, part] for one in values))
            for part in parts
        ]
        return np.concatenate([one[0] for one in some], axis=1), np.concatenate([one[1] for one in some], axis=1)
    if program.mass_product is not None:
        mass = np.moveaxis(masses_at(assembly, t, q.T, u.T, assembly.parameter_values), 0, -1)
        mass = mass.reshape(program.speeds**2, -1) * np.outer(units, units).reshape(-1, 1)
    else:
        mass = mass * (units[program.mass_rows] * units[program.mass_columns])[:, None]
    jacobian = jacobian * units[program.jacobian_columns][:, None]
    forces = _force_sizes(program, mass, jacobian)
    jacobian, gamma = jacobian * forces[program.jacobian_rows], gamma * forces
    even = mass, bias * units[:, None], gamma, jacobian
    if _is_full(program):
        a, multipliers = _solved_full(program, kept, len(t), even)
    else:
        a, multipliers = _states(assembly, form, kept).solve(t, even)
    return a * units[:, None], multipliers * forces[kept]


def _force_sizes(program: BalanceProgram, mass: FloatArray, jacobian: FloatArray) -> FloatArray:
    """Return by how much to multiply each constraint so that its row is of the size of masses, (number, samples)."""
    sizes = np.zeros((program.constraints, jacobian.shape[1]))
    places = np.asarray(program.jacobian_rows, dtype=np.intp)
    if len(places):
        order = np.argsort(places, kind="stable")
        filled, starts = np.unique(places[order], return_index=True)
        sizes[filled] = np.maximum.reduceat(np.abs(jacobian[order]), starts, axis=0)
    largest = np.max(np.abs(mass), axis=0, initial=0.0)
    return or_one(largest / or_one(sizes))


def _solved_full(
    program: BalanceProgram, kept: NDArray[np.intp], samples: int, values: tuple[FloatArray, ...]
) -> tuple[FloatArray, FloatArray]:
    """Return what `_solved` does, from mass, bias, gamma and Jacobian, with dense matrices."""
    n, m = program.speeds, program.constraints
    mass, bias, gamma, jacobian = values
    found_a, found_l = np.zeros((n, samples)), np.zeros((len(kept), samples))
    size = n + len(kept)
    step = max(1, _CHUNK // max(1, size * size))
    for first in range(0, samples, step):
        part = slice(first, min(first + step, samples))
        count = part.stop - part.start
        full_mass = np.zeros((count, n, n))
        if program.mass_product is not None:
            full_mass[:] = mass[:, part].T.reshape(count, n, n)
        else:
            full_mass[:, program.mass_rows, program.mass_columns] = mass[:, part].T
        full_jacobian = np.zeros((count, m, n))
        full_jacobian[:, program.jacobian_rows, program.jacobian_columns] = jacobian[:, part].T
        right = -np.concatenate([bias[:, part].T, gamma[kept][:, part].T], axis=1)
        try:
            solved = solve_even(bordered(full_mass, full_jacobian[:, kept]), right)
        except np.linalg.LinAlgError:
            raise SolveError(
                "the forces do not determine the accelerations somewhere along the run",
                advice="The mechanism passes a singular position exactly, or something without mass is free.",
            ) from None
        found_a[:, part] = solved[:, :n].T
        found_l[:, part] = solved[:, n:].T
    return found_a, found_l


@dataclass(frozen=True, eq=False)
class BalanceAlong:
    """The balance of forces at many states, in maximal coordinates; shapes (number, samples).

    Attributes
    ----------
    coordinates, speeds, accelerations
        The motion.
    multipliers
        Of all constraints; where these depend on each other, those of least size.
    powers
        What each constraint puts in, W: minus its multiplier times the explicit part of its rate.
    """

    coordinates: FloatArray
    speeds: FloatArray
    accelerations: FloatArray
    multipliers: FloatArray
    powers: FloatArray


class ReactionSolver:
    """Reactions of one assembled mode.

    Parameters
    ----------
    assembly
        The scene.
    t, q, u
        A state in the coordinates of the form, at which the rank of the constraints is decided.
    """

    def __init__(self, assembly: Assembly, t: float, q: FloatArray, u: FloatArray) -> None:
        self.assembly = assembly
        big_q, _ = maximal_state(assembly, np.array([t]), q[:, None], u[:, None])
        self._length = scene_length(assembly)
        sizes = motion_scales(assembly.maximal, self._length)
        self.finding = find_rank(balance_of(assembly, "dae"), t, big_q[:, 0], sizes)
        self._of_constraint = {one.key: i for i, one in enumerate(assembly.maximal.constraints)}
        self._internal_reactions = internal_reactions_of(assembly)

    def for_rows(self, rows: FloatArray) -> ReactionSolver:
        """Return the same for states that have parameters of their own, where no constraint is redundant."""
        twin = copy.copy(self)
        twin.assembly = self.assembly.with_rows(rows)
        return twin

    def at(self, t: FloatArray, q: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return all reactions, of shape (number, samples), and the power of constraints that move with time."""
        assembly, now = self.assembly, self.balance_along(t, q, u)
        big_q, big_u, a, multipliers = now.coordinates, now.speeds, now.accelerations, now.multipliers
        values = np.zeros((len(assembly.reactions), len(t)))
        internal = None
        if self._internal_reactions is not None:
            kernel = assembly.kernel(self._internal_reactions.program, vectorized=True)
            (internal,) = kernel(t[None, :], big_q, big_u, a, multipliers)
        for i, reaction in enumerate(assembly.reactions):
            if reaction.axis >= 0:
                rows = {} if self._internal_reactions is None else self._internal_reactions.rows
                # Where another rigid connection shares the load, no share is known.
                values[i] = internal[rows[reaction.path]] if internal is not None and reaction.path in rows else np.nan
            elif reaction.key in self._of_constraint:
                values[i] = reaction.sign * multipliers[self._of_constraint[reaction.key]]
        return values, np.sum(now.powers, axis=0) if len(multipliers) else np.zeros(len(t))

    def balance_along(self, t: FloatArray, q: FloatArray, u: FloatArray) -> BalanceAlong:
        """Return what balances the forces at many states, in maximal coordinates."""
        big_q, big_u = maximal_state(self.assembly, t, q, u)
        found = [
            accelerations_and_multipliers(self.assembly, "dae", t[part], big_q[:, part], big_u[:, part], kept)
            for part, kept in self._kept_along(self.finding, "dae", t, big_q)
        ]
        a, multipliers, explicit_rate = (np.concatenate(each, axis=1) for each in zip(*found, strict=True))
        return BalanceAlong(big_q, big_u, a, multipliers, -multipliers * explicit_rate)

    def _kept_along(
        self, finding: RankFinding, form: FormName, t: FloatArray, q: FloatArray
    ) -> list[tuple[slice, NDArray[np.intp]]]:
        if not finding.redundant:
            return [(slice(None), np.asarray(finding.kept, dtype=np.intp))]
        equations, balance = self.assembly.in_coordinates(form), balance_of(self.assembly, form)
        scales, sizes = motion_scales(equations, self._length), coordinate_scales(equations, self._length)
        return kept_along(finding, balance, t, q, scales, sizes)

    def own_accelerations(self, t: FloatArray, q: FloatArray, u: FloatArray, finding: RankFinding) -> FloatArray:
        """Return the accelerations of the form's coordinates, with what is known of its constraints."""
        if self.assembly.form == "reduced" and self.assembly.balance("reduced").mass_product is not None:
            rates = accelerations_of(self.assembly)
            if rates is not None:
                return np.asarray(self.assembly.kernel(rates.program, vectorized=True)(t[None, :], q, u)[-1])
        form = self.assembly.form
        parts = [
            accelerations_at(self.assembly, form, t[part], q[:, part], u[:, part], kept)
            for part, kept in self._kept_along(finding, form, t, q)
        ]
        return np.concatenate(parts, axis=1)


_TRIALS = 3
"""So many multipliers at random are tried."""

_NEARLY, _OFF = 1e-3, 1e-3
"""Where rows repeat others but for less, what formulas give for them is looked at; what is off by more of the largest
is refused."""

_TOLD: Key[Program] = Key("reactions that are read")

_MOST = 300
"""With more constraints no decomposition is made."""

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
    _check_formulas(assembly, (t, q, u), balance, big_q, scales, len(finding.kept))
    if not finding.redundant:
        return
    open_ways = _balancing(balance, t, big_q, scales, len(finding.kept))
    known = dict(zip(assembly.parameters, assembly.parameter_values.tolist(), strict=True)) | {maximal.time: t}
    known |= dict(zip((*maximal.coordinates, *maximal.speeds), (*big_q, *big_u), strict=True))
    known |= dict.fromkeys(maximal.accelerations, 0.0)
    if _depend_on(assembly, known, scales, open_ways):
        raise _not_determined(assembly, open_ways.in_units)


def _check_formulas(
    assembly: Assembly,
    state: tuple[float, FloatArray, FloatArray],
    balance: Balance,
    big_q: FloatArray,
    scales: FloatArray,
    rank: int,
) -> None:
    """Refuse reactions that formulas do not give, since rows nearly repeat others: they add a share to what does."""
    t, q, u = state
    now = balance.constraints_at(t, big_q, np.zeros_like(scales))
    rows = balance.row_scales(now, t, big_q, scales)
    number = {symbol: i for i, symbol in enumerate(assembly.maximal.multipliers)}
    own = assembly.own_equations
    asked = [symbol for symbol in own.read if symbol in number]
    if not asked or len(rows) > _MOST:
        return
    found = decompose(to_array(now.jacobian) * scales / rows[:, None], rank=rank)
    if not rank or found.values[rank - 1] > _NEARLY * found.values[0]:
        return
    program = assembly.shared.get(
        _TOLD, lambda: coordinate_program(assembly, _TOLD.name, own, [own.read[x] for x in asked])
    )
    (told,) = assembly.kernel(program)([t], q, u)
    along = ReactionSolver(assembly, t, q, u).balance_along(np.array([t]), q[:, None], u[:, None])
    multipliers, places = along.multipliers[:, 0] * rows, [number[x] for x in asked]
    open_rows = np.max(np.abs(found.left_null_space), axis=1, initial=0.0)[places] > tolerances.FREE
    off = np.where(open_rows, 0.0, np.abs(np.array(told) * rows[places] - multipliers[places]))
    worst = int(np.argmax(off))
    if off[worst] > _OFF * np.max(np.abs(multipliers)):
        one = assembly.maximal.constraints[places[worst]]
        raise UnsupportedError(
            f"a force reads a reaction that is {along.multipliers[places[worst], 0]:.4g} here, and formulas give "
            f"{told[worst]:.4g}: others hold all but next to nothing of what it holds",
            where=one.key[0],
            advice="Move it away from the joint next to it, or leave one of them out, or let no force read it.",
        )


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
        return np.asarray(units * np.array(evaluate(values, {**known, **numbers})))

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
