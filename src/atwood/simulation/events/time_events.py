"""Time events: when relations of functions of time alone change, and which values they have between.

A run stops and goes on at each, with the values that hold on the further side (see `atwood.expr.core.relations`). They
are found from the expressions themselves, by interval arithmetic: an interval in which a function cannot be zero has no
event, one in which it cannot but rise or fall has at most one, and any other is halved. So no pulse is too short to be
found, however long the run (Moore, Kearfott and Cloud, Introduction to Interval Analysis, chapter 8).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from atwood.arrays import BoolArray, FloatArray, IndexArray
from atwood.errors import SolveError
from atwood.expr import Expression, InputGroup, OutputGroup, Program, jvp, live
from atwood.expr.core.intervals import Bounds, bounds
from atwood.expr.core.relations import relation_value
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.lazy_dataclasses import dataclass

_RELATION: Key[Program] = Key("relation of functions of time")
_SCHEDULE: Key[Schedule] = Key("schedule")
_LAST_SCHEDULE: Key[dict[tuple[float, float, bytes], Schedule]] = Key("when relations change in the last scene")
_RATE_OF_RELATION: Key[list[Expression]] = Key("its derivative")


MOMENT = 16.0
"""Times that are so many units of rounding apart are one moment."""

_MOST = 100_000
"""So many events of one relation are looked for; a run through more would hardly end."""

_OPEN = 3
"""So many intervals for each event can still be open."""

_GRID = 20_000
"""Functions in Python, which have no bounds, are looked at so many times a run."""

_SHORTEST = 1e-30
"""Relative to the run: what is shorter is a moment, also near t = 0."""

_INSIDE = (0.5, 0.381966011250105, 0.7639320225002103)
"""Where in an interval a value is read: all three would have to be zero by chance."""


@dataclass(frozen=True, eq=False)
class Schedule:
    """The values of the relations of a scene along a run.

    Attributes
    ----------
    times
        When they change, s, in order; neither at the start of the run nor at its end.
    values
        Their values before the first of these times, between them, and after the last; shape (relations, times + 1).
    """

    times: FloatArray
    values: FloatArray

    def piece(self, t: float) -> int:
        """Return in which piece a time is; a time of change belongs to what comes after it."""
        return int(self.times.searchsorted(t, side="right"))

    def next(self, t: float, end: float) -> float:
        """Return the next time of change after a time, or the end of the run."""
        piece = self.piece(t)
        return float(self.times[piece]) if piece < len(self.times) else end

    def reached(self, t: float) -> float:
        """Return a time, or the time of change that comes so soon that it is the same moment."""
        coming = self.next(t, np.inf)
        return coming if coming - t <= MOMENT * np.spacing(abs(coming)) else t

    def at_samples(self, samples: FloatArray) -> Schedule:
        """Return the same with times that are those of samples but for rounding put there.

        So what is asked for at a time event is its further side, however its time was rounded.
        """
        if not len(self.times) or not len(samples):
            return self
        after = np.clip(np.searchsorted(samples, self.times), 1, max(1, len(samples) - 1))
        low, high = samples[after - 1], samples[np.minimum(after, len(samples) - 1)]
        nearest = np.where(self.times - low < high - self.times, low, high)
        is_same = np.abs(nearest - self.times) <= 0.5 * MOMENT * np.spacing(np.abs(self.times))
        return Schedule(np.where(is_same, nearest, self.times), self.values)

    def applied(self, assembly: Assembly, piece: int) -> Assembly:
        """Return a scene with the values of one piece."""
        return assembly.with_relations(self.values[:, piece]) if len(self.values) else assembly

    def rows(self, assembly: Assembly, times: FloatArray) -> Assembly:
        """Return a scene for vectorized kernels alone, with the values that hold at each of some times."""
        if not len(self.values):
            return assembly
        known = assembly.parameter_values[: len(assembly.parameters) - len(self.values)]
        chosen = self.values[:, np.searchsorted(self.times, times, side="right")]
        return assembly.with_rows(np.concatenate([np.tile(known[:, None], (1, len(times))), chosen]))


def find_schedule(assembly: Assembly, start: float, end: float) -> Schedule:
    """Return when the relations of a scene change in a run, and their values."""
    relations = assembly.relations
    if not relations or not end > start:
        return Schedule(np.zeros(0), np.array([assembly.relation_values]).reshape(len(relations), 1))

    def find() -> Schedule:
        pieces = _Pieces(np.array([start, end]), np.zeros((0, 1)))
        for number in range(len(relations)):
            pieces = pieces.with_relation(assembly, number)
        return pieces.schedule()

    def look() -> Schedule:
        """Return what the last scene of this structure has, if it has these values; what warns does so each time."""
        if any(node.operation == "external" for node in live([one.zero for one in relations])):
            return find()
        about = start, end, assembly.parameter_values[: len(assembly.parameters) - len(relations)].tobytes()
        last = assembly.shared.get(_LAST_SCHEDULE, dict)
        found = last.get(about)
        if found is None:
            found = find()
            last.clear()
            last[about] = found
        return found

    return assembly.kept.get(_SCHEDULE, look, start, end)


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Pieces of a run, in each of which the relations that were looked at so far have one value.

    Attributes
    ----------
    edges
        Where they begin and end.
    values
        Values of the relations, shape (relations, pieces).
    """

    edges: FloatArray
    values: FloatArray

    def with_relation(self, assembly: Assembly, number: int) -> _Pieces:
        """Return the pieces that one more relation leaves."""
        search = _Search(assembly, number, self)
        roots = search.roots()
        after = np.clip(np.searchsorted(self.edges, roots), 1, len(self.edges) - 1)
        near = MOMENT * np.spacing(np.abs(roots))
        inside = (roots > self.edges[after - 1] + near) & (roots < self.edges[after] - near)
        edges = np.unique(np.concatenate([self.edges, roots[inside]]))
        owner = np.searchsorted(self.edges, edges[:-1], side="right") - 1
        own = np.zeros(len(owner))
        for share in _INSIDE:  # the first that is not zero tells
            values = search.value(edges[:-1] + share * np.diff(edges), owner)
            own = np.where(own == 0.0, values, own)
        kind = assembly.relations[number].kind
        found = np.array([relation_value(kind, value) for value in own.tolist()])
        return _Pieces(edges, np.concatenate([self.values[:, owner], found[None, :]])).joined()

    def joined(self) -> _Pieces:
        """Return the same without edges at which nothing changes."""
        kept = np.append(True, np.any(self.values[:, 1:] != self.values[:, :-1], axis=0))
        return _Pieces(np.append(self.edges[:-1][kept], self.edges[-1]), self.values[:, kept])

    def schedule(self) -> Schedule:
        """Return times and values, without pieces that last no longer than rounding."""
        sizes = np.maximum(np.abs(self.edges[:-1]), np.abs(self.edges[1:]))
        lasting = np.diff(self.edges) > MOMENT * np.spacing(sizes)
        left = _Pieces(np.append(self.edges[:-1][lasting], self.edges[-1]), self.values[:, lasting]).joined()
        return Schedule(left.edges[1:-1], left.values)


class _Search:
    """The search for the times at which one function of time passes zero.

    Parameters
    ----------
    assembly
        The scene.
    number
        Of the relation that compares the function with zero.
    pieces
        Where it is smooth, and the values of the relations before it there.
    """

    def __init__(self, assembly: Assembly, number: int, pieces: _Pieces) -> None:
        self._assembly, self._number, self._pieces = assembly, number, pieces
        relations = assembly.relations
        self._symbols = tuple(one.symbol for one in relations[:number])
        self._time, self._difference = assembly.mechanism.time, relations[number].zero
        count = len(assembly.parameters) - len(relations)
        self._known = dict(zip(assembly.parameters[:count], assembly.parameter_values[:count].tolist(), strict=True))

        def make() -> Program:
            groups = (InputGroup("t", (self._time,)), InputGroup("relations", self._symbols))
            outputs = (OutputGroup("difference", (self._difference, relations[number].difference)),)
            return Program(f"{assembly.flat.name} time", groups, assembly.parameters[:count], outputs)

        program = assembly.shared.get(_RELATION, make, number)
        self._kernel = assembly.compiled(program, vectorized=True).bind(assembly.parameter_values[:count])

    def function(self, times: FloatArray, owner: IndexArray) -> FloatArray:
        """Return the function at times in pieces of these numbers."""
        return self._row(0, times, owner)

    def value(self, times: FloatArray, owner: IndexArray) -> FloatArray:
        """Return what the relation is of, at times in pieces of these numbers."""
        return self._row(1, times, owner)

    def _row(self, row: int, times: FloatArray, owner: IndexArray) -> FloatArray:
        with np.errstate(all="ignore"):
            values = self._kernel(times[None, :], self._pieces.values[:, owner])[0]
        return np.array(np.broadcast_to(values[row], times.shape), dtype=float)

    def _is_positive(self, times: FloatArray, owner: IndexArray) -> BoolArray:
        return self.function(times, owner) >= 0.0

    def roots(self) -> FloatArray:
        """Return the times at which the function changes its sign."""
        nodes = live([self._difference])
        if self._time not in nodes:
            return np.zeros(0)
        low, high = self._pieces.edges[:-1], self._pieces.edges[1:]
        boxes = _Boxes(low, high, np.arange(len(low)))
        if any(node.operation == "external" for node in nodes):
            self._warn()
            found = self._on_grid(boxes)
        else:
            found = self._isolated(boxes)
        changes = self._is_positive(found.low, found.owner) != self._is_positive(found.high, found.owner)
        found = found.chosen(changes)
        return self._refined(found)

    def _isolated(self, boxes: _Boxes) -> _Boxes:
        """Return intervals in which the function may change its sign, once at most as far as rounding tells."""
        (derivative,) = self._assembly.shared.get(
            _RATE_OF_RELATION, lambda: jvp([self._difference], {self._time: 1.0}), self._number
        )
        found: list[_Boxes] = []
        doubtful: list[_Boxes] = []
        while len(boxes.low):
            if len(boxes.low) > _OPEN * _MOST or sum(len(one.low) for one in found) > _MOST:
                raise SolveError(
                    f"a relation of time switches more than {_MOST} times in this run, or is zero throughout",
                    where=self._where(),
                    advice="Replace the function by its mean, or shorten the run.",
                )
            low, high = self._bounds(self._difference, boxes)
            boxes, low, high = boxes.chosen(kept := (low <= 0.0) & (high >= 0.0)), low[kept], high[kept]
            least, most = self._bounds(derivative, boxes)
            single = (least > 0.0) | (most < 0.0)
            found.append(boxes.chosen(single))
            middle = boxes.middle
            at = self._bounds(self._difference, _Boxes(middle, middle, boxes.owner))
            is_rounding = (at[0] <= 0.0) & (at[1] >= 0.0) & (at[1] - at[0] >= 0.5 * (high - low))
            is_moment = (middle <= boxes.low) | (middle >= boxes.high)
            is_moment |= boxes.high - boxes.low <= _SHORTEST * (self._pieces.edges[-1] - self._pieces.edges[0])
            doubtful.append(boxes.chosen(~single & (is_rounding | is_moment)))
            boxes = boxes.chosen(~single & ~is_rounding & ~is_moment).halved()
        return _together([*found, _together(doubtful).merged()])

    def _bounds(self, expression: Expression, boxes: _Boxes) -> Bounds:
        values: dict[Expression, Bounds] = {one: (np.array([x]), np.array([x])) for one, x in self._known.items()}
        rows = self._pieces.values[:, boxes.owner]
        values |= {one: (row, row) for one, row in zip(self._symbols, rows, strict=True)}
        ((low, high),) = bounds([expression], {**values, self._time: (boxes.low, boxes.high)})
        return np.broadcast_to(low, boxes.low.shape), np.broadcast_to(high, boxes.low.shape)

    def _on_grid(self, boxes: _Boxes) -> _Boxes:
        """Return the same intervals, divided evenly."""
        share = max(2, -(-_GRID // len(boxes.low)))
        points = boxes.low[:, None] + (boxes.high - boxes.low)[:, None] * np.linspace(0.0, 1.0, share + 1)
        points[:, -1] = boxes.high
        return _Boxes(points[:, :-1].ravel(), points[:, 1:].ravel(), np.repeat(boxes.owner, share))

    def _refined(self, boxes: _Boxes) -> FloatArray:
        """Return the moment at which the function changes its sign in each interval, to rounding."""
        low, high, owner = boxes.low.copy(), boxes.high.copy(), boxes.owner
        before = self._is_positive(low, owner)
        shortest = _SHORTEST * (self._pieces.edges[-1] - self._pieces.edges[0])
        while True:
            middle = 0.5 * (low + high)
            open_ = (low < middle) & (middle < high) & (high - low > shortest)
            if not open_.any():
                break
            same = self._is_positive(middle, owner) == before
            low, high = np.where(open_ & same, middle, low), np.where(open_ & ~same, middle, high)
        return np.sort(np.where(self.function(low, owner) == 0.0, low, high))

    def _warn(self) -> None:
        span = self._pieces.edges[-1] - self._pieces.edges[0]
        warnings.warn(
            f"{self._where()}: when it switches by the clock depends on a function in Python, which is looked at "
            f"{_GRID} times; what lasts less than {span / _GRID:.3g} s could be missed",
            stacklevel=2,
        )

    def _where(self) -> str:
        """Return the path of the input that the relation is of; of the scene where it is in a law."""
        assembly = self._assembly
        symbol = assembly.relations[self._number].symbol
        for path, local in assembly.mechanism.locals_.items():
            for name, value in local.binding.values.items():
                if isinstance(value, Expression) and symbol in live([value]):
                    return f"{path}.{name}"
        return assembly.flat.name


@dataclass(frozen=True, eq=False)
class _Boxes:
    """Intervals of time, and the number of the piece that each is in."""

    low: FloatArray
    high: FloatArray
    owner: IndexArray

    @property
    def middle(self) -> FloatArray:
        return 0.5 * (self.low + self.high)

    def chosen(self, mask: BoolArray) -> _Boxes:
        return _Boxes(self.low[mask], self.high[mask], self.owner[mask])

    def halved(self) -> _Boxes:
        middle = self.middle
        ends = np.concatenate([self.low, middle]), np.concatenate([middle, self.high])
        return _Boxes(*ends, np.concatenate([self.owner, self.owner]))

    def merged(self) -> _Boxes:
        """Return intervals in the place of neighbours."""
        order = np.argsort(self.low)
        low, high, owner = self.low[order], self.high[order], self.owner[order]
        first = np.append(True, (low[1:] > high[:-1]) | (owner[1:] != owner[:-1])) if len(low) else low > 0.0
        last = np.append(first[1:], True) if len(low) else first
        return _Boxes(low[first], high[last], owner[first])


def _together(boxes: Sequence[_Boxes]) -> _Boxes:
    return _Boxes(*(np.concatenate([getattr(one, name) for one in boxes]) for name in ("low", "high", "owner")))
