"""Which position of closed loops formulas lead to: signs of roots, and directions from which angles are counted."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence

import numpy as np

from atwood.expr import Expression, evaluate, substitute
from atwood.late import dataclass

__all__ = ["ClosedLoops", "Group", "Heading", "Place", "is_ahead", "spectrum"]

_AHEAD = 1.0 + 1e-6
"""One term of a direction must be so many times as large as all others together."""


@dataclass(frozen=True, eq=False)
class Place:
    """Where formulas are compared with constraints, and where a run begins.

    Attributes
    ----------
    parameters
        Their values.
    here
        Time and coordinates of an admissible position.
    length
        The extent of the scene, m.
    """

    parameters: Mapping[Expression, float]
    here: Mapping[Expression, float]
    length: float


@dataclass(frozen=True, eq=False)
class Heading:
    """A direction ``(p, q)``, from which an angle is counted so that it has no jumps.

    Where one can tell that it never turns away by a quarter from a sum of known angles and a phase, that is what it is
    counted from. Else it is counted from a phase alone, ahead of it or behind it, and whenever it turns away by a
    quarter, which is an event, from the other side.

    Attributes
    ----------
    phase
        The symbol of the phase.
    components
        Both components.
    angles, orders
        The angles that they depend on, and how often each is counted.
    flip, offset
        Symbols of the side, 1 or -1, and of the half turns since the start; None where none are counted.
    ahead, beside
        Then the components along the phase and across it.
    """

    phase: Expression
    components: tuple[Expression, Expression]
    angles: tuple[Expression, ...] = ()
    orders: tuple[int, ...] = ()
    flip: Expression | None = None
    offset: Expression | None = None
    ahead: Expression | None = None
    beside: Expression | None = None

    @property
    def symbols(self) -> tuple[Expression, ...]:
        """Its symbols."""
        return tuple(one for one in (self.phase, self.flip, self.offset) if one is not None)

    def values(self, place: Place) -> dict[Expression, float] | None:
        """Return the values of its symbols at a position; None where the direction can turn away unseen."""
        if self.flip is None or self.offset is None:
            phase = self._phase(place)
            return None if phase is None else {self.phase: phase}
        p, q = evaluate(self.components, {**place.parameters, **place.here})
        return {self.phase: math.atan2(q, p), self.flip: 1.0, self.offset: 0.0}

    def _phase(self, place: Place) -> float | None:
        found = spectrum(self.components, self.angles, place)
        best = None if found is None else found[self.orders]
        if found is None or best is None or not is_ahead(found, self.orders):
            return None
        return math.atan2(best.imag, best.real)


@dataclass(frozen=True, eq=False)
class Group:
    """One constraint with one unknown coordinate, or the constraints of a joint with two.

    Attributes
    ----------
    unknowns
        Numbers of the coordinates that it gives.
    constraints
        Numbers of its constraints.
    along
        For each equation for the speeds of the unknowns, by what to multiply the constraints.
    places
        Each unknown, and its sine and cosine if it is an angle, in terms of what was known before.
    margins
        The square of the sine of the angle between two links or a link and a slide; 0 at a dead centre.
    signs
        Symbols of the signs of roots, and what has the sign in terms of all coordinates.
    turns
        Symbols of whole turns, and what they are.
    headings
        Directions that unknown angles are counted from.
    """

    unknowns: tuple[int, ...]
    constraints: tuple[int, ...]
    along: tuple[tuple[Expression, ...], ...]
    places: Mapping[Expression, Expression]
    margins: tuple[Expression, ...] = ()
    signs: Mapping[Expression, Expression] | None = None
    turns: Mapping[Expression, Expression] | None = None
    headings: tuple[Heading, ...] = ()


@dataclass(frozen=True, eq=False)
class ClosedLoops:
    """The dependent coordinates of a mechanism as functions of the independent ones.

    Attributes
    ----------
    independent
        Numbers of the independent coordinates.
    groups
        What is solved, one after the other.
    """

    independent: tuple[int, ...]
    groups: tuple[Group, ...]

    @property
    def places(self) -> dict[Expression, Expression]:
        """All dependent coordinates, and their sines and cosines, in terms of independent coordinates and branches."""
        found: dict[Expression, Expression] = {}
        for group in self.groups:
            found.update(zip(group.places, self._known(list(group.places.values()), found), strict=True))
        return found

    @staticmethod
    def _known(values: list[Expression], found: Mapping[Expression, Expression]) -> list[Expression]:
        return substitute(values, found) if found else values

    @property
    def branches(self) -> tuple[Expression, ...]:
        """Symbols of the signs, phases and turns that tell positions apart: parameters of every program."""
        every = ((*(g.signs or ()), *(s for h in g.headings for s in h.symbols), *(g.turns or ())) for g in self.groups)
        return tuple(itertools.chain.from_iterable(every))

    @property
    def margins(self) -> list[Expression]:
        """How far each group is from its dead centres."""
        return [one for group in self.groups for one in group.margins]

    @property
    def counted(self) -> list[Heading]:
        """The directions whose half turns are counted."""
        return [one for group in self.groups for one in group.headings if one.flip is not None]

    def branch_values(self, place: Place) -> dict[Expression, float] | None:
        """Return the values of the branches at an admissible position; None where formulas do not lead to it."""
        known = {**place.parameters, **place.here}
        found: dict[Expression, float] = {}
        for group in self.groups:
            for symbol, value in (group.signs or {}).items():
                found[symbol] = math.copysign(1.0, evaluate([value], known)[0])
            for heading in group.headings:
                values = heading.values(place)
                if values is None:
                    return None
                found.update(values)
            for symbol, value in (group.turns or {}).items():
                turns = evaluate([value], {**known, **found})[0] / math.tau
                if not abs(turns - round(turns)) <= 1e-3:
                    return None
                found[symbol] = math.tau * round(turns)
        return found


def spectrum(
    components: tuple[Expression, Expression], angles: Sequence[Expression], place: Place
) -> dict[tuple[int, ...], complex] | None:
    """Return the terms ``z exp(i (n . angles))`` of ``p + i q``; None if it has others than with n of -1, 0 and 1."""
    size = 4
    quarter = [0.0, 0.5 * math.pi, math.pi, 1.5 * math.pi]
    table = np.zeros((size,) * len(angles), dtype=complex)
    known = {**place.parameters, **place.here}
    for index in itertools.product(range(size), repeat=len(angles)):
        p, q = evaluate(components, {**known, **{a: quarter[k] for a, k in zip(angles, index, strict=True)}})
        table[index] = complex(p, q)
    table = np.fft.fftn(table) / table.size
    found = {}
    largest = float(np.max(np.abs(table)))
    for index in itertools.product(range(size), repeat=len(angles)):
        value = complex(table[index])
        if 2 in index:
            if abs(value) > 1e-9 * largest:
                return None
            continue
        found[tuple(n - size if n > 2 else n for n in index)] = value
    return found if largest > 0.0 else None


def is_ahead(found: Mapping[tuple[int, ...], complex], orders: tuple[int, ...]) -> bool:
    """Return whether one term is larger than all others together."""
    sizes = {n: abs(z) for n, z in found.items()}
    return sizes[orders] > _AHEAD * (sum(sizes.values()) - sizes[orders])
