"""What the energy of a run is made of, sample by sample: energies, momentum, power, and how far digits reach."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

import numpy as np

from atwood.arrays import FloatArray
from atwood.expr import Program, depends_on, substitute
from atwood.forms.assembly import Assembly
from atwood.forms.kept import Key
from atwood.forms.quantities import energy_program, known_program
from atwood.mechanics.dynamics.equations import Constraint, Equations
from atwood.mechanics.outputs.moving_inertia import MovingMass, moving_masses
from atwood.mechanics.outputs.power import applied_power, switched_energy
from atwood.result.energy import Motion, Piece
from atwood.result.segment_quantities import SegmentQuantities
from atwood.simulation.run.record import SegmentRecord

__all__ = ["POWER", "account", "energy_near", "power_into"]

POWER: Key[Program] = Key("power")
_SWITCHED: Key[Program] = Key("switched energy")
_MASSES: Key[list[MovingMass]] = Key("moving masses")
_VELOCITIES: Key[Program] = Key("velocities")


_DRAWS = 3
"""States near by that tell how far digits reach."""

_DIGIT = 4.0 * np.finfo(float).eps
"""Of each number in a state, relative to itself or to its size in the scene."""


def account(reading: SegmentQuantities) -> Piece:
    """Return the samples that a ledger is made of.

    Parameters
    ----------
    reading
        The quantities of a segment.
    """
    segment, assembly = reading.segment, reading.segment.assembly
    state = segment.coordinates, segment.speeds
    mechanism, equations = assembly.mechanism, assembly.own_equations
    switching = known_program(assembly, _SWITCHED, lambda: [switched_energy(mechanism, equations)])
    kinetic, potential = _values(assembly, energy_program(assembly), segment.time, *state)
    is_fixed = switching.results[0].is_zero
    return Piece(
        time=segment.time,
        kinetic=kinetic,
        potential=potential,
        motions=_motions(segment),
        rounding=_rounding(segment),
        power=power_into(reading),
        switched=None if is_fixed else _values(assembly, switching, segment.time, *state)[0],
        is_impact=segment.impact,
        is_switched=segment.after_time_event,
    )


def _motions(segment: SegmentRecord) -> tuple[Motion, ...]:
    """Return what moves with which velocities."""
    assembly = segment.assembly
    masses = assembly.shared.get(_MASSES, lambda: moving_masses(assembly.mechanism, assembly.own_equations))
    program = known_program(
        assembly, _VELOCITIES, lambda: [x for one in masses for row in (one.velocities, *one.masses) for x in row]
    )
    values = _values(assembly, program, segment.time, segment.coordinates, segment.speeds)
    found, done = [], 0
    for one in masses:
        count = len(one.velocities)
        velocities, matrix = values[done : done + count], values[done + count : done + count + count * count]
        done += count + count * count
        found.append(Motion(one.part, one.axis, velocities, matrix.reshape(count, count, -1)))
    return tuple(found)


def power_into(reading: SegmentQuantities) -> FloatArray | None:
    """Return the power that is put into the scene at each sample, or None if nothing can."""
    segment, assembly = reading.segment, reading.segment.assembly
    program = known_program(assembly, POWER, lambda: [applied_power(assembly.mechanism, assembly.own_equations)])
    moving = any(_moves_by_itself(assembly.maximal, one) for one in assembly.maximal.constraints)
    if program.results[0].is_zero and not moving:
        return None
    total: FloatArray = _values(assembly, program, segment.time, segment.coordinates, segment.speeds)[0]
    return total + reading.reactions[1] if moving else total


def _moves_by_itself(equations: Equations, constraint: Constraint) -> bool:
    """Return whether a constraint can put power into a scene: it moves with time."""
    if constraint.value is not None:
        relations = equations.graph.relations
        return depends_on(constraint.value, [equations.time] if relations is None else relations.roots)
    return not substitute([constraint.rate], dict.fromkeys(equations.speeds, 0.0))[0].is_zero


def _values(assembly: Assembly, program: Program, t: FloatArray, q: FloatArray, u: FloatArray) -> FloatArray:
    """Return what a program of the state gives, shape (values, samples)."""
    idle = (np.zeros_like(u), np.zeros((len(assembly.reactions), len(t))))
    found = assembly.kernel(program, vectorized=True)(t[None, :], q, u, *idle)[0]
    return np.array([np.broadcast_to(row, t.shape) for row in found])


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
        found: FloatArray = numbers + (2.0 * bits - 1.0).reshape(numbers.shape) * by
        return found

    here, program = (segment.coordinates, segment.speeds), energy_program(assembly)
    energy = np.sum(_values(assembly, program, segment.time, *here), axis=0)
    rows, largest = np.repeat(assembly.parameter_values[:, None], len(segment.time), axis=1), 0.0
    for _ in range(_DRAWS):
        turned = assembly.with_rows(near(rows, digit * np.abs(rows)))
        states = [near(x, share * size) for x, size in zip(here, sizes, strict=True)]
        time = near(segment.time, digit * np.abs(segment.time))
        apart = np.abs(np.sum(_values(turned, program, time, *states), axis=0) - energy)
        largest = max(largest, float(np.max(apart, initial=0.0, where=np.isfinite(apart))))
    return largest
