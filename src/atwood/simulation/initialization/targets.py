"""What is said of a start: which quantities are to have which values, sorted by what they are of."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial

from atwood.arrays import FloatArray
from atwood.errors import StartError
from atwood.expr import Expression, depends_on, jvp, live
from atwood.forms.assembly import Assembly
from atwood.forms.kept import Key
from atwood.forms.source import no_start_quantity
from atwood.late import dataclass
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.outputs.observables import Observable
from atwood.model.values.units import parse_unit
from atwood.tolerances import tolerances

__all__ = ["Level", "Target", "as_said", "find_level", "named_once", "said", "sort_targets"]


@dataclass(frozen=True)
class Target:
    """A quantity with the value that it is to have at the start.

    Attributes
    ----------
    path, value, observable
        The quantity, its value, and what computes it.
    given
        What was said instead, where a part says it in another way: paths and values of its Euler angles, for one.
    """

    path: str
    value: float
    observable: Observable
    given: tuple[tuple[str, float], ...] = ()

    @property
    def where(self) -> str:
        """The path under which it was said."""
        return self.given[0][0] if self.given else self.path


def as_said(targets: Iterable[Target]) -> list[str]:
    """Return targets in the words in which they were given, each of these once."""
    words = (pair for one in targets for pair in (one.given or ((one.path, one.value),)))
    return [f"{path} = {value:g}" for path, value in dict(words).items()]


@dataclass(frozen=True)
class Level:
    """Targets of one level, position or velocity, split into what is fixed and what is guessed."""

    fixed: list[Target]
    guessed: list[Target]


def sort_targets(assembly: Assembly, equations: Equations) -> tuple[Level, Level]:
    """Return what is said of positions and of speeds at the start."""
    levels = (Level([], []), Level([], []))
    for is_fixed, given in ((True, assembly.flat.start), (False, assembly.flat.guess)):
        restated, origins = _restated(assembly, given)
        for path, value in restated.items():
            number = assembly.shared.get(_LEVEL, partial(find_level, assembly, equations, path), path)
            level = levels[number]
            target = Target(path, value, assembly.start_observables[path], origins.get(path, ()))
            (level.fixed if is_fixed else level.guessed).append(target)
    return levels


Origins = dict[str, tuple[tuple[str, float], ...]]
"""For the path of a value that was said in another way, what was said."""


def _restated(assembly: Assembly, given: Mapping[str, float]) -> tuple[dict[str, float], Origins]:
    """Return start values with those that a part says in another way said so; see `Component.restate_start`."""
    found = dict(given)
    origins: Origins = {}
    said: dict[str, dict[str, float]] = {}
    for key, value in given.items():
        path, _, name = key.rpartition(".")
        if path in assembly.flat.parts:
            said.setdefault(path, {})[name] = value
    for path, own in said.items():
        part = assembly.flat.parts[path]
        restated = part.component.restate_start(own, assembly.mechanism.space.name)
        if restated != own:
            for name, value in restated.items():
                said_too = given.get(f"{path}.{name}", value)
                if not abs(said_too - value) <= tolerances.CLOSED:
                    others = ", ".join(f"{one} = {own[one]:g}" for one in own if one not in restated)
                    raise StartError(
                        f"it is given as {said_too:g}, and {others} makes it {value:g}",
                        where=f"{path}.{name}",
                        advice="The start values contradict each other: give one or the other.",
                    )
            for name in own:
                del found[f"{path}.{name}"]
            found.update({f"{path}.{name}": value for name, value in restated.items()})
            instead = tuple((f"{path}.{name}", value) for name, value in own.items() if name not in restated)
            origins.update({f"{path}.{name}": instead for name in restated if name not in own})
    return found, origins


_LEVEL: Key[int] = Key("level of a start value")
_LATER_SYMBOLS: Key[tuple[frozenset[Expression], frozenset[Expression]]] = Key("what starts do not give, and speeds")


def find_level(assembly: Assembly, equations: Equations, path: str) -> int:
    """Return whether a start value is of positions (0) or of speeds (1)."""
    observables = assembly.start_observables
    if path not in observables:
        raise no_start_quantity(path, observables)
    one = observables[path]
    reads = {node for node in live([one.value]) if node.is_symbol}
    late, speeds = assembly.shared.get(_LATER_SYMBOLS, lambda: _later_symbols(assembly, equations))
    if not late.isdisjoint(reads):
        raise StartError(
            "the quantity follows from positions and speeds and cannot be prescribed at the start",
            where=path,
            advice="Give coordinates, positions and velocities.",
        )
    own = [symbol for symbol in reads if symbol in speeds]
    if not own:  # what does not move with anything is a rate if its unit is one
        still = reads.isdisjoint(equations.coordinates)
        return int(still and parse_unit(one.unit).exponents[2] == -1)
    if not _is_linear(one.value, own):
        raise StartError(
            "the quantity is not linear in the speeds and cannot be prescribed at the start",
            where=path,
            advice="Give velocities.",
        )
    return 1


def _later_symbols(assembly: Assembly, equations: Equations) -> tuple[frozenset[Expression], frozenset[Expression]]:
    """Return what is known only after positions and speeds, and the speeds."""
    late = frozenset([*equations.accelerations, *(one.symbol for one in assembly.reactions)])
    return late, frozenset(equations.speeds)


def _is_linear(value: Expression, speeds: Sequence[Expression]) -> bool:
    """Return whether an expression is linear in the speeds: its derivative along them does not depend on them."""
    directions: dict[Expression, Expression | float] = {}
    for u in sorted(speeds, key=lambda u: u.index):  # new nodes come in the same order in every process
        directions[u] = u.graph.symbol(f"direction:{u.name}")
    return value.is_symbol or not depends_on(jvp([value], directions)[0], speeds)


def said(unknowns: Sequence[Expression], targets: Sequence[Target], otherwise: FloatArray) -> tuple[FloatArray, bool]:
    """Return what is said of unknowns themselves, which needs no iteration, and whether that is all that is said."""
    values, is_direct = otherwise.copy(), True
    places = {symbol: i for i, symbol in enumerate(unknowns)} if targets else {}
    for target in targets:
        if target.observable.value in places:
            values[places[target.observable.value]] = target.value
        else:
            is_direct = False
    return values, is_direct


def named_once(unknowns: Sequence[Expression], fixed: Sequence[Target]) -> set[int] | None:
    """Return which unknowns fixed values are of; None if one of these is of something else, or two are of one."""
    places = {symbol: i for i, symbol in enumerate(unknowns)} if fixed else {}
    found = {places[one.observable.value] for one in fixed if one.observable.value in places}
    return found if len(found) == len(fixed) else None
