"""What gaps and slips do at a moment: impacts, and which of them hold from then on.

Between two moments the states of gaps and slips are parameters of the equations. At a moment velocities jump where a
gap closes with a speed, and the states are found anew such that no inequality is contradicted at accelerations.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from itertools import combinations, islice, pairwise

import numpy as np

from atwood.arrays import BoolArray, FloatArray
from atwood.errors import SolveError, StartError
from atwood.expr import evaluate
from atwood.forms.assembly import Assembly
from atwood.integrators.sets.record import REFUSED, UNDETERMINED
from atwood.integrators.sets.series import (
    ACCUMULATE,
    ALIKE,
    BEND,
    EVEN,
    FLATTENS,
    IN_TURN,
    LATER,
    LEVEL,
    LONG,
    LOSSLESS,
    OFTEN,
    RECENT,
    SHORT,
    SPANS,
    SQUEEZED,
    STEADY,
    WAITS,
)
from atwood.integrators.sets.shares import MOST_SHARES
from atwood.integrators.sets.sizes import (
    APART,
    ASTRAY,
    BEGINS,
    BLURRED,
    FAST,
    GAIN,
    NEAR_REST,
    ROUNDED,
    SEEN,
    SHARED,
    STEP,
    UNMOVED,
)
from atwood.lazy_dataclasses import dataclass, replace
from atwood.mechanics.outputs.event_functions import CLOSES, OPENS, RESTS, STOPS, YIELDS
from atwood.model.values.units import ALONG
from atwood.numerics.contact_sets import (
    CLEAR,
    FIRM,
    GOES_ON,
    NOTHING,
    OPEN,
    SLACK,
    STICKS,
    Found,
    State,
    all_states,
    find_states,
    sizes_of,
)
from atwood.numerics.matrices import least_norm
from atwood.numerics.rank import rank
from atwood.simulation.contacts.event_records import in_own_words, told_changes, told_impact, told_rest
from atwood.simulation.contacts.forces import MOST_TURNS, forces_in, is_same, of_impulses, rows_that_hold
from atwood.simulation.contacts.states import states_of, values_of_states, without_loose
from atwood.simulation.contacts.values import ContactValues, unmoved
from atwood.simulation.dynamics.orientation_coordinates import to_regular
from atwood.simulation.dynamics.scales import Scales
from atwood.simulation.events.mode_change import generalized_speeds
from atwood.simulation.events.modes import EventRecord
from atwood.tolerances import tolerances

NEAR = 10.0
"""Times the relative tolerance, in sizes of the scene: what is nearer to zero is there."""

LEFT = 10.0
"""Times the root of the tolerance, in units of the scene's time: so long may impacts still go on that are summed.

What still rises in one interval rises by some tolerances, and rounding mostly does not tell in its intervals yet.
"""

ROUGH = 0.01
"""In units of the scene's time: so long may impacts still go on that are summed where rounding tells in them."""

CONTRADICT = "Contacts contradict each other here: look at what moves them, and at their friction."

_POISSON = "Choose Poisson's law for the part, with impact_law='poisson' for it or for its gap"

_SHARES = "Give each of them a stiffness, as a place that gives way a little has, or one of them no friction."

_HELD = "friction is at its limit where other places hold what would slip, so that nothing says which way it rubs"
_TOGETHER = "With static friction above that of slipping all begin to slip together."

_ALONG = 1e-3
"""Of what is slow: by so much goes what is moved along."""

_INSIDE = 32.0
"""Times rounding of the coordinates: a gap that starts no deeper is closed."""

_MOST_IMPACTS = 1000
"""So many impacts one after the other happen at one moment at most."""


@dataclass(frozen=True, eq=False)
class Changed:
    """What has become of a scene at a moment.

    Attributes
    ----------
    speeds
        Those of the form.
    held
        Values of the discrete states.
    events
        What has happened.
    touching
        The same as `held` with every gap closed that was at zero then, and nothing that rubs; empty where none was.
    """

    speeds: FloatArray
    held: tuple[float, ...]
    events: tuple[EventRecord, ...]
    touching: tuple[float, ...] = ()


class _Moment:
    """Gaps and slips at one moment, while it is worked out what becomes of them; each is a unit of one or two rows."""

    def __init__(self, values: ContactValues, scales: Scales, relative: float, triggers: Sequence[EventRecord]) -> None:
        self.values, self.layout = values, values.layout
        self.contacts, self.units, self.t = values.contacts, values.units, values.t
        self.first, self.places = self.layout.first, self.layout.places
        self.u = values.u.copy()
        self.held = list(values.assembly.held_now)
        self.before = states_of(self.layout, self.held)
        near = NEAR * max(relative, 1e-13)
        self.small = np.array([near * scales.of(ALONG[one.law.options.unit]) for one in self.first])
        self.slow = self.small / scales.time
        self.rounding = ROUNDED / near * self.small
        self.unmoved = np.array([unmoved(one, scales) for one in self.first])
        self.triggers = {(one.part, one.law): one.target for one in triggers}
        self.events: list[EventRecord] = []
        self.resting: list[int] | None = None
        self._series: list[int] = []
        self._in_turn = False

    def trigger(self, k: int) -> str:
        """Return the target of the event of a unit; empty where it has none now."""
        return self.triggers.get(self.first[k].row.key[:2], "")

    @property
    def touching(self) -> list[int]:
        """The gaps that are closed; that of an event is, also where rounding far from the origin is no longer small."""
        values, small = self.values.values.tolist(), self.small.tolist()
        return [
            k
            for k, is_slip in enumerate(self.layout.is_slip)
            if not is_slip
            and (self.before[k][0] == STICKS or self.trigger(k) == CLOSES or values[self.units[k][0]] <= small[k])
            if k not in self.layout.speeds or self.before[k][0] == STICKS or self._is_slow(k)
            if not self._is_inert(k)
        ]

    def _is_inert(self, k: int) -> bool:
        """Return whether joints hold a gap and all that slips there, as a place on the axis of a hinge is held.

        Nothing presses it then, and it rubs nowhere. What moves into it all the same contradicts.
        """
        values, row, slow = self.values, self.units[k][0], self.slow[k]
        if values.response[row, row] > NOTHING / UNMOVED * self.unmoved[k] or self.rates()[row] < -slow:
            return False
        own = np.sum(values.by_free_ways()[0] ** 2, axis=1)  # what rounding makes of the response is no square
        units = [k, *(j for j, gap in enumerate(values.gap_of) if gap == k)]
        is_held = all(own[i] <= self.unmoved[j] for j in units for i in self.units[j])
        return is_held and bool(values.accelerations()[row] >= -slow * slow / self.small[k])

    def _is_slow(self, k: int) -> bool:
        return bool(self.rates()[self.units[k][0]] <= self.slow[k])

    def all_closed(self) -> tuple[float, ...]:
        """Return the states with every gap closed that is at zero, and nothing that rubs; empty where there is none.

        Where impacts have accumulated these are the gaps that rest; others may pass near by.
        """
        closed = set(self.touching if self.resting is None else self.resting)
        if not closed:
            return ()
        found = list(self.held)
        for k, places in enumerate(self.places):
            for place in places:
                found[place] = 1.0 if k in closed else 0.0
        return tuple(found)

    def rates(self) -> FloatArray:
        """Return the rates of all rows now."""
        return self.values.rates + self.values.slopes @ (self.u - self.values.u)

    def rate(self, k: int, rates: FloatArray) -> float:
        """Return the rate of a gap, or the size of a slip."""
        own = rates[list(self.units[k])]
        return math.hypot(*own) if self.layout.is_slip[k] else float(own[0])

    def slips_at(self, gaps: Sequence[int]) -> list[int]:
        """Return the slips that may rub where some gaps are closed."""
        at, places = self.values.gap_of, {-1, *gaps}
        return [k for k, is_slip in enumerate(self.layout.is_slip) if is_slip and at[k] in places]

    # -- impacts --------------------------------------------------------------------------------------------------

    def collide(self, one_by_one: bool) -> None:
        """Let what approaches collide, until nothing does."""
        for _ in range(_MOST_IMPACTS):
            rates, touching = self.rates(), self._at_once()
            speeds = {k: self.rate(k, rates) for k in touching}
            coming = [k for k in touching if speeds[k] < -self.slow[k]]
            if not coming:
                return
            touching += [k for k in self.layout.speeds if k not in touching]
            if one_by_one:
                fastest = min(speeds[k] for k in coming)
                touching = [k for k in coming if speeds[k] <= fastest * (1.0 - 1e-9)]
            self._impact(touching, rates)
        raise SolveError(
            f"at t = {self.t:.9g} impacts follow each other without end",
            where=self.first[0].row.key[0],
            advice="With impacts='together' they are solved at once.",
        )

    def _at_once(self) -> list[int]:
        """Return the gaps that collide at once; where impacts accumulate in turn only those that are at zero."""
        touching, values = self.touching, self.values.values
        if not self._in_turn:
            return touching
        return [
            k
            for k in touching
            if self.before[k][0] == STICKS or self.trigger(k) or values[self.units[k][0]] <= APART * self.rounding[k]
        ]

    def left_of(self, impacts: Sequence[tuple[float, str]], longest: tuple[float, float, float]) -> float | None:
        """Return in how long impacts that follow each other ever faster have come to an end; None if they do not.

        Intervals that shrink by a factor r are a geometric series: what is left of it is the last one times r/(1 - r).
        It counts what moves together with the gap that closes now. Where rounding tells, as far from the origin or at
        the tightest tolerances, r grows to 1, and nothing is gained by going on (see `longest_left`). It also grows
        where what bounces is squeezed by what is heavier, faster than it falls: that is no series, and impacts that
        lose nothing are none.
        """
        closing = [k for k, one in enumerate(self.first) if self.trigger(k) == CLOSES and not one.is_speed]
        if not closing or len(impacts) < SPANS[0]:
            return None
        response = np.abs(self.values.response[self.units[closing[0]][0]])
        moved = response > 1e-12 * float(np.max(response))
        parts = {one.row.key[0] for one, is_moved in zip(self.contacts, moved, strict=True) if is_moved}
        spans, in_turn, lasts = self._intervals(impacts, parts, self.first[closing[0]].row.key[0])
        speed, newest = abs(float(self.values.rates[self.units[closing[0]][0]])), 0.5 * sum(spans[:2])
        self._in_turn = in_turn and lasts[0] < ACCUMULATE * lasts[1]
        if in_turn and not _is_alike(spans, RECENT):  # two gaps in turn, each after an interval of its own
            spans = [a + b for a, b in zip(spans[::2], spans[1::2], strict=False)]
        if self._in_turn and not _is_alike(spans, RECENT // 2):
            return self._end_of_swings(closing, impacts, (newest, speed), lasts)
        if len(spans) < SPANS[0] or spans[0] <= 0.0:
            return None
        # Impacts that only happen to be near each other are no series: each interval shrinks about as the one before.
        ratios = np.array([after / before for after, before in pairwise(spans)])
        typical = float(np.exp(np.mean(np.log(ratios[: SPANS[0] - 1]))))
        long = _first(np.abs(np.log(ratios / typical)) > math.log(IN_TURN if in_turn else STEADY))
        count = _first(np.abs(np.log(ratios[: SPANS[1] - 1] / typical)) > math.log(EVEN))
        if count < SPANS[0] - 1:
            return None
        share = float(np.exp(np.mean(np.log(ratios[:count]))))
        left: float = spans[0] * share / (1.0 - share) if share < 1.0 else math.inf
        most = 2.0 * left
        lasted = float(np.sum(spans[: count + 1]))
        is_elastic, pull = self._bouncing(
            closing[0], moved, {part for time, part in impacts if time >= self.t - lasted}
        )
        if speed > pull * lasted:  # it is squeezed
            is_over = math.isfinite(left) and spans[0] * speed < SQUEEZED * self.small[closing[0]]
        else:
            lost = 1.0 - float(self.values.restitution[self.units[closing[0]][0]])
            is_blurred = share > LEVEL and spans[0] * speed * lost < BLURRED * self._rounding(closing[0]) and lost > 0.0
            # Rounding makes each bounce from the one before.
            if is_blurred or (share > LEVEL and spans[0] < SHORT * longest[2]):
                left, most = spans[0], spans[0] * (1 if is_elastic else max(2.0 / (lost or 1.0), LONG))
            flattens = not in_turn and 1.0 - ratios[0] < FLATTENS * (1.0 - share)
            stays = share * speed <= self.slow[closing[0]] and math.isfinite(left)  # it would rest untold
            most_left = (longest[1] if flattens else longest[0]) if long >= min(count, RECENT) else longest[2]
            is_over = stays or is_blurred or left < most_left
        if not is_over or (is_elastic and (share <= LEVEL or spans[0] > LOSSLESS * longest[2])):
            return None
        self._end_series(closing, impacts, lasted)
        found = sum_of_series(np.array(spans[: long + 1]))
        return found if 0.0 <= found <= most else left

    def _end_of_swings(
        self,
        closing: list[int],
        impacts: Sequence[tuple[float, str]],
        newest: tuple[float, float],
        lasts: tuple[float, float],
    ) -> float | None:
        """Return in how long impacts of gaps in turn come to an end whose intervals swing; None as long as gaps open.

        Parameters
        ----------
        closing, impacts
            The gaps that close now, and times and parts of the impacts before.
        newest
            How long the gap has been open since the last impact, about, and how fast it closes.
        lasts
            How long the last impacts took, and as many before.
        """
        (late, early), (span, speed) = lasts, newest
        if min(span * speed, late / RECENT * speed / SQUEEZED) > self.small[closing[0]]:
            return None
        self._end_series(closing, impacts, late + early)
        return late * late / (early - late)

    def _end_series(self, closing: list[int], impacts: Sequence[tuple[float, str]], lasted: float) -> None:
        """Find which gaps have impacts that accumulate, and take them for closed where they nearly are."""
        self._series = self._accumulating(closing, impacts, self.t - lasted)
        self.small, self.slow = (self._blurred(one, NEAR_REST) for one in (self.small, self.slow))

    def _intervals(
        self, impacts: Sequence[tuple[float, str]], parts: Collection[str], part: str
    ) -> tuple[list[float], bool, tuple[float, float]]:
        """Return the intervals between impacts of some parts as long as they shrink, the last first.

        Also whether one of the last was of another part than a given one, which does not rest, and how long the last
        of them took, and as many before.
        """
        spans, last, end, count, in_turn, shrinks = list[float](), self.t, None, 0, False, True
        rest = {one.row.key[0] for k, one in enumerate(self.first) if not one.is_slip and self.before[k][0] == STICKS}
        own, since = {time for time, one in impacts if one == part or one in rest}, [0.0, 0.0]
        for time, one in reversed(impacts):
            if one not in parts or time == end:
                continue
            end, count = time, count + 1
            in_turn = in_turn or (count < SPANS[0] and time not in own)
            span, newer = last - time, spans[-2:] if in_turn else spans[-1:]
            shrinks = shrinks and len(spans) < LONG and not (newer and span <= LEVEL * min(newer))
            if shrinks:
                spans.append(span)
            if count in (RECENT, 2 * RECENT):
                since[count // RECENT - 1] = self.t - time
            if not shrinks and count >= 2 * RECENT:
                break
            last = time
        return spans, in_turn, (since[0], since[1] - since[0])

    def _rounding(self, k: int, far: float = 0.0) -> float:
        """Return by how much rounding of the coordinates moves a gap, with places counted from as far away."""
        row = self.units[k][0]
        moved = [abs(float(one[row] - self.values.values[row])) for one in self.values.moved(STEP, far)]
        return max(ROUNDED / STEP * sum(moved), float(self.rounding[k]))

    def _bouncing(self, closes: int, moved: BoolArray, parts: Collection[str]) -> tuple[bool, float]:
        """Return whether impacts of some parts lose nothing, and how fast what they move falls, at most."""
        rows = [
            own[0]
            for k, (one, own) in enumerate(zip(self.first, self.units, strict=True))
            if not one.is_slip and moved[own[0]] and (k == closes or one.row.key[0] in parts)
        ]
        falls = np.abs(self.values.accelerations()[rows])
        return bool(np.all(self.values.restitution[rows] >= 1.0)), float(np.max(falls, initial=0.0))

    def _accumulating(self, closing: Collection[int], impacts: Sequence[tuple[float, str]], since: float) -> list[int]:
        """Return the gaps that rest where impacts accumulate: those that close, are closed, or have impacts of it."""
        parts = [part for time, part in impacts if time >= since]
        return [
            k
            for k, one in enumerate(self.first)
            if not one.is_slip
            if k in closing or self.before[k][0] == STICKS or parts.count(one.row.key[0]) >= OFTEN
        ]

    def _blurred(self, sizes: FloatArray, times: float) -> FloatArray:
        """Return what is small or slow, and so many times that of gaps whose impacts accumulate."""
        found = sizes.copy()
        found[self._series] *= times
        return found

    def stop(self, left: float, longest: float) -> None:
        """Stop what has impacts that have accumulated: nothing of it opens any more, and what has stuck goes on to.

        What would make energy waits for an impact to come, or where the series has nearly ended, does not rub.
        """
        still = [k for k, one in enumerate(self.first) if one.is_slip and self.before[k][0] == STICKS]
        rates = self.rates()
        speeds = {k: self.rate(k, rates) for k in self.touching if k in self._series}
        # What has just bounced much faster than the others only passes: its impacts have not come to an end.
        coming = max(0.0, *(-speed for speed in speeds.values()))
        resting = [k for k, speed in speeds.items() if speed <= max(ALIKE * coming, self.slow[k])]
        self.slow = self._blurred(self.slow, 1.0 / NEAR_REST)
        push = self._end_of_impacts(resting, still, rubs=True)
        if self._work_of(push, rates)[2]:
            if left > WAITS * longest:
                self.small, self._series = self._blurred(self.small, 1.0 / NEAR_REST), []
                return
            push = self._end_of_impacts(resting, still, rubs=False)
        self.resting = resting
        self.u = self.u + self.values.speeds_by(push)
        bounced = [k for k in resting if self.before[k][0] == OPEN] or resting  # and were not closed all along
        self.events += [told_rest(self.t, self.first[k].row.key[:2], left) for k in bounced[:1]]

    def _work_of(self, impulses: FloatArray, rates: FloatArray) -> tuple[FloatArray, FloatArray, bool]:
        """Return the rates after impulses, the work that each does, and whether together they do more than rounding."""
        after = rates + self.values.response @ impulses
        work, size = 0.5 * impulses * (rates + after), 0.5 * np.abs(impulses) * (np.abs(rates) + np.abs(after))
        return after, work, float(np.sum(work)) > GAIN * float(np.sum(size))

    def _end_of_impacts(self, resting: list[int], still: list[int], rubs: bool) -> FloatArray:
        """Return the impulses that take away the rates of gaps, and rub as much.

        Impulses yet to come are those of the forces that press from now on, and these, with a rest of one sign or the
        other: what still rises has been pressed, and rubbed, too much so far. What would turn round sticks.
        """
        values, rates = self.values, self.rates()
        slips = [k for k in self.slips_at(resting) if k not in still and values.gap_of[k] >= 0 and rubs]
        sliding = self._going(slips, rates)
        while True:
            states = [
                (GOES_ON, sliding[k])
                if k in sliding
                else (STICKS if k in resting or k in still or k in slips else OPEN, (0.0,) * len(rows))
                for k, rows in enumerate(self.units)
            ]
            after = rates + values.response @ (push := forces_in(values, states, rates))
            turned = [k for k, way in sliding.items() if float(np.dot(after[list(self.units[k])], way)) <= 0.0]
            if not turned:
                return push
            sliding = {k: way for k, way in sliding.items() if k not in turned}

    def _impact(self, touching: list[int], rates: FloatArray) -> None:
        values, count = self.values, len(self.contacts)
        chosen = [*touching, *self.slips_at(touching)]
        share = values.restitution
        gaps = [self.units[k][0] for k in touching]
        poisson = [i for i in gaps if self.contacts[i].is_poisson]
        free = rates.copy()
        for i in gaps:
            if i not in poisson:
                free[i] -= share[i] * max(-rates[i], 0.0)  # it opens with this speed, or faster
        impulses = self._impulses(chosen, free)
        if any(share[i] * impulses[i] > 0.0 for i in poisson):
            again = np.zeros(count)
            again[poisson] = share[poisson] * impulses[poisson]
            impulses = impulses + again
            impulses = impulses + self._impulses(chosen, free + values.response @ impulses, again)
        after, work, makes_energy = self._work_of(impulses, rates)
        if makes_energy:
            worst = max(touching, key=lambda k: float(work[self.units[k][0]]))
            raise SolveError(
                f"at t = {self.t:.9g} Newton's law of impact would make energy, {float(np.sum(work)):.3g} J",
                where=self.first[worst].row.key[0],
                advice=f"{_POISSON}.",
            )
        self.u = self.u + values.speeds_by(impulses)
        for k in touching:
            if -self.rate(k, rates) > self.slow[k]:
                rubs = [row for j in chosen if values.gap_of[j] == k for row in self.units[j]]
                self._tell_impact(k, rubs, impulses, rates, after, work)

    def _tell_impact(
        self, k: int, rubs: list[int], impulses: FloatArray, before: FloatArray, after: FloatArray, work: FloatArray
    ) -> None:
        """Tell of an impact of a gap, with friction along some rows."""
        (i,) = self.units[k]
        one, acting = self.first[k], map(float, impulses[[i, *rubs]])
        speeds, loss = (float(before[i]), float(after[i])), -float(np.sum(work[[i, *rubs]]))
        self.events.append(told_impact(self.t, one.row.key[:2], one.law.options.unit, tuple(acting), speeds, loss))

    def _impulses(self, chosen: list[int], free: FloatArray, pressed: FloatArray | None = None) -> FloatArray:
        """Return the impulses of all rows: velocities take the place of accelerations, and limits are of impulses.

        Where gaps have impulses already, `pressed`, what slips there is rubbed by these too, also if they open.
        """
        values, found = self.values, np.zeros(len(self.contacts))
        pressed = np.zeros(len(self.contacts)) if pressed is None else pressed
        for _ in range(MOST_TURNS):
            limits = of_impulses(values.limits_at(found + pressed), pressed)
            asked = values.chosen(chosen, free, {}, limits, pressed)
            solved = find_states(asked, self._at_rest(chosen))
            if solved is None:
                is_newton = any(
                    values.restitution[self.units[k][0]] > 0.0 and not self.first[k].is_poisson for k in chosen
                )
                plastic = values.chosen(chosen, self.rates(), {}, limits) if is_newton else None
                locks = plastic is not None and find_states(plastic, self._at_rest(chosen)) is not None
                advice = f"{_POISSON}: by it what locks stays where it is." if locks else CONTRADICT
                raise self._contradiction("no impulses satisfy the laws of impact and friction", chosen, advice)
            self._check_determined(chosen, solved)
            last, found = found, self._on_all(chosen, solved)
            if not self.layout.is_curved or is_same(last, found):
                break
        return found

    def _on_all(self, chosen: list[int], found: Found) -> FloatArray:
        """Return the forces of some units among those of all rows."""
        forces = np.zeros(len(self.contacts))
        forces[[row for k in chosen for row in self.units[k]]] = found.forces
        return forces

    def _at_rest(self, chosen: list[int]) -> list[State]:
        """Return the states of units that are all closed and stick."""
        return [(STICKS, (0.0,) * len(self.units[k])) for k in chosen]

    # -- accelerations --------------------------------------------------------------------------------------------

    def settle(self) -> None:
        """Find the states that hold from now on."""
        rates, touching = self.rates(), self.touching
        slow = {k for k in touching if abs(self.rate(k, rates)) <= self.slow[k]}
        slow |= self._barely_rising(touching, slow, rates)
        gaps = [k for k in touching if k in slow and self.trigger(k) != OPENS]
        slips = self.slips_at(gaps)
        if not gaps and not slips:
            return self._take([], Found((), np.zeros(0), np.zeros(0)))
        self._rest(gaps, slips)
        self.values = self.values.with_speeds(self.u)
        given = self._going(slips, self.rates())
        given |= (begins := self._begins([k for k in slips if k not in given]))
        chosen = [*gaps, *slips]
        still = *gaps, *self._stopped(slips)
        states = [(STICKS, (0.0,) * len(self.units[k])) if k in still else self.before[k] for k in chosen]
        found = self._found(chosen, states, given)
        if found is None:
            found, begins = self._jammed(chosen), {}
        turned = self._turned(chosen, found, begins)
        if turned:
            self._check_shared_before(turned)
            known = {k: way for k, way in given.items() if k not in begins}
            found = self._begun(chosen, states, known, {k: begins[k] for k in turned}) or found
        self._check_determined(chosen, found)
        if found.is_redundant:
            found = self._shared(chosen, found, turned)
        self._take(chosen, found)
        self._hold(self._on_every(chosen, found), self._going(slips, self.rates()))
        return None

    def _barely_rising(self, touching: list[int], slow: set[int], rates: FloatArray) -> set[int]:
        """Return the gaps that rise by no more than rounding before they are back: ``v^2 <= 2 A f`` times that."""
        values, rises = self.values, {k: self.rate(k, rates) for k in touching if k not in self.layout.speeds}
        highest = {k: rises[k] ** 2 / (2.0 * self.rounding[k]) for k in rises if rises[k] > self.slow[k]}
        most = FAST * float(np.max(np.abs(values.accelerations()))) if highest else 0.0
        near = {k: pull for k, pull in highest.items() if pull <= most}
        if not near:
            return set()
        every = [(STICKS if k in slow or k in near else OPEN, (0.0,) * len(rows)) for k, rows in enumerate(self.units)]
        pulls = np.diag(values.response) * forces_in(values, every)
        return {k for k, pull in near.items() if pull <= pulls[self.units[k][0]]}

    def _check_determined(self, chosen: list[int], found: Found) -> None:
        """Refuse friction that depends on shares that nothing determines; corners of one part share by least forces."""
        for some in found.moving:
            if len({self.layout.owners[chosen[i]] for i in some}) > 1:
                raise self._contradiction(REFUSED[UNDETERMINED], [chosen[i] for i in some], _SHARES)

    def _turned(self, chosen: list[int], found: Found, begins: Mapping[int, tuple[float, ...]]) -> list[int]:
        """Return what begins to slip in a plane of directions and moves otherwise than the force says that it passes.

        Something else holds it that way, or at all, and bears a part of the force that nothing determines.
        """
        if not begins:
            return []
        place, turned = {row: i for i, row in enumerate(row for k in chosen for row in self.units[k])}, []
        least = SLACK * float(np.max(np.abs(found.motions), initial=0.0) + np.max(np.abs(self.values.accelerations())))
        for k, way in begins.items():
            motion = found.motions[[place[row] for row in self.units[k]]]
            size = math.hypot(*motion)
            is_astray = size <= least or float(np.dot(motion, way)) < ASTRAY * size
            if len(way) == 2 and is_astray and self._is_held_by_others(k, self._on_every(chosen, found)):
                turned.append(k)
        return turned

    def _begun(
        self,
        chosen: list[int],
        states: list[State],
        given: dict[int, tuple[float, ...]],
        turned: Mapping[int, tuple[float, ...]],
    ) -> Found | None:
        """Return states in which what is at its limit goes where it moves, or sticks as another share allows it to."""
        states = [(GOES_ON, turned[k]) if k in turned else one for k, one in zip(chosen, states, strict=True)]
        found = self._found(chosen, states, given)
        if found is not None and not found.is_redundant:
            known = dict(zip(chosen, found.states, strict=True))
            left = self._turned(chosen, found, {k: known[k][1] for k in turned})
            if left:
                raise self._contradiction(_HELD, left, _TOGETHER)
        return found

    def _is_held_by_others(self, k: int, states: list[State]) -> bool:
        """Return whether a unit cannot move in all its directions in some states, even if it does not stick."""
        without = self._without(states, [k])
        sticks = [(STICKS, one[1]) if j == k else one for j, one in enumerate(without)]
        return self._rank(sticks) < self._rank(without) + len(self.units[k])

    def _held_with(self, k: int) -> list[int]:
        """Return what has held so far and moves with a unit."""
        response, rows = self.values.response, self.units[k]
        held = [j for j, one in enumerate(self.before) if one[0] == STICKS]
        return [j for j in held if np.any(response[np.ix_(rows, self.units[j])])]

    def _repeats(self, held: list[int]) -> bool:
        """Return whether forces of some units that hold may be shared otherwise."""
        states = [one if j in held else (OPEN, (0.0,) * len(one[1])) for j, one in enumerate(self.before)]
        return self._rank(states) < len(rows_that_hold(self.units, states))

    def _check_shared_before(self, turned: list[int]) -> None:
        """Refuse what slips by a share of a load on several parts that nothing has determined."""
        for k in turned:
            held = self._held_with(k)
            parts = {self.layout.owners[j] for j in held if self.layout.is_slip[j]}
            soft = self.values.compliance[[row for j in held for row in self.units[j]]]
            if len(parts) > 1 and not np.all(soft > 0.0):
                raise self._contradiction(REFUSED[UNDETERMINED], held, _SHARES)

    def _shared(self, chosen: list[int], found: Found, turned: Collection[int] = ()) -> Found:
        """Let go what need not hold, as long as the least forces that hold contradict a law.

        Where rows depend on each other some forces meet all laws, and others move everything alike. What is let go
        neither presses nor rubs, and stays where it is. What would have to slip with the shares so far needs others.
        """
        states, is_slip = self._on_every(chosen, found), self.layout.is_slip
        sizes = sizes_of(np.diag(self.values.response), self.values.row_sizes)
        fixed = [bool(np.all(np.isinf(sizes[list(rows)]))) for rows in self.units]  # by joints
        idle = [k for k, one in enumerate(states) if (one[0] == STICKS and fixed[k] if is_slip[k] else one[0] == OPEN)]
        states = self._without(states, idle)
        holding = [k for k, one in enumerate(states) if one[0] == STICKS]
        soft = self.values.compliance > 0.0  # gaps that give way go on to press
        loosable = sorted(
            (k for k in holding if is_slip[k] or not soft[self.units[k][0]]), key=lambda k: not is_slip[k]
        )
        some = (gone for count in range(len(loosable) + 1) for gone in combinations(loosable, count))
        least, rates = self._rank(states), self.rates()
        free = [k for k in chosen if not is_slip[k] or self.rate(k, rates) <= self.slow[k]]
        for gone in islice(some, MOST_SHARES):
            tried = self._without(states, gone)
            if self._rank(tried, FIRM) == least and self._is_shared(tried, holding, free, turned):
                return replace(found, states=tuple(tried[k] for k in chosen))
        at_limits = found.at_limits  # friction that is at its limit may say how the load is shared
        if at_limits is not None and self._is_shared(self._on_every(chosen, at_limits), holding, free, turned):
            return at_limits
        raise self._contradiction(REFUSED[UNDETERMINED], chosen, _SHARES)

    def _is_shared(self, states: list[State], holding: list[int], begins: list[int], turned: Collection[int]) -> bool:
        """Return whether the forces that are reported contradict no law, and hold what has to stay.

        Of what may begin to move no gap closes, and no slip goes another way than it rubs.
        """
        values = self.values
        forces = forces_in(values, states)
        limits, small = values.limits_at(forces)[0], SHARED * SLACK * float(np.max(np.abs(forces)))
        free = values.accelerations()
        moved, moves = free + values.response @ forces, np.abs(free) + np.abs(values.response) @ np.abs(forces)
        held = [row for k in holding for row in self.units[k]]
        slight = SHARED * SLACK * float(np.max(moves))
        if np.max(np.abs(moved[held]), initial=0.0) > slight:
            return False
        for k in begins:
            way, own = np.array(states[k][1]), moved[list(self.units[k])]
            astray = own - max(0.0, float(own @ way)) * way if states[k][0] == GOES_ON else np.zeros(1)
            if (np.linalg.norm(astray) if self.layout.is_slip[k] else -own[0]) > slight:
                return False
        for k, (rows, one) in enumerate(zip(self.units, states, strict=True)):
            own, most = forces[list(rows)], float(limits.static_free[k] + limits.static_shares[k] @ forces)
            most -= 2.0 * small if k in turned else 0.0
            if one[0] == STICKS and (math.hypot(*own) - most if self.layout.is_slip[k] else -most - own[0]) > small:
                return False
        return True

    def _on_every(self, chosen: list[int], found: Found) -> list[State]:
        """Return the states of all units."""
        known = dict(zip(chosen, found.states, strict=True))
        every = [known.get(k, (OPEN, (0.0,) * len(rows))) for k, rows in enumerate(self.units)]
        return without_loose(self.layout, every)

    def _without(self, states: list[State], let_go: Sequence[int]) -> list[State]:
        gone = {*let_go, *(k for k, gap in enumerate(self.values.gap_of) if gap in let_go)}
        return [(OPEN, (0.0,) * len(one[1])) if k in gone else one for k, one in enumerate(states)]

    def _rank(self, states: list[State], clear: float = CLEAR) -> int:
        """Return how many of the rows that hold are independent."""
        held = rows_that_hold(self.units, states)
        response = self.values.response[np.ix_(held, held)]
        size = sizes_of(np.diag(response), self.values.row_sizes[held])
        return rank(response / size / size[:, None], clear) if held else 0

    def _hold(self, states: list[State], going: Collection[int]) -> None:
        """Take away the rates of what holds from now on; what begins to slip in two directions has those of soon."""
        begins = [k for k, one in enumerate(states) if one[0] == GOES_ON and len(one[1]) == 2 and k not in going]
        holds = [k for k, one in enumerate(states) if one[0] == STICKS]
        rows, wanted = [row for k in (*holds, *begins) for row in self.units[k]], np.zeros(len(self.contacts))
        if begins:
            falls = self.values.accelerations() + self.values.response @ forces_in(self.values, states)
            sizes = [(self.slow[k], math.hypot(*falls[list(self.units[k])])) for k in begins]
            moment = min((BEGINS * slow / size for slow, size in sizes if size > 0.0), default=0.0)
            soon = [row for k in begins for row in self.units[k]]
            wanted[soon] = moment * falls[soon]
        if rows:
            self._take_away(rows, wanted)

    def _going(self, slips: list[int], rates: FloatArray) -> dict[int, tuple[float, ...]]:
        """Return the directions of the slips that go on already; what has come to rest is as slow as its event sees.

        What has gone on so far does so along with what it is moved by.
        """
        sizes, stops = {k: self.rate(k, rates) for k in slips}, self._stopped(slips)
        fast = {k for k, size in sizes.items() if size > (SEEN if k in stops else 1.0) * self.slow[k]}
        first, response = [rows[0] for rows in self.units], self.values.response
        slower = [k for k in slips if self.before[k][0] == GOES_ON and k not in stops and k not in fast]
        along = [k for k in slower if sizes[k] > _ALONG * self.slow[k]]
        fast |= {k for k in along if any(response[first[k], first[j]] for j in fast)}
        return {k: tuple(float(x) / sizes[k] for x in rates[list(self.units[k])]) for k in slips if k in fast}

    def _rest(self, gaps: list[int], slips: list[int]) -> None:
        """Take away the rates of what comes to rest now: what can move only with it rests, too."""
        stops = self._stopped(slips)
        held = *gaps, *stops, *(k for k in slips if k not in stops and self.before[k][0] == STICKS)
        if stops:
            self._take_away([row for k in held for row in self.units[k]], np.zeros(len(self.contacts)))

    def _take_away(self, rows: list[int], wanted: FloatArray) -> None:
        """Give rows other rates."""
        push, response = np.zeros(len(self.contacts)), self.values.response
        push[rows] = least_norm(response[np.ix_(rows, rows)], (wanted - self.rates())[rows])
        self.u = self.u + self.values.speeds_by(push)

    def _stopped(self, slips: list[int]) -> list[int]:
        return [k for k in slips if self.trigger(k) in (STOPS, RESTS)]

    def _found(self, chosen: list[int], states: list[State], given: dict[int, tuple[float, ...]]) -> Found | None:
        """Return states that contradict nothing at accelerations; limits may be curved in the forces."""
        values, free = self.values, self.values.accelerations()
        forces, found = np.zeros(len(self.contacts)), None
        # It starts, or has just come to touch or to rest.
        rests = all(target in (CLOSES, STOPS, RESTS) for target in self.triggers.values())
        for _ in range(MOST_TURNS):
            found = find_states(values.chosen(chosen, free, given, values.limits_at(forces)), states, rests)
            if found is None:
                return None
            last, forces = forces, self._on_all(chosen, found)
            states = list(found.states)
            if not self.layout.is_curved or is_same(last, forces):
                break
        return found

    def _begins(self, slips: list[int]) -> dict[int, tuple[float, ...]]:
        """Return the directions in which what sticks begins to slip: against forces that could hold it no longer.

        What shares a load with it, and has as little reserve, begins with it.
        """
        yields = [k for k in slips if self.trigger(k) == YIELDS]
        if not yields:
            return {}
        values, forces = self.values, forces_in(self.values, self.before)
        limits, small = values.limits_at(forces)[0], SHARED * SLACK * float(np.max(np.abs(forces)))
        for k in [one for one in yields if len(self.units[one]) == 2 and self._repeats(self._held_with(one))]:
            for j in (one for one in self._held_with(k) if one in slips and one not in yields):
                most = float(limits.static_free[j] + limits.static_shares[j] @ forces)
                if len(self.units[j]) == 2 and math.hypot(*forces[list(self.units[j])]) > most - small:
                    yields.append(j)
        own = {k: forces[list(self.units[k])] for k in yields}
        return {k: tuple(-float(x) / (math.hypot(*one) or 1.0) for x in one) for k, one in own.items()}

    def _jammed(self, chosen: list[int]) -> Found:
        """Where no accelerations contradict nothing an impulse acts (Painleve's paradox); then states are found."""
        values, rates = self.values, self.rates()
        limits = of_impulses(values.limits_at(np.zeros(len(self.contacts))))
        every = all_states(values.chosen(chosen, rates, {}, limits))
        best = max(every, key=lambda one: float(np.sum(np.abs(one.forces))), default=None)
        push = np.zeros(len(rates)) if best is None else self._on_all(chosen, best)
        if not np.max(np.abs(values.response @ push)) > SHARED * SLACK * np.max(np.abs(rates)):
            raise self._contradiction("no accelerations and no impulses are found that satisfy friction", chosen)
        self.u = self.u + values.speeds_by(push)
        self.values = self.values.with_speeds(self.u)
        pressed = [k for k in chosen if not self.first[k].is_slip and push[self.units[k][0]] > 0.0]
        self._tell(pressed[0] if pressed else chosen[0], "friction jams it: an impulse", "jams")
        rates = self.rates()
        gaps = [k for k in self.touching if abs(self.rate(k, rates)) <= self.slow[k]]
        slips = self.slips_at(gaps)
        given = self._going(slips, rates)
        left = [k for k in chosen if k in gaps or k in slips]
        found = self._found(left, self._at_rest(left), given)
        if found is None:
            raise self._contradiction("no accelerations satisfy contact and friction after an impulse", chosen)
        known = dict(zip(left, found.states, strict=True))
        states = tuple(known.get(k, (OPEN, (0.0,) * len(self.units[k]))) for k in chosen)
        return replace(found, states=states)

    def _take(self, chosen: list[int], found: Found) -> None:
        """Take the states over, and tell what has changed."""
        states = self._on_every(chosen, found)
        self.held = values_of_states(self.layout, self.held, states)
        self.events += told_changes(self.t, self.layout, self.before, states)

    def _tell(self, k: int, said: str, kind: str) -> None:
        part, law, _ = self.first[k].row.key
        self.events.append(EventRecord(self.t, part, law, said, "", kind in ("impact", "jams", "rests"), kind))

    def _contradiction(self, what: str, chosen: list[int], advice: str = CONTRADICT) -> SolveError:
        names = ", ".join(dict.fromkeys(self.first[k].row.key[0] for k in chosen))
        rigid = dict.fromkeys(self.first[k].row.key[0] for k in chosen if self.first[k].row.stiffness is None)
        if advice == _SHARES and self.values.compliance.any() and rigid:
            advice = f"Stiffness decides only where each of them has one: give one to {', '.join(rigid)}, too."
        elif advice == _SHARES and not rigid:
            advice = "At rest no share by their stiffness holds it, though another one might: load it from a motion."
        return SolveError(
            f"at t = {self.t:.9g} {what} ({names})",
            where=self.first[chosen[0]].row.key[0] if chosen else "",
            advice=advice,
        )

    def check_start(self) -> None:
        """Refuse a start inside of something; places that are given far away are rounded there."""
        table = self.values.assembly.mechanism.table
        places = evaluate([table.graph.convert(one) for one in table.origin], table.values)
        far = max(map(abs, places), default=0.0)
        for k, one in enumerate(self.first):
            unit, row = ALONG[one.law.options.unit], self.units[k][0]
            if one.is_speed and self.values.rates[row] < -self.slow[k]:
                raise StartError(
                    f"it starts the way that is locked, at {-self.values.rates[row]:.6g} {unit}/s",
                    where=one.row.key[0],
                    advice="Start where that speed is zero or positive.",
                )
            value = self.values.values[row]
            if not one.is_slip and value < -self.small[k] and value < -_INSIDE * self._rounding(k, far):
                raise StartError(
                    f"it starts inside, by {-value:.6g} {unit}",
                    where=one.row.key[0],
                    advice="Start where the gap is zero or positive.",
                )


def check_start(assembly: Assembly, state: tuple[float, FloatArray, FloatArray], length: float, scales: Scales) -> None:
    """Refuse a start inside of something; arguments as of `resolve`."""
    _Moment(ContactValues(assembly, *state, length), scales, 0.1 * tolerances.CLOSED, ()).check_start()


def _is_alike(spans: Sequence[float], count: int) -> bool:
    """Return whether so many of the last intervals are shorter than those before by one factor."""
    ratios = [after / before for after, before in pairwise(spans[: count + 1])]
    return len(ratios) >= min(count, SPANS[0] - 1) and max(ratios) <= IN_TURN * min(ratios)


def _first(is_one: BoolArray) -> int:
    """Return how many come before the first that is one."""
    return int(np.argmax([*is_one, True]))


def sum_of_series(spans: FloatArray) -> float:
    """Return how long impacts go on after the last; infinity where intervals, the last first, do not say.

    Factors of early intervals are not yet the last one, and those of late ones are rounding. So the sum is formed from
    each on, extrapolated by the way in which it changes (Aitken), and taken where its neighbours agree best.
    """
    since = np.cumsum(spans) - spans
    shares = spans[:-1] / spans[1:]
    if np.any(shares >= 1.0):
        return math.inf
    sums = spans[:-1] * shares / (1.0 - shares) - since[:-1]
    change, before = sums[:-2] - sums[1:-1], sums[1:-1] - sums[2:]
    bends = (change * before > 0.0) & (np.abs(change) < BEND * np.abs(before))
    sums = sums[:-2] + np.divide(change * change, before - change, out=np.zeros(len(change)), where=bends)
    apart = np.abs(np.diff(sums))
    worst = np.maximum(apart[:-1], apart[1:])
    return float(sums[np.argmin(worst) if len(worst) else 0]) if len(sums) else math.inf


def longest_left(relative: float, scales: Scales) -> tuple[float, float, float]:
    """Return how long impacts may still go on that are summed, s.

    The first is the rule, the second where rounding tells in them, the third where they are uneven: then longer than
    bounces of which rounding makes the next.
    """
    usual, bounce = LEFT * relative**0.5 * scales.time, (64.0 * ROUNDED) ** 0.5 * scales.time
    return usual, max(usual, ROUGH * scales.time), max(LATER * usual, 2.0 * bounce)


def resolve(
    assembly: Assembly,
    state: tuple[float, FloatArray, FloatArray],
    length: float,
    scales: Scales,
    relative: float,
    triggers: Sequence[EventRecord] = (),
    one_by_one: bool = False,
    impacts: Sequence[tuple[float, str]] = (),
    is_start: bool = False,
    told: float | None = None,
) -> Changed:
    """Return what becomes of gaps and slips at a moment.

    Parameters
    ----------
    assembly
        The scene, with the states before.
    state
        Time, coordinates and speeds in its form.
    length, scales
        Extent and sizes of the scene.
    relative
        Relative tolerance of the run.
    triggers
        The events that have led here.
    one_by_one
        Whether of several impacts the fastest comes first.
    impacts
        Time and part of the impacts before, in order.
    is_start
        Whether the run begins here.
    told
        The time that events are told of, s, where rounding made it another one.
    """
    t, q, u = state
    moment = _Moment(ContactValues(assembly, t, q, u, length), scales, relative, triggers)
    moment.t = t if told is None else told
    before = moment.values.u
    longest = longest_left(relative, scales)
    left = moment.left_of(impacts, longest)
    if is_start:
        moment.check_start()
    if left is not None:
        moment.stop(left, longest[0])
    touching = moment.all_closed()
    moment.collide(one_by_one)
    moment.settle()
    was, now = list(moment.before), states_of(moment.layout, moment.held)
    if is_start:
        closed = [one.is_closed_at_start(assembly.flat.parts) for one in moment.first]
        was = [(STICKS, one[1]) if is_closed else one for one, is_closed in zip(was, closed, strict=True)]
    events = in_own_words(assembly, moment.layout, moment.t, moment.events, (was, now))
    if np.array_equal(moment.u, before):
        speeds = u
    elif assembly.form == "dae":
        speeds = moment.u
    else:
        speeds = generalized_speeds(assembly, t, to_regular(assembly, q), moment.u, moment.values.sizes)
    return Changed(speeds, tuple(moment.held), tuple(events), touching)
