"""Ledgers along a run: kinetic and potential energy, the work that was put in, and other conserved quantities."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from random import Random
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.errors import UsageError
from atwood.expr import Program, depends_on, substitute
from atwood.forms.caches import Key
from atwood.forms.quantities import energy_program, known_program
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import Constraint, Equations
from atwood.mechanics.outputs.part_power import MovingMass, applied_power, moving_masses, switched_energy
from atwood.result.segment_quantities import SegmentQuantities, state_values
from atwood.simulation.run.recorder import SegmentRecord

if TYPE_CHECKING:
    from atwood.result.part_energy import PartEnergies

_SHARE = 1e-6
"""Of the kinetic energy: no less counts as exchanged, since steady motion has errors of rounding, too."""


@dataclass(frozen=True, eq=False)
class EnergyLedger:
    """Energies at the output times, J, and how well they balance.

    Attributes
    ----------
    kinetic, potential
        Kinetic and potential energy.
    work
        Work of drives, inputs and dampers since the start, and what impacts took away.
    max_drift
        Largest deviation of kinetic plus potential energy less work from its start, at any sample of the run, as far as
        it is more than rounding, relative to `exchanged`. It is the error of the energy. Errors that leave the
        energy as it is, as those along a periodic orbit, are not in it, and grow with the length of the run.
    exchanged
        What deviations are compared with, J; the largest of

        - the kinetic energy of the deviations of all velocities, and angular velocities in the axes of the bodies,
          from their means over the run,
        - what goes to and fro: the mean absolute deviations from their means of the potential energy, and of the
          kinetic energy of each part for an observer who moves with the mean velocity of the centre of mass; but no
          more than the kinetic energy for that observer,
        - the range of the work, also between samples where it is integrated in the steps of the solver,
        - 1e-6 of the mean kinetic energy.

        Kinetic energies are geometric means over the time in which something moves, so that a short fast part, as the
        perihelion of a comet, does not hide what the slow part depends on. Nothing depends on the constant of the
        potential, and only the last two on the frame of reference.
    uncertainty
        What the digits of states and parameters leave open, J, and the estimated error of the work as an integral.
    source
        Gives `parts`, for what is exchanged.
    """

    kinetic: FloatArray
    potential: FloatArray
    work: FloatArray
    max_drift: float
    exchanged: float
    uncertainty: float
    source: Callable[[float], PartEnergies] | None = None

    @cached_property
    def parts(self) -> PartEnergies:
        """The same for each component, worked out when it is first asked for: ``parts["bob"].work["point"]``."""
        if self.source is None:
            raise UsageError("the run that the energy is of is not there", advice="Ask result.energy of a run.")
        return self.source(self.exchanged)

    @property
    def total(self) -> FloatArray:
        """Kinetic plus potential energy."""
        return self.kinetic + self.potential

    def __repr__(self) -> str:
        """Say how well it balances, and relative to what."""
        return f"<{type(self).__name__}: {self.describe()}>"

    def describe(self) -> str:
        """Return how well it balances, and relative to what, in words."""
        told = f"the balance drifts by {self.max_drift:.1e} of the {self.exchanged:.3g} J exchanged"
        if self.uncertainty > max(self.max_drift, 1e-8) * self.exchanged:
            causes = "rounding and the estimated error of the work leave" if np.any(self.work) else "rounding leaves"
            told += f", which {causes} open by {self.uncertainty:.1e} J"
        return told


@dataclass(frozen=True, eq=False)
class Motion:
    """Velocities that share a matrix of masses; see `atwood.mechanics.outputs.part_power.MovingMass`.

    Attributes
    ----------
    part
        Whose they are.
    axis
        Number of their world axis; -1 for an angular velocity.
    velocities
        Shape (number, samples).
    masses
        Shape (number, number, samples).
    """

    part: str
    axis: int
    velocities: FloatArray
    masses: FloatArray

    def energy(self, mean: FloatArray | float = 0.0) -> FloatArray:
        """Return the kinetic energy of the deviations from mean velocities, at each sample."""
        w = self.velocities - np.reshape(mean, (-1, 1))
        return np.asarray(0.5 * np.einsum("is,ijs,js->s", w, self.masses, w))


@dataclass(frozen=True, eq=False)
class Piece:
    """What a ledger is made of: samples of a stretch in one mode.

    Attributes
    ----------
    time
        Sample times, s.
    kinetic, potential
        Energies, J.
    motions
        What moves with which velocities.
    rounding
        What the digits of states and parameters leave open, J.
    power
        Power put in, W; None where there is none.
    switched
        Potential energy that is there in some modes only, which counts as work when such a mode is entered or left;
        None where there is none.
    lost
        Energy that contacts of a group have taken since its start, J; None where there is none.
    is_impact
        Whether it began with an impact.
    is_switched
        Whether it began at a time event.
    is_rest
        Whether it began where impacts had accumulated.
    is_driven
        Whether a constraint, a gap or a slip moves with time, so that an impact may put work in.
    """

    time: FloatArray
    kinetic: FloatArray
    potential: FloatArray
    motions: tuple[Motion, ...]
    rounding: float
    power: FloatArray | None
    switched: FloatArray | None
    lost: FloatArray | None
    is_impact: bool
    is_switched: bool
    is_rest: bool
    is_driven: bool

    def gained_since(self, before: Piece) -> float:
        """Return the work that is done between the end of another piece and the start of this one, J.

        An impact takes kinetic energy away, unless what moves with time takes part in it, as a table that shakes.
        Where impacts have accumulated, what still rises gives back the friction of a flight that is left out. At a
        time event, all that jumps is work: of an input that a potential reads, or of drives whose speed jumps. Other
        jumps of energy are none of work.
        """
        kinetic = float(self.kinetic[0] - before.kinetic[-1])
        if self.is_switched:
            return kinetic + float(self.potential[0] - before.potential[-1])
        after, earlier = self.switched, before.switched
        gained = (0.0 if after is None else float(after[0])) - (0.0 if earlier is None else float(earlier[-1]))
        if self.is_rest or (self.is_impact and self.is_driven):
            return gained + kinetic
        return gained + (min(0.0, kinetic) if self.is_impact else 0.0)


def exchange(pieces: Sequence[Piece], work: FloatArray) -> float:
    """Return the energy that a scene exchanges, J; see `EnergyLedger.exchanged`."""
    shares = np.concatenate([_weights(one.time) for one in pieces])
    if not np.any(shares > 0.0):
        shares = np.ones_like(shares)
    shares = shares / np.sum(shares)
    rounding = max(one.rounding for one in pieces)
    motions = _joined_motions(pieces)
    boost = _mean_velocity(motions, shares)
    seen: dict[str, FloatArray] = {}
    deviating = np.zeros(len(shares))
    for one in motions:
        seen[one.part] = seen.get(one.part, 0.0) + one.energy(boost.get(one.axis, 0.0))
        deviating = deviating + one.energy(one.velocities @ shares)
    kinetic, potential = (np.concatenate([getattr(one, name) for one in pieces]) for name in ("kinetic", "potential"))
    other = np.abs(kinetic - sum(one.energy() for one in motions))  # of Lagrangians, as it is
    seen[""], deviating = other, deviating + other
    moving = _typical(np.sum(list(seen.values()), axis=0), shares, rounding)
    to_and_fro = sum(float(np.abs(one - one @ shares) @ shares) for one in (potential, *seen.values()))
    own = _typical(deviating, shares, rounding)
    return max(own, min(to_and_fro, moving), float(np.ptp(work)), _SHARE * float(kinetic @ shares))


def _joined_motions(pieces: Sequence[Piece]) -> list[Motion]:
    """Return the motions of the whole run."""
    return [
        Motion(
            same[0].part,
            same[0].axis,
            np.concatenate([one.velocities for one in same], axis=1),
            np.concatenate([one.masses for one in same], axis=2),
        )
        for same in zip(*(piece.motions for piece in pieces), strict=True)
    ]


def _mean_velocity(motions: Sequence[Motion], shares: FloatArray) -> dict[int, float]:
    """Return the mean velocity of the centre of mass along each axis."""
    found = {}
    for axis in {one.axis for one in motions} - {-1}:
        along = [one for one in motions if one.axis == axis]
        mass = float(sum(np.sum(one.masses, axis=(0, 1)) @ shares for one in along))
        momentum = float(sum(np.einsum("ijs,js,s->", one.masses, one.velocities, shares) for one in along))
        found[axis] = momentum / mass if mass > 0.0 else 0.0
    return found


def _typical(energy: FloatArray, shares: FloatArray, rounding: float) -> float:
    """Return the geometric mean over the time in which an energy is more than rounding; 0 if it never is."""
    some = (energy > rounding) & (shares > 0.0)
    return float(np.exp(np.sum(shares[some] * np.log(energy[some])) / np.sum(shares[some]))) if some.any() else 0.0


def _weights(t: FloatArray) -> FloatArray:
    """Return the time that each sample stands for."""
    gaps = np.diff(t)
    return np.asarray(0.5 * (np.append(gaps, 0.0) + np.append(0.0, gaps)))


def make_ledger(
    pieces: Sequence[Piece], work: Sequence[FloatArray], unsure: float, shown: NDArray[np.bool_], swing: float = 0.0
) -> EnergyLedger:
    """Return the ledger of a run."""
    done, carried = [], 0.0
    for i, (piece, inside) in enumerate(zip(pieces, work, strict=True)):
        carried += piece.gained_since(pieces[i - 1]) if i else 0.0
        done.append(carried + inside if piece.lost is None else carried + inside - piece.lost)
        carried = float(done[-1][-1])
    kinetic, potential = (np.concatenate([getattr(one, name) for one in pieces]) for name in ("kinetic", "potential"))
    all_work = np.concatenate(done)
    balance = kinetic + potential - all_work
    exchanged, rounding = max(swing, exchange(pieces, all_work)), 2.0 * max(one.rounding for one in pieces)
    beyond = float(np.maximum(0.0, np.max(np.abs(balance - balance[0])) - rounding))  # nan stays nan
    share = beyond / max(exchanged, rounding) if beyond else 0.0
    return EnergyLedger(kinetic[shown], potential[shown], all_work[shown], share, exchanged, rounding + unsure)


POWER: Key[Program] = Key("power")
_SWITCHED: Key[Program] = Key("switched energy")
_MASSES: Key[list[MovingMass]] = Key("moving masses")
_VELOCITIES: Key[Program] = Key("velocities")


_DRAWS = 3
"""States near by that tell how far digits reach."""

_DIGIT = 4.0 * np.finfo(float).eps
"""Of each number in a state, relative to itself or to its size in the scene."""


def accounts(readings: Sequence[SegmentQuantities]) -> list[Piece]:
    """Return the samples of all segments that a ledger is made of."""
    found: dict[int, Piece] = {}
    powers = powers_into(readings)
    for one in readings:
        joined = one.segment
        assembly, state = joined.assembly, (joined.time, joined.coordinates, joined.speeds)
        mechanism, equations = assembly.mechanism, assembly.own_equations
        switching = known_program(assembly, _SWITCHED, lambda: [switched_energy(mechanism, equations)])  # noqa: B023
        energies = state_values(assembly, energy_program(assembly), *state)
        switched = None if switching.results[0].is_zero else state_values(assembly, switching, *state)[0]
        motions, rounding = _motions(joined), _rounding(joined)
        contacts = [each.row for each in assembly.maximal.contacts]
        driven = any(_moves_by_itself(assembly.maximal, each) for each in (*assembly.maximal.constraints, *contacts))
        for number, segment in one.parts.items():
            own = one.places[number]
            found[number] = Piece(
                time=segment.time,
                kinetic=energies[0, own],
                potential=energies[1, own],
                motions=tuple(Motion(m.part, m.axis, m.velocities[:, own], m.masses[..., own]) for m in motions),
                rounding=rounding,
                power=powers[number],
                switched=None if switched is None else switched[own],
                lost=segment.lost,
                is_impact=segment.impact,
                is_switched=segment.after_time_event,
                is_rest=segment.rests,
                is_driven=driven,
            )
    return [found[number] for number in range(len(found))]


def _motions(segment: SegmentRecord) -> tuple[Motion, ...]:
    """Return what moves with which velocities."""
    assembly = segment.assembly
    masses = assembly.shared.get(_MASSES, lambda: moving_masses(assembly.mechanism, assembly.own_equations))
    program = known_program(
        assembly, _VELOCITIES, lambda: [x for one in masses for row in (one.velocities, *one.masses) for x in row]
    )
    values = state_values(assembly, program, segment.time, segment.coordinates, segment.speeds)
    found, done = [], 0
    for one in masses:
        count = len(one.velocities)
        velocities, matrix = values[done : done + count], values[done + count : done + count + count * count]
        done += count + count * count
        found.append(Motion(one.part, one.axis, velocities, matrix.reshape(count, count, -1)))
    return tuple(found)


def powers_into(readings: Sequence[SegmentQuantities]) -> list[FloatArray | None]:
    """Return the power that is put into the scene at each sample of each segment; None where nothing can."""
    found: dict[int, FloatArray | None] = {}
    for one in readings:
        joined, total = one.segment, None
        assembly = joined.assembly
        mechanism, equations = assembly.mechanism, assembly.own_equations
        program = known_program(assembly, POWER, lambda: [applied_power(mechanism, equations)])  # noqa: B023
        moving = any(_moves_by_itself(assembly.maximal, each) for each in assembly.maximal.constraints)
        if moving or not program.results[0].is_zero:
            total = state_values(assembly, program, joined.time, joined.coordinates, joined.speeds)[0]
            total = total + one.reactions[1] if moving else total
        found.update({number: None if total is None else total[place] for number, place in one.places.items()})
    return [found[number] for number in range(len(found))]


def _moves_by_itself(equations: Equations, constraint: Constraint) -> bool:
    """Return whether a constraint can put power into a scene: it moves with time."""
    if constraint.value is not None:
        relations = equations.graph.relations
        return depends_on(constraint.value, [equations.time] if relations is None else relations.roots)
    return not substitute([constraint.rate], dict.fromkeys(equations.speeds, 0.0))[0].is_zero


def _rounding(segment: SegmentRecord) -> float:
    """Return by how much the energy changes at most, J, where all that it is computed from changes in its last digits.

    States are known to some units of rounding of themselves, or of the size that such coordinates have in the scene.
    """
    plan = segment.plan
    sizes = (plan.coordinate_sizes[:, None], plan.sizes[:, None] / plan.scales.time)
    whole = [np.abs(x) + size for x, size in zip((segment.coordinates, segment.speeds), sizes, strict=True)]
    return _changed(segment, whole, _DIGIT, _DIGIT)


def energy_near(segment: SegmentRecord, share: float) -> float:
    """Return by how much the energy changes at most, J, where each coordinate and speed changes by a share of its size.

    The size of a speed is that of its coordinate in the scene's time, or the largest that it has in the segment.
    """
    plan = segment.plan
    fastest = np.max(np.abs(segment.speeds), axis=1, initial=0.0)
    sizes = (plan.coordinate_sizes[:, None], np.maximum(plan.sizes / plan.scales.time, fastest)[:, None])
    return _changed(segment, sizes, share, 0.0)


def _changed(segment: SegmentRecord, sizes: Sequence[FloatArray], share: float, digit: float) -> float:
    """Return by how much the energy changes where states change by a share of their sizes, all else by a digit."""
    assembly, random = segment.assembly, Random(0)

    def near(numbers: FloatArray, by: FloatArray) -> FloatArray:
        # NumPy's generators take longer to load than all of this.
        bits = np.frombuffer(random.randbytes(numbers.size), dtype=np.uint8) & 1
        return np.asarray(numbers + (2.0 * bits - 1.0).reshape(numbers.shape) * by)

    here, program = (segment.coordinates, segment.speeds), energy_program(assembly)
    energy = np.sum(state_values(assembly, program, segment.time, *here), axis=0)
    rows, largest = np.repeat(assembly.parameter_values[:, None], len(segment.time), axis=1), 0.0
    for _ in range(_DRAWS):
        turned = assembly.with_rows(near(rows, digit * np.abs(rows)))
        states = [near(x, share * size) for x, size in zip(here, sizes, strict=True)]
        time = near(segment.time, digit * np.abs(segment.time))
        apart = np.abs(np.sum(state_values(turned, program, time, *states), axis=0) - energy)
        largest = max(largest, float(np.max(apart, initial=0.0, where=np.isfinite(apart))))
    return largest


@dataclass(frozen=True, eq=False)
class ConservedValues:
    """A conserved quantity along a run.

    Attributes
    ----------
    name, kind, unit
        See `atwood.ConservedQuantity`.
    values
        At the output times; not known (nan) in modes whose coordinates it is not made of.
    size
        What deviations are compared with: the most that the terms of the quantity came to.
    """

    name: str
    kind: str
    unit: str
    values: FloatArray
    size: float

    @property
    def max_drift(self) -> float:
        """Largest deviation from the start, relative to `size`."""
        known = self.values[np.isfinite(self.values)]
        moved = float(np.max(np.abs(known - known[:1]), initial=0.0))
        return moved / self.size if self.size > 0.0 else 0.0

    def to_dict(self) -> dict[str, Any]:
        """Return start, end and drift as plain data."""
        ends = {"start": float(self.values[0]), "end": float(self.values[-1])}
        return {"kind": self.kind, "unit": self.unit, **ends, "max_drift": self.max_drift, "size": self.size}


class ConservedLedger(Mapping[str, ConservedValues]):
    """The conserved quantities of a run by name.

    Parameters
    ----------
    items
        The quantities.
    """

    def __init__(self, items: tuple[ConservedValues, ...]) -> None:
        self._items = {one.name: one for one in items}

    def __getitem__(self, name: str) -> ConservedValues:
        return self._items[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    @property
    def max_drift(self) -> float:
        """The largest of their relative deviations."""
        return max((one.max_drift for one in self.values()), default=0.0)

    def describe(self) -> str:
        """Return by how much each drifts, in words."""
        if not self:
            return "nothing is conserved"
        return ", ".join(f"{one.name} drifts by {one.max_drift:.1e}" for one in self.values()) + " of their sizes"

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {one.name: one.to_dict() for one in self.values()}

    def __repr__(self) -> str:
        return f"<ConservedLedger: {self.describe()}>"
