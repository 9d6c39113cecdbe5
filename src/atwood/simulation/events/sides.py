"""Relations of what moves along a run: what is watched, and which values they have from a state on.

A relation changes where its difference passes zero. Where the motion under the new value would lead straight back, and
under the old one straight on, it stays on the switch (Filippov, Differential Equations with Discontinuous Righthand
Sides, section 4): such a relation is handed back to the laws.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr.core.relations import relation_value
from atwood.forms.assembly import Assembly
from atwood.forms.sides import guards
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.outputs.event_functions import EventFunction
from atwood.simulation.problem.problem import SceneProblem

SIDE = "side"
"""Target of the event that a relation of what moves changes."""

_ROUNDING = 64.0 * float(np.finfo(np.float64).eps)
"""Of the terms of a difference: what is less is zero."""

_AHEAD = 1e-8, 1e-5
"""Of the scene's time: so far ahead it is seen to which side a difference goes, farther where it hardly moves."""

_NEARER = 1e-10, 1e-12
"""So far ahead where it seems to come back: a steep law may have turned the motion by then."""


@dataclass(frozen=True, eq=False)
class Found:
    """Values of relations.

    Attributes
    ----------
    values
        From the state on; where it stays on a switch, those at the state itself.
    stuck
        Numbers of the relations on whose switch the motion stays, or of which it cannot be told.
    """

    values: tuple[float, ...]
    stuck: frozenset[int]


def side_functions(assembly: Assembly) -> tuple[EventFunction, ...]:
    """Return what tells that relations of what moves change."""
    says = "a law goes on with its other branch"
    return tuple(EventFunction("", str(i), one, 0, SIDE, says, "1", False) for i, one in guards(assembly))


def plain_sides(assembly: Assembly, t: float, q: FloatArray, u: FloatArray) -> tuple[float, ...]:
    """Return the values of the relations at a state, as it is; those that the laws have are kept."""
    return _Reader(assembly).at(t, q, u, assembly.side_values)


def find_sides(
    plan: SceneProblem, t: float, q: FloatArray, u: FloatArray, before: Sequence[float], changed: Collection[int]
) -> Found:
    """Return the values of the relations from a state on."""
    sides = plan.assembly.sides
    assert sides is not None
    reader = _Reader(plan.assembly)
    values = reader.at(t, q, u, before)
    differences, sizes = reader.differences(t, q, u, values)
    zero = np.abs(differences) <= _ROUNDING * sizes
    near = [i for i in range(len(values)) if (zero[i] or i in changed) and i not in sides.handed]
    if not near:
        return Found(values, frozenset())
    passed = tuple(reader.other(i, before[i], differences[i]) if i in changed else x for i, x in enumerate(values))

    def look(share: float) -> tuple[tuple[float, ...], list[int], list[int]]:
        tried = [passed]
        while True:
            ahead, undecided = _ahead(plan, reader, (t, q, u), tried[-1], near, share * plan.scales.time)
            stuck = undecided or [i for i in near if ahead[i] != tried[-1][i]]
            if undecided or ahead in tried:
                return ahead, stuck, undecided
            tried.append(ahead)

    for share in _AHEAD:
        ahead, stuck, undecided = look(share)
        if not undecided:
            break
    nearer = (look(share) for share in _NEARER if stuck and not undecided)
    ahead, left = next(((there, again) for there, again, _ in nearer if not again), (ahead, stuck))
    return Found(values if left else ahead, frozenset(left))


def _ahead(
    plan: SceneProblem,
    reader: _Reader,
    state: tuple[float, FloatArray, FloatArray],
    values: tuple[float, ...],
    near: list[int],
    step: float,
) -> tuple[tuple[float, ...], list[int]]:
    """Return which values some relations have a little later, if they have some until then; and what stays at zero."""
    now = plan.in_piece(replace(plan.assembly, side_values=values))
    t, q, u = state
    accelerations, _ = now.balance.accelerate(t, q, u, plan.kept)
    half = now.balance.kinematic_map.rates(t, q, u + 0.5 * step * accelerations)
    there = t + step, q + step * half, u + step * accelerations
    differences, sizes = reader.differences(*there, values)
    at_zero = np.abs(differences) <= _ROUNDING * sizes
    found = list(values)
    for i in near:
        found[i] = relation_value(reader.kinds[i], float(differences[i]))
    return tuple(found), [i for i in near if at_zero[i] and reader.kinds[i] != "floor"]


def layers(plan: SceneProblem, t: float, q: FloatArray, u: FloatArray, absolute: FloatArray) -> list[float]:
    """Return by how much each difference is off where a state is off by its absolute tolerances."""
    reader, n = _Reader(plan.assembly), len(q)
    values = plan.assembly.side_values

    def read(y: FloatArray) -> FloatArray:
        return reader.differences(t, y[:n], y[n:], values)[0]

    y = np.concatenate([q, u])
    moved = np.array([read(y + step) - read(y) for step in np.diag(absolute[: len(y)])])
    return [float(x) for x in np.sum(np.abs(moved), axis=0)]


class _Reader:
    """Reads the differences of relations."""

    def __init__(self, assembly: Assembly) -> None:
        sides = assembly.sides
        assert sides is not None
        self.kinds = [one.kind for one in sides.relations]
        own = set(sides.symbols)
        kept = [symbol not in own for symbol in assembly.parameters]
        self.handed = sides.handed
        self._kernel = assembly.compiled(sides.program(assembly)).bind(assembly.parameter_values[kept])

    def differences(
        self, t: float, q: FloatArray, u: FloatArray, values: Sequence[float]
    ) -> tuple[FloatArray, FloatArray]:
        """Return the differences and the sizes of their terms."""
        differences, sizes = self._kernel([t], q, u, values)
        return np.asarray(differences, dtype=float), np.asarray(sizes, dtype=float)

    def at(self, t: float, q: FloatArray, u: FloatArray, values: Sequence[float]) -> tuple[float, ...]:
        """Return the values at a state; a relation may read those before it."""
        known = tuple(values)
        for _ in range(len(known) + 1):
            differences, _ = self.differences(t, q, u, known)
            found = (relation_value(*one) for one in zip(self.kinds, differences.tolist(), strict=True))
            now = tuple(known[i] if i in self.handed else value for i, value in enumerate(found))
            if now == known:
                break
            known = now
        return known

    def other(self, number: int, value: float, difference: float) -> float:
        """Return the value on the other side of a switch."""
        if self.kinds[number] == "floor":
            return value + 1.0 if difference > value + 0.5 else value - 1.0
        return -value if self.kinds[number] == "sign" else 1.0 - value
