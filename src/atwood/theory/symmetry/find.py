"""What is conserved along the motions of a scene, and why the rest is not.

A quantity C with ``dC/dt = sum w_k (row_k - G^T lambda)_k``, identically in all coordinates, velocities, accelerations
and multipliers, is conserved: the rows are zero along motions. The displacements w are the symmetry that belongs to it
(Noether; Goldstein, section 13.7, and Landau and Lifshitz, Mechanics, chapter 2). Where this identity is too long to be
brought to a normal form, rates are looked at at random states.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Expression, depends_on, evaluate
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.outputs.totals import add_up
from atwood.numerics.matrices import least_norm, or_one
from atwood.simulation.dynamics.orientation_coordinates import COORDINATE_SWITCH
from atwood.simulation.events.modes import find_event_functions
from atwood.theory.symmetry.ansatz import Integral, find_integrals
from atwood.theory.symmetry.contacts import Push, Pushes
from atwood.theory.symmetry.proof import Generator, Proof, Prover
from atwood.theory.symmetry.quantities import (
    Quantities,
    about_center,
    axis_name,
    axis_text,
    conserved_directions,
    is_constant,
    is_kept,
    planar_point,
    readable_basis,
    rotations_of,
    straight_of,
)
from atwood.theory.symmetry.states import KEPT, RandomStates, State

_FEW = 24
"""Up to so many velocities each momentum is looked at; beyond, those whose force is zero as it is written."""

_FAR = 10.0
"""In sizes of the scene: beyond that far from the origin, angular momenta are compared about the middle of it."""

_INTEGRALS = {
    "first": ("C", "affine symmetry", "integral of a symmetry that is affine in the coordinates"),
    "time": ("C", "symmetry in time", "integral of a symmetry with coefficients in time"),
    "second": (
        "A",
        "quadratic in momenta",
        "integral of second order in the momenta, as those of Laplace, Runge and Lenz",
    ),
}
"""What integrals of an ansatz are called."""

_STATES = 24
"""At so many states it is looked whether gaps and slips leave a quantity alone."""

_ALIKE = 1e-11
"""Relative to the largest: values of one quantity, computed in two ways."""


@dataclass(frozen=True, eq=False)
class Finding:
    """A conserved quantity.

    Attributes
    ----------
    name
        Such as ``"h"``, ``"p:rail.displacement"``, ``"P.x"``, ``"L.z"``, ``"K.x"``.
    kind
        What it is conserved by.
    unit, meaning
        Its SI unit, and what it is in words.
    value
        The quantity, on the symbols of the scene's Lagrangian.
    proven
        Whether it is proven on the graph.
    evidence
        How it is known, in words.
    direction, point
        Of a total momentum: its direction in world axes, and of an angular momentum a point of the axis, m.
    """

    name: str
    kind: str
    unit: str
    meaning: str
    value: Expression
    proven: bool
    evidence: str
    direction: tuple[float, ...]
    point: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Findings:
    """What was found.

    Attributes
    ----------
    items
        The conserved quantities.
    notes
        What is not conserved, and what the findings depend on.
    """

    items: tuple[Finding, ...]
    notes: tuple[str, ...]


def find_conserved(assembly: Assembly, quantities: Quantities, prover: Prover, pushes: Sequence[Push] = ()) -> Findings:
    """Return what is conserved along all motions of a scene, with what gaps and slips may do besides."""
    if not pushes:
        return _Search(assembly, quantities, prover).run()
    acting = Pushes(assembly, pushes)
    return _through_contacts(quantities, prover, _Search(assembly, quantities, prover, acting).run(), acting)


def _through_contacts(quantities: Quantities, prover: Prover, found: Findings, acting: Pushes) -> Findings:
    """Return what gaps and slips leave conserved, and why the rest is not."""
    values = quantities.on_speeds([one.value for one in found.items])
    states = RandomStates(quantities.assembly, values).draw(_STATES, quantities.center[1]) if values else []
    kept: list[Finding] = []
    notes = list(found.notes)
    for number, one in enumerate(found.items):
        if one.kind in ("energy function", "total energy"):
            losing = next((push for push in acting.pushes if push.takes_energy), None)
            if losing is None and one.kind == "energy function":
                kept.append(replace(one, evidence=f"{one.evidence}; impacts keep it, since restitution is 1"))
            else:
                why = f"{losing.path}: {losing.takes_energy}" if losing else "what moves does work in impacts"
                notes.append(f"{one.name} ({one.meaning}) is conserved between events alone: {why}")
            continue
        by = acting.changed(states, number) if states else acting.pushes[0].path
        if by:
            notes.append(f"{one.name} ({one.meaning}) is conserved as long as {by} does not act")
            continue
        proof = acting.proof(prover, states, number)
        how = "proven" if proof else f"checked at {len(states)} random states"
        is_proven, evidence = one.proven and bool(proof), f"{one.evidence}; that contacts leave it is {how}"
        kept.append(replace(one, proven=is_proven, evidence=evidence))
    notes.append("in every set of contacts, and through impacts")
    return Findings(tuple(kept), tuple(notes))


class _Search:
    """The candidates of one scene, and the states that they are looked at."""

    def __init__(
        self, assembly: Assembly, quantities: Quantities, prover: Prover, acting: Pushes | None = None
    ) -> None:
        self.assembly, self.quantities, self.prover, self.acting = assembly, quantities, prover, acting
        self.found = quantities.found
        self.items: list[Finding] = []
        self.notes: list[str] = []
        self._columns: list[FloatArray] = []  # values at the states of what was found, less their mean
        self._values: list[Expression] = []
        self.states: list[State] = []
        self._plain: list[State] = []  # without what gaps and slips do

    def add(self, values: Sequence[Expression]) -> list[int]:
        """Note quantities that are to be looked at; return their numbers."""
        first = len(self._values)
        self._values += values
        return list(range(first, len(self._values)))

    def run(self) -> Findings:
        """Return what is found."""
        found, q = self.found, self.quantities
        [energy, total] = self.add([q.energy_function, q.total_energy])
        plain = [k for k, place in enumerate(found.moves) if place is not None and self._may_be_ignorable(k)]
        momenta = self.add([q.momenta[k] for k in plain])
        spins = [
            (one.body, self.add([q.momenta[k] for k in one.speeds]), list(one.speeds))
            for one in found.equations.orientation_coordinates
            if one.kind == "quaternion" and len(one.speeds) == 3
        ]
        motions = q.motions
        linear, angular = self.add(motions.momentum), self.add(motions.angular_momentum)
        moments = self.add(motions.moments)
        rolls = not all(one.holonomic for one in self.assembly.reduced.constraints) or found.is_restricted
        rolling = [(body, self.add(values)) for body, values in motions.spins.items() if rolls]
        states = RandomStates(self.assembly, q.on_speeds(self._values))
        count = max(12, len(found.velocities) + 6) if len(found.velocities) <= _FEW else 12
        self.states = states.draw(count, q.center[1])
        if not self.states:
            self.notes.append(f"nothing could be checked at random states near its start: {states.reason}")
            return Findings((), tuple(self.notes))
        self._plain = self.states
        if self.acting is not None:  # combinations are looked for that gaps and slips leave alone
            self.states = [*self._plain, *self.acting.on(self._plain)]
        self._energy(energy, total, states.is_plain)
        for number, k in zip(momenta, plain, strict=True):
            self._momentum(number, k)
        for body, numbers, speeds in spins:
            self._spins(body, numbers, speeds)
        self._totals(linear, angular, moments)
        for body, numbers in rolling:
            self._rolling(body, numbers)
        for one in find_integrals(q, self.prover, self.states, [item.value for item in self.items]):
            self._integral(one)
        self._caveats()
        return Findings(tuple(self.items), tuple(self.notes))

    # -- one after the other ------------------------------------------------------------------------------------------

    def _may_be_ignorable(self, k: int) -> bool:
        found = self.found
        if len(found.velocities) <= _FEW:
            return True
        place = found.moves[k]
        assert place is not None
        return not depends_on(found.rows[k], [found.coordinates[place]])

    def _energy(self, number: int, total: int, is_plain: bool) -> None:
        value, found = self.quantities.energy_function, self.found
        kept = is_kept(self._plain, number)
        # Of functions that are set free, that and their integrals need not belong together any more.
        proven = Proof.NONE
        if kept or not is_plain:
            proven = self.prover.along(value, dict(enumerate(found.velocities)), with_rates=True)
        if not proven and not kept:
            worst = max(self._plain, key=lambda one: abs(one.rates[total]) / (one.terms[total] or 1.0))
            told = "neither the energy function h nor T + V is conserved"
            if is_kept(self._plain, total):
                self._take("T + V", "total energy", "J", "T + V", self.quantities.total_energy, Proof.NONE, total)
                told = "the energy function h is not conserved, T + V is"
            else:
                told += f": at t = {worst.t:.3g} s, at a random state, T + V changes at {worst.rates[total]:.3g} W"
            self.notes.append(told)
            return
        size = max(abs(one.values[total]) for one in self._plain)
        alike = self.prover.is_zero(value - self.quantities.total_energy) or all(
            abs(one.values[number] - one.values[total]) <= _ALIKE * size for one in self._plain
        )
        if alike:
            meaning = "energy function h = T + V"
        else:
            rest = "T + V is conserved, too" if is_kept(self._plain, total) else "T + V is not conserved"
            meaning = f"energy function h (Jacobi integral), not T + V; {rest}"
        self._take("h", "energy function", "J", meaning, value, proven, number)

    def _momentum(self, number: int, k: int) -> None:
        found = self.found
        place = found.moves[k]
        assert place is not None
        name, value = found.names[place], self.quantities.momenta[k]
        rotates = name.unit != "m"
        silent = is_constant(np.array([one.values[number] for one in self.states]))
        if is_kept(self.states, number) and not silent:
            proven = self.prover.along(value, {k: found.graph.one})
            unit = "kg*m^2/s" if rotates else "kg*m/s"
            meaning = f"momentum of {name.name}, which is ignorable"
            self._take(f"p:{name.name}", "ignorable coordinate", unit, meaning, value, proven, number)

    def _own(self, numbers: Sequence[int], values: Sequence[Expression]) -> Iterator[tuple[Any, Any, Any]]:
        """Yield the axes about which the angular momentum of a body is kept, with it as a formula and in numbers."""
        kept = conserved_directions(self.states, numbers, np.ones(3))
        for axis in readable_basis(kept).T if kept.shape[1] else ():
            value, numeric = self._combined(axis, values, numbers)
            if not self._is_known(numeric):
                yield axis, value, numeric

    def _spins(self, body: str, numbers: Sequence[int], speeds: Sequence[int]) -> None:
        for axis, value, numeric in self._own(numbers, [self.quantities.momenta[k] for k in speeds]):
            weights = dict(zip(speeds, map(self.found.graph.constant, axis), strict=True))
            meaning = f"angular momentum about the axis {axis_text(axis)} of {body}"
            name, proven = f"spin:{body}" + axis_name(axis), self.prover.along(value, weights)
            self._take(name, "symmetric body", "kg*m^2/s", meaning, value, proven, numeric, tuple(map(float, axis)))

    def _rolling(self, body: str, numbers: Sequence[int]) -> None:
        for axis, value, numeric in self._own(numbers, self.quantities.motions.spins[body]):
            moved = [axis @ one.generators[list(numbers)] for one in self.states]
            meaning = f"angular momentum of {body} about {axis_text(axis)} through its own centre"
            name, proven = (
                f"S:{body}{axis_name(axis)}",
                self.prover.of_motion(value, self.prover.fitted(self.states, moved)),
            )
            self._take(name, "rolling body", "kg*m^2/s", meaning, value, proven, numeric, tuple(map(float, axis)))

    def _totals(self, linear: Sequence[int], angular: Sequence[int], moments: Sequence[int]) -> None:
        motions, n = self.quantities.motions, len(linear)
        center, length = self.quantities.center
        units = np.array([1.0] * n + [length] * len(angular))
        if float(np.max(np.abs(center), initial=0.0)) > _FAR * length:
            there, matrix = about_center(self.states, linear, angular, center, length)
            kept = matrix @ conserved_directions(there, range(len(units)), units)
        else:
            kept = conserved_directions(self.states, [*linear, *angular], units)
        if not kept.shape[1]:
            return
        scaled = kept * units[:, None]
        straight = straight_of(scaled, n)
        for axis in straight.T:
            value, numeric = self._combined(axis, motions.momentum, linear)
            d = self._in_world(axis)
            name = axis_name(d)
            told = f"linear momentum along {axis_text(d)}"
            if not self._is_known(numeric, told):
                proven = self.prover.of_motion(value, self._generator([*axis, *[0.0] * len(angular)], linear, angular))
                self._take(f"P{name}", "linear momentum", "kg*m/s", told, value, proven, numeric, tuple(d))
            if moments:
                self._boost(axis, name, told, moments, linear, angular)
        for axis, moved in rotations_of(scaled, n, straight):
            moved = np.where(np.abs(moved) < 1e-9 * np.max(np.abs(axis)), 0.0, moved)  # rounding of where the axis is
            about = length * moved  # a rotation in its own units
            coefficients = np.concatenate([about, axis])
            every = [*motions.momentum, *motions.angular_momentum]
            value, numeric = self._combined(coefficients, every, [*linear, *angular])
            self._rotation(value, numeric, axis, about, self._generator(list(coefficients), linear, angular))

    def _rotation(
        self, value: Expression, numeric: FloatArray, axis: FloatArray, about: FloatArray, generator: Generator
    ) -> None:
        if len(axis) == 1:  # in the plane, about the point (x, z): v = omega x p
            direction, point, pitch, name = np.array([0.0, -1.0, 0.0]), planar_point(axis, about), 0.0, ""
            told = "angular momentum, counter-clockwise"
        else:
            size = float(axis @ axis)
            direction, point, pitch = axis, np.cross(axis, about) / size, float(axis @ about) / size
            name = axis_name(axis)
            told = f"angular momentum about {axis_text(axis)}"
        point = np.where(np.abs(point) < 1e-9 * self.quantities.center[1], 0.0, point)
        if np.any(point):
            told += f" through {axis_text(point)} m"
        if abs(pitch) > 1e-9 * self.quantities.center[1]:
            told = f"{told}, with {pitch:.6g} m of the linear momentum along it (a screw)"
        if self._is_known(numeric, told):
            return
        proven = self.prover.of_motion(value, generator)
        where = tuple(map(float, direction)), tuple(map(float, point))
        self._take(f"L{name}", "angular momentum", "kg*m^2/s", told, value, proven, numeric, *where)

    def _boost(
        self,
        axis: FloatArray,
        name: str,
        told: str,
        moments: Sequence[int],
        linear: Sequence[int],
        angular: Sequence[int],
    ) -> None:
        rates = np.array([one.rates[moments] - one.values[linear] for one in self._plain]) @ axis
        terms = np.array([one.terms[moments] + np.abs(one.values[linear]) for one in self._plain]) @ np.abs(axis)
        if np.any(np.abs(rates) > KEPT * terms):
            return
        motions, found = self.quantities.motions, self.found
        pairs = zip(motions.moments, motions.momentum, strict=True)
        value, numeric = self._combined(axis, [m - found.time * p for m, p in pairs], moments)
        moving = self._generator([*axis, *[0.0] * len(angular)], linear, angular)
        proven = self.prover.of_motion(
            value, None if moving is None else {k: -found.time * w for k, w in moving.items()}
        )
        direction = told.removeprefix("linear momentum ")
        meaning = f"boost {direction}: K = m r - p t, so that the centre of mass moves steadily"
        self._take(f"K{name}", "boost", "kg*m", meaning, value, proven, numeric, tuple(self._in_world(axis)))

    def _integral(self, one: Integral) -> None:
        name, kind, meaning = _INTEGRALS[one.kind]
        [value] = self.quantities.on_speeds([one.value])
        e = self.found.equations
        table = self.assembly.mechanism.table.values
        numeric = []
        for state in self.states:
            here = {e.time: state.t, **dict(zip(e.coordinates, state.q, strict=True))}
            numeric += evaluate([value], {**table, **here, **dict(zip(e.speeds, state.u, strict=True))})
        self._take(name, kind, "", meaning, one.value, one.proof, np.array(numeric))

    # -- what they share ----------------------------------------------------------------------------------------------

    def _generator(self, coefficients: list[float], linear: Sequence[int], angular: Sequence[int]) -> Generator:
        weights = np.array(coefficients)
        moved = [weights @ one.generators[[*linear, *angular]] for one in self.states]
        return self.prover.fitted(self.states, moved)

    def _in_world(self, axis: FloatArray) -> FloatArray:
        basis = np.array([[float(c) for c in vector] for vector in self.assembly.mechanism.space.basis])
        return np.asarray(axis @ basis)

    def _combined(
        self, weights: FloatArray, values: Sequence[Expression], numbers: Sequence[int]
    ) -> tuple[Expression, FloatArray]:
        """Return a combination of quantities, and its values at the states."""
        terms = [one if w == 1.0 else float(w) * one for w, one in zip(weights, values, strict=True) if w]
        numeric = np.array([one.values[list(numbers)] for one in self.states]) @ weights
        return add_up([self.found.graph.zero, *terms]), numeric

    def _is_known(self, values: FloatArray, told: str = "") -> bool:
        """Return whether a quantity follows from what was found; where it is one of these, that one says so."""
        centred = values - values.mean()
        size = float(np.linalg.norm(centred))
        if not self._columns or not size:
            return not size
        columns = np.stack(self._columns, axis=1)
        scales = or_one(np.linalg.norm(columns, axis=0))
        weights = least_norm(columns / scales, centred)
        if (
            float(np.linalg.norm(columns / scales @ weights - centred)) > 1e-8 * size
            or len(columns) <= columns.shape[1]
        ):
            return False
        alike = np.flatnonzero(np.abs(np.abs(weights / scales) - 1.0) < 1e-8)
        if told and len(alike) == 1 and np.sum(np.abs(weights) > 1e-8 * size) == 1:
            one = self.items[int(alike[0])]
            sign = "" if weights[alike[0]] > 0.0 else "minus "
            self.items[int(alike[0])] = replace(one, meaning=f"{one.meaning}; it is {sign}the {told}")
        return True

    def _take(
        self,
        name: str,
        kind: str,
        unit: str,
        meaning: str,
        value: Expression,
        proven: Proof,
        numeric: FloatArray | int,
        direction: tuple[float, ...] = (),
        point: tuple[float, ...] = (),
    ) -> None:
        if isinstance(numeric, int):
            numeric = np.array([one.values[numeric] for one in self.states])
        self._columns.append(numeric - numeric.mean())
        names = {one.name for one in self.items}
        unique = name if name not in names else next(f"{name}_{k}" for k in range(2, 99) if f"{name}_{k}" not in names)
        e = self.found.equations
        timely = ", at so many times" if depends_on(add_up([*e.rows]), [e.time]) else ""
        evidence = self.prover.evidence(proven, len(self._plain), timely)
        self.items.append(Finding(unique, kind, unit, meaning, value, bool(proven), evidence, direction, point))

    def _caveats(self) -> None:
        if self.assembly.modes:
            self.notes.append("in the modes in which its parts start; an event may change what is conserved")
        elif any(one.target != COORDINATE_SWITCH for one in find_event_functions(self.assembly)):
            self.notes.append("between events")
