"""Which position of closed loops formulas lead to: signs of roots, and directions from which angles are counted."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import field

from atwood.expr import Expression, absolute, floor, sign, substitute
from atwood.lazy_dataclasses import dataclass, replace

_WHOLE = 1e-3
"""An angle that is not so near to the formula's but for whole turns is not on its branch."""


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
    flip, offset
        Symbols of the side, 1 or -1, and of the half turns since the start; None where none are counted.
    ahead, beside
        Then the components along the phase and across it.
    values
        What its symbols are at a position, in terms of parameters, time and coordinates.
    lead
        By how much one wave is larger than all others together: positive where the direction cannot turn away. None
        where that is counted.
    most
        The longest that the direction can be; None where that is not known.
    """

    phase: Expression
    flip: Expression | None = None
    offset: Expression | None = None
    ahead: Expression | None = None
    beside: Expression | None = None
    values: Mapping[Expression, Expression] = field(default_factory=dict)
    lead: Expression | None = None
    most: Expression | None = None

    @property
    def symbols(self) -> tuple[Expression, ...]:
        """Its symbols."""
        return tuple(one for one in (self.phase, self.flip, self.offset) if one is not None)

    def with_places(self, moved: Callable[[Expression], Expression]) -> Heading:
        """Return the same with other expressions for what depends on coordinates."""
        ahead, beside = (None if one is None else moved(one) for one in (self.ahead, self.beside))
        return replace(
            self, ahead=ahead, beside=beside, values={symbol: moved(one) for symbol, one in self.values.items()}
        )


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
    speeds
        Numbers of the independent speeds.
    own_speeds
        The number of the speed that is the rate of a coordinate, for all that have such.
    groups
        What is solved, one after the other.
    """

    independent: tuple[int, ...]
    speeds: tuple[int, ...]
    own_speeds: Mapping[int, int]
    groups: tuple[Group, ...]

    @property
    def rates_are_speeds(self) -> bool:
        """Whether the rate of every independent coordinate is the speed of the same number."""
        return tuple(self.own_speeds.get(i) for i in self.independent) == self.speeds

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

    def values(self) -> tuple[list[Expression], list[Expression]]:
        """Return the values of the branches at an admissible position, and what must be positive there.

        All in terms of parameters, time and coordinates. Where something is not positive, formulas do not lead there.
        """
        found: dict[Expression, Expression] = {}
        conditions: list[Expression] = []
        for group in self.groups:
            found.update((symbol, sign(value)) for symbol, value in (group.signs or {}).items())
            for heading in group.headings:
                found.update(heading.values)
                conditions += () if heading.lead is None else (heading.lead,)
        for group in self.groups:
            for symbol, value in (group.turns or {}).items():
                turns = substitute([value], found)[0] / math.tau
                whole = floor(turns + 0.5)
                conditions.append(_WHOLE - absolute(turns - whole))
                found[symbol] = math.tau * whole
        return [found[symbol] for symbol in self.branches], conditions
