"""Conserved quantities along a run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import UsageError
from atwood.expr import Expression, OutputGroup, Program, vjp
from atwood.forms.assembly import Assembly
from atwood.forms.program import state_groups
from atwood.result.result import Result
from atwood.simulation.dynamics.orientation_coordinates import from_regular, to_regular
from atwood.simulation.dynamics.reactions import maximal_state
from atwood.simulation.events.mode_change import generalized_state
from atwood.simulation.run.record import SegmentRecord
from atwood.theory.symmetry.quantities import Quantities
from atwood.tolerances import tolerances

__all__ = ["along_run"]


def along_run(quantities: Quantities, values: Sequence[Expression], result: Result) -> tuple[FloatArray, FloatArray]:
    """Return quantities at the output times of a run, and the sizes of their terms.

    Parameters
    ----------
    quantities
        Of the scene that the quantities are of.
    values
        The quantities, on the symbols of its Lagrangian.
    result
        The run of that scene, in either form.

    Returns
    -------
    values, sizes
        Shapes (quantities, times) and (quantities,).

    Raises
    ------
    UsageError
        If the run is one of another scene.
    """
    assembly = quantities.assembly
    _check_alike(assembly, result.assembly)
    e, own = assembly.reduced, quantities.on_speeds(values)
    # What a quantity is the sum of, as far as velocities tell: total momenta can be zero.
    terms = [[u * slope for u, slope in zip(e.speeds, vjp([one], [e.graph.one], e.speeds), strict=True)] for one in own]
    flat = [one for row in terms for one in row]
    outputs = (OutputGroup("values", tuple(own)), OutputGroup("terms", tuple(flat)))
    program = Program(f"{assembly.flat.name} conserved along a run", state_groups(e), assembly.parameters, outputs)
    pieces, sizes = [], np.zeros(len(own))
    for segment in result.run.segments:
        shown = segment.shown
        if not np.any(shown):
            continue
        q, u = _states(assembly, segment, result.start.length)
        kernel = _as_in(assembly, segment).kernel(program, vectorized=True)
        found, parts = kernel(segment.time[None, shown], q[:, shown], u[:, shown])
        pieces.append(np.asarray(found))
        parts = np.sum(np.abs(np.reshape(parts, (len(own), len(e.speeds), -1))), axis=1)
        sizes = np.fmax(sizes, np.nanmax(np.maximum(parts, np.abs(found)), axis=1, initial=0.0))
    return np.concatenate(pieces, axis=1), sizes


def _check_alike(assembly: Assembly, other: Assembly) -> None:
    if assembly.shared is other.shared and assembly.mechanism is other.mechanism:
        return
    own, its = ({one.name: value for one, value in a.mechanism.table.values.items()} for a in (assembly, other))
    if [one.name for one in assembly.regular.names] != [one.name for one in other.regular.names] or own != its:
        changed = next((name for name in own if own[name] != its.get(name)), "")
        raise UsageError(
            "the quantities are of another scene" + (f": {changed} is another there" if changed else ""),
            where=other.flat.name,
            advice="Give `conserved` the scene that is run.",
        )


def _as_in(assembly: Assembly, segment: SegmentRecord) -> Assembly:
    """Return a scene with what the clock and discrete states are in a segment of a run."""
    its = segment.assembly
    if len(assembly.relations) == len(its.relations):
        assembly = assembly.with_relations(its.relation_values)
    return assembly if its.held is None else assembly.with_held(its.held)


def _states(assembly: Assembly, segment: SegmentRecord, length: float) -> tuple[FloatArray, FloatArray]:
    """Return the states of a segment in the coordinates and speeds of the reduced form of a scene.

    Those of a mode in which bodies are where these coordinates cannot put them are not known (nan).
    """
    its, q, u = segment.assembly, segment.coordinates, segment.speeds
    alike = [one.name for one in its.regular.names] == [one.name for one in assembly.regular.names]
    if its.form == "reduced" and alike and its.regular.speed_names == assembly.regular.speed_names:
        return from_regular(assembly, to_regular(its, q)), u
    big_q, big_u = maximal_state(its, segment.time, q, u)
    places, speeds = np.full((len(assembly.regular.names), len(segment.time)), np.nan), []
    for k in np.flatnonzero(segment.shown):
        own, whole = (q[:, k], u[:, k]), (big_q[:, k], big_u[:, k])
        place, speed, miss = generalized_state(its, assembly, float(segment.time[k]), own, whole, length)
        if np.max(np.abs(miss), initial=0.0) <= tolerances.IN_PLACE:
            places[:, k] = place
        speeds.append(speed)
    moving = np.full((len(assembly.regular.speeds), len(segment.time)), np.nan)
    moving[:, segment.shown] = np.array(speeds).T
    return from_regular(assembly, places), moving
