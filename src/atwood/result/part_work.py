"""The energies of all components along a run, and the work at their connectors, integrated within the steps."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.expr import Program
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.mechanics.outputs.part_power import Flow, PartPowers, part_energy_program, part_powers
from atwood.numerics.matrices import least_norm, to_array
from atwood.result.part_connectors import Connectors, Ends
from atwood.result.part_energy import PartEnergies, PartEnergy
from atwood.result.work import in_its_time, integral_in_steps, integral_of_samples, nodes_in_steps, samples_in_steps
from atwood.simulation.contacts.values import ContactValues
from atwood.simulation.dynamics.balance import balance_of
from atwood.simulation.dynamics.reactions import ReactionSolver, maximal_state
from atwood.simulation.dynamics.scales import motion_scales, multiplier_sizes, scene_length
from atwood.simulation.run.recorder import SegmentRecord
from atwood.simulation.run.run_record import Run

_ENERGIES: Key[Program] = Key("energies by part")
_POWERS: Key[PartPowers] = Key("powers by part")
_IMPULSES: Key[PartPowers] = Key("powers of impulses by part")

_CHUNK = 2_000_000
"""Numbers that are evaluated at once."""

_STILL = 1e-12
"""Relative to the largest speed: smaller jumps of speeds are rounding."""

_DRIVES = 1e-6
"""Relative to what the scene exchanges: energy that a Rayleigh function put in is no error of the quadrature."""

_FREE = 1e-7
"""Of what multipliers of a size do in general: what those that nothing determines do, if it is more than rounding."""

_MET = 1e-5
"""Of the extent of the scene: what is as near as that takes part in an impact."""

_LOOKS = (0.25, 0.6, 1.0)
"""Where along a segment it is looked whether reactions determine the work."""


_Done: TypeAlias = dict[tuple[str, str, str], FloatArray]
"""What has been done, J, by the field of `PartEnergy`, the part, and the connector for work: arrays, or numbers."""


def find_part_energies(run: Run, shown: NDArray[np.bool_], exchanged: float) -> PartEnergies:
    """Return the energies of all components along a run, and where they came from."""
    flat, segments = run.assembly.flat, run.segments
    connectors = [Connectors(one.assembly.mechanism, flat) for one in segments]
    done, unsure = _within(run, connectors)
    energies = [_energies(one) for one in segments]
    total = _Sums(flat.parts, connectors[0].ends)
    for i, segment in enumerate(segments):
        if i:
            total.jump(
                _between(segments[i - 1], segment, energies[i - 1][:, :, -1], energies[i][:, :, 0], connectors[i])
            )
        total.take(done[i], len(segment.time))
    loose = {path for one in connectors for path in one.in_parallel}
    for segment, one in zip(segments, connectors, strict=True):
        loose |= _undetermined(segment, one)
    every = np.concatenate(energies, axis=2)
    parts = {path: total.part(path, every[number], shown, path not in loose) for number, path in enumerate(flat.parts)}
    models = {path: _model(path, parts, connectors[0]) for path in _models(flat.parts)}
    time = np.concatenate([one.time for one in segments])[shown]
    _warn_of_driving(time, parts, exchanged)
    return PartEnergies(time, parts, models, exchanged, unsure)


def _warn_of_driving(time: FloatArray, parts: Mapping[str, PartEnergy], exchanged: float) -> None:
    """Say which Rayleigh functions put energy in: a sign is wrong, or it is no dissipation."""
    for path, one in parts.items():
        given = np.maximum.accumulate(one.dissipated) - one.dissipated
        if np.max(given, initial=0.0) > _DRIVES * exchanged:
            since = float(time[max(0, int(np.argmax(given > _DRIVES * exchanged)) - 1)])
            warnings.warn(
                f"{path}: its Rayleigh function drives: from t = {since:.6g} on it puts in {np.max(given):.3g} J, "
                "where a dissipation takes energy away; look at its sign, or write it as a @force",
                stacklevel=2,
            )


class _Sums:
    """What has been done since the start of the run, at all samples so far."""

    def __init__(self, parts: Iterable[str], ends: Sequence[Ends]) -> None:
        names = ("supplied", "dissipated", "constraints", "impacts")
        others = [(name, part, "") for part in parts for name in names]
        self._found: dict[tuple[str, str, str], list[FloatArray]]
        self._found = {key: [] for key in (*(("work", *end) for end in ends), *others)}
        self._of: dict[str, list[tuple[str, str, str]]] = {}
        for key in self._found:
            self._of.setdefault(key[1], []).append(key)
        self._carried: dict[tuple[str, str, str], float] = {}

    def jump(self, done: _Done) -> None:
        """Add what was done in no time."""
        for key, value in done.items():
            self._carried[key] = self._carried.get(key, 0.0) + float(value)

    def take(self, done: _Done, samples: int) -> None:
        """Add what was done along a segment."""
        still = np.zeros(samples)
        for key, pieces in self._found.items():
            pieces.append(done.get(key, still) + self._carried.get(key, 0.0))
            self._carried[key] = float(pieces[-1][-1])

    def part(self, path: str, energies: FloatArray, shown: NDArray[np.bool_], is_unique: bool) -> PartEnergy:
        """Return the energy of a part at the output times, from its energies at all samples."""
        own = {
            (field, name): np.concatenate(self._found[field, path, name])[shown] for field, _, name in self._of[path]
        }
        work = {name: values for (field, name), values in own.items() if field == "work"}
        supplied, dissipated, constraints, impacts = (values for (field, _), values in own.items() if field != "work")
        kinetic, potential = energies[:, shown]
        gained = kinetic + potential - np.sum(energies[:, 0])
        return PartEnergy(path, kinetic, potential, gained, work, supplied, dissipated, constraints, impacts, is_unique)


def _models(parts: Mapping[str, object]) -> list[str]:
    """Return the paths of all models within a scene."""
    steps = (path.split(".") for path in parts)
    return list(dict.fromkeys(".".join(one[:k]) for one in steps for k in range(1, len(one))))


def _model(model: str, parts: Mapping[str, PartEnergy], connectors: Connectors) -> PartEnergy:
    """Return the energy of a model: the sum of its parts, and the work where others are connected."""
    inside = [one for path, one in parts.items() if path.startswith(f"{model}.")]
    names = ("kinetic", "potential", "gained", "supplied", "dissipated", "constraints", "impacts")
    sums = {name: np.sum([getattr(one, name) for one in inside], axis=0) for name in names}
    work = {
        name: np.sum([parts[path].work[end] for path, end in ends], axis=0)
        for name, ends in connectors.of_model(model).items()
    }
    return PartEnergy(path=model, work=work, is_unique=all(one.is_unique for one in inside), **sums)


def _energies(segment: SegmentRecord) -> FloatArray:
    """Return kinetic and potential energy of each part, shape (parts, 2, samples)."""
    assembly, t = segment.assembly, segment.time
    program = assembly.shared.get(
        _ENERGIES, lambda: part_energy_program(assembly.mechanism, assembly.maximal, assembly.parameters)
    )
    state = maximal_state(assembly, t, segment.coordinates, segment.speeds)
    return _rows(assembly, program, t, *state).reshape(-1, 2, len(t))


def _rows(assembly: Assembly, program: Program, t: FloatArray, *groups: FloatArray) -> FloatArray:
    found = assembly.kernel(program, vectorized=True)(t[None, :], *groups)[0]
    return np.array([np.broadcast_to(row, t.shape) for row in found]).reshape(-1, len(t))


# -- within segments ------------------------------------------------------------------------------------------------


def _within(run: Run, connectors: Sequence[Connectors]) -> tuple[list[_Done], float]:
    """Return what is done along each segment, and its estimated error.

    Powers are integrated within the steps of the solver, for which the run is made again; where it cannot be, or not in
    its limit of time, through its samples.
    """
    times = [one.time for one in run.segments]
    samples = in_its_time(run, lambda: samples_in_steps(run, times, nodes_in_steps(run)))
    found, unsure = [], 0.0
    for i, (segment, meeting) in enumerate(zip(run.segments, connectors, strict=True)):
        if samples is None:
            powers = _Powers(segment)
            kept = [integral_of_samples(segment.time, row) for row in powers.at(slice(None))]
            rows, errors = np.array([one for one, _ in kept]), sum(error for _, error in kept)
        else:
            one = samples[i]
            powers = _Powers(one.segment)
            rows, errors = _in_steps(powers, one.grid, one.places, segment.time)
        found.append(_sorted(powers.keys, rows, meeting))
        unsure += float(errors)
    return found, unsure


class _Powers:
    """All powers of a segment: what flows, and what constraints put in.

    Parameters
    ----------
    segment
        The segment.
    """

    def __init__(self, segment: SegmentRecord) -> None:
        assembly = self._assembly = segment.assembly
        self._segment = segment
        self._solver = ReactionSolver(assembly, float(segment.time[0]), segment.coordinates[:, 0], segment.speeds[:, 0])
        self._program = _powers_of(assembly)
        self._holders = list(dict.fromkeys(one.key[0] for one in assembly.maximal.constraints))
        self._sums = np.array(
            [[one.key[0] == path for one in assembly.maximal.constraints] for path in self._holders], dtype=float
        ).reshape(len(self._holders), len(assembly.maximal.constraints))
        self.keys: list[Flow | str] = [*self._program.flows, *self._holders]

    def at(self, places: NDArray[np.intp] | slice) -> FloatArray:
        """Return them at some samples, shape (keys, samples); at singular positions as if they went on evenly."""
        segment = self._segment
        t, q, u = segment.time[places], segment.coordinates[:, places], segment.speeds[:, places]
        clear = np.ones(len(t), dtype=bool)
        for crossing in segment.singular_crossings:
            clear &= ~crossing.leaves_open(t)
        values = np.zeros((len(self.keys), len(t)))
        if clear.any():
            now = self._solver.balance_along(t[clear], q[:, clear], u[:, clear])
            state = (now.coordinates, now.speeds, now.accelerations, now.multipliers)
            flows = _rows(self._assembly, self._program.program, t[clear], *state)
            values[:, clear] = np.concatenate([flows, self._sums @ now.powers])
            for row in values if not clear.all() else ():
                row[~clear] = np.interp(t[~clear], t[clear], row[clear])
        return values


def _powers_of(assembly: Assembly) -> PartPowers:
    return assembly.shared.get(_POWERS, lambda: part_powers(assembly.mechanism, assembly.maximal, assembly.parameters))


def _in_steps(
    powers: _Powers, grid: FloatArray, places: NDArray[np.intp], times: FloatArray
) -> tuple[FloatArray, float]:
    """Return the integrals of all powers at some of the times of a grid, and their estimated errors together."""
    steps = len(grid) - 1
    if not steps:
        return np.zeros((len(powers.keys), len(times))), 0.0
    count = len(places) // steps
    chunk = max(1, _CHUNK // (count * max(1, len(powers.keys))))
    wanted = np.searchsorted(grid, times)
    found, carried, unsure = np.zeros((len(powers.keys), len(times))), np.zeros((len(powers.keys), 1)), 0.0
    for first in range(0, steps, chunk):
        last = min(first + chunk, steps)
        values = powers.at(places[first * count : last * count]).reshape(len(powers.keys), last - first, count)
        done, error = integral_in_steps(grid[first : last + 1], values)
        done = done + carried
        inside = (wanted >= first) & (wanted <= last)
        found[:, inside] = done[:, wanted[inside] - first]
        carried, unsure = done[:, -1:], unsure + float(np.max(error, initial=0.0))
    return found, unsure


def _sorted(keys: Sequence[Flow | str], rows: FloatArray, connectors: Connectors) -> _Done:
    """Return what is done by connector and by part; keys are flows, or parts whose constraints put in."""
    flows = {key: row for key, row in zip(keys, rows, strict=True) if isinstance(key, Flow)}
    found: _Done = {("work", *end): row for end, row in connectors.work(flows).items()}
    found |= {(key.kind, key.part, ""): row for key, row in flows.items() if key.kind in ("supplied", "dissipated")}
    found |= {("constraints", key, ""): row for key, row in zip(keys, rows, strict=True) if isinstance(key, str)}
    return found


# -- between segments -----------------------------------------------------------------------------------------------


def _between(
    before: SegmentRecord, after: SegmentRecord, was: FloatArray, now: FloatArray, connectors: Connectors
) -> _Done:
    """Return what is done between two segments: impulses, and energy that comes and goes with potentials and mass."""
    found = _impulses(before, after, connectors)
    for path, (kinetic, potential) in zip(after.assembly.flat.parts, now - was, strict=True):
        come = float(potential)
        if after.after_time_event and after.assembly.mechanism.locals_[path].varying:  # mass takes its energy along
            come += float(kinetic) - sum(float(done) for (_, part, _), done in found.items() if part == path)
        if come:
            found["supplied", path, ""] = np.asarray(come)
    return found


def _impulses(before: SegmentRecord, after: SegmentRecord, connectors: Connectors) -> _Done:
    """Return the work of impulses, ``Lambda . (v- + v+) / 2``, which is exact for constant masses."""
    assembly, t = after.assembly, after.time[:1]
    names = [tuple(c.name for c in one.assembly.maximal.speed_names) for one in (before, after)]
    if names[0] != names[1]:
        return {}
    _, u_was = maximal_state(before.assembly, t, before.coordinates[:, -1:], before.speeds[:, -1:])
    q, u_now = maximal_state(assembly, t, after.coordinates[:, :1], after.speeds[:, :1])
    sizes = motion_scales(assembly.maximal, scene_length(assembly))[:, None]
    jump, middle = u_now - u_was, 0.5 * (u_now + u_was)
    if not np.max(np.abs(jump) / sizes, initial=0.0) > _STILL * np.max(np.abs(u_was) / sizes, initial=0.0):
        return {}
    balance = balance_of(assembly, "dae").at(float(t[0]), q[:, 0], u_now[:, 0])
    keys = [one.key[0] for one in assembly.maximal.constraints]
    slope, weights = to_array(balance.jacobian), multiplier_sizes(assembly, "dae")
    contacts = assembly.maximal.contacts
    if contacts:
        state = after.coordinates[:, 0], after.speeds[:, 0]
        met = ContactValues(assembly, float(t[0]), *state, scene_length(assembly))
        touching = met.touching(_MET)
        slope = np.concatenate([slope, met.slopes * touching[:, None]])
        weights = np.concatenate([weights, touching])
        keys += [one.row.key[0] for one in contacts]
    matrix, momenta = sizes * slope.T * weights, sizes[:, 0] * (to_array(balance.mass) @ jump[:, 0])
    impulses = (least_norm(matrix, momenta) if matrix.size else np.zeros(len(slope))) * weights
    struck_by = np.split(impulses, [len(slope) - len(contacts)])
    program = assembly.shared.get(
        _IMPULSES, lambda: part_powers(assembly.mechanism, assembly.maximal, assembly.parameters, of_impulses=True)
    )
    struck, idle = (
        _rows(assembly, program.program, t, q, middle, factor * jump, *(factor * one[:, None] for one in struck_by))[
            :, 0
        ]
        for factor in (1.0, 0.0)
    )
    found = _sorted(program.flows, struck - idle, connectors)
    for path, power in zip(keys, impulses * (slope @ middle[:, 0]), strict=True):
        key = "impacts", path, ""
        found[key] = found.get(key, np.zeros(())) + power
    return found


def _undetermined(segment: SegmentRecord, connectors: Connectors) -> set[str]:
    """Return the parts at whose connectors redundant constraints leave open what comes in.

    Constraints are given multipliers that add up to no force at all: are there connectors that take in power by them?
    """
    assembly = segment.assembly
    start = float(segment.time[0]), segment.coordinates[:, 0], segment.speeds[:, 0]
    if not ReactionSolver(assembly, *start).finding.redundant:
        return set()
    program = _powers_of(assembly)
    random, found = np.random.default_rng(0), set[str]()
    sizes = motion_scales(assembly.maximal, scene_length(assembly))[:, None]
    weights = multiplier_sizes(assembly, "dae")
    for share in _LOOKS:
        place = [int(share * (len(segment.time) - 1))]
        t = segment.time[place]
        q, u = maximal_state(assembly, t, segment.coordinates[:, place], segment.speeds[:, place])
        matrix = sizes * to_array(balance_of(assembly, "dae").at(float(t[0]), q[:, 0], u[:, 0]).jacobian).T * weights
        anything = random.standard_normal(len(weights))
        free = anything - least_norm(matrix, matrix @ anything)
        powers = [
            _rows(assembly, program.program, t, q, u, np.zeros_like(u), (weights * each)[:, None])
            for each in (np.zeros_like(anything), anything, free)
        ]
        usual, own = (_sorted(program.flows, one - powers[0], connectors) for one in powers[1:])
        limit = _FREE * max((abs(float(value[0])) for value in usual.values()), default=0.0)
        found |= {path for (field, path, _), value in own.items() if field == "work" and abs(value[0]) > limit}
    return found
