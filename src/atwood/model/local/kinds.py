"""Parts of one kind: laws are evaluated for two of them, and written down for the others on symbols of their own.

Parts are of one kind if they have the same class, the same values where these shape laws (choices, counts, exact
zeros), keep nothing else, and have laws that do not ask for their path. What laws make of the symbols of one they make
of those of another: the same nodes in the same order. That this is so is seen at two of them, and not taken for
granted; what differs is evaluated for each. Laws depend on nothing else, such as how often they were called.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Hashable, Mapping
from typing import TYPE_CHECKING

from atwood.model.declare.law_results import Carried
from atwood.model.local.bound import ParameterTable, read_parameter
from atwood.model.local.flatten import FlatScene, Part
from atwood.model.local.parts import LocalPart

if TYPE_CHECKING:
    from atwood.model.local.record import Record

OWN = frozenset({"_parent", "_name", "_settings", "_token", "_declared"})
"""What components keep of themselves. One that keeps more may have laws that depend on it."""

_FEWEST, _ATTEMPTS = 8, 3
"""Of fewer parts of a kind each is read by itself; of so many, two in a row must have been alike."""


class Kinds:
    """The kinds of the parts of a scene, and what was seen of each.

    Parameters
    ----------
    flat, modes, carried
        The scene, and how its parts are read; see `atwood.model.local.laws.localize`.
    table
        The parameters and the graph.
    apart
        Paths of parts that take hold of others, or that others take hold of.
    """

    def __init__(
        self,
        flat: FlatScene,
        modes: Mapping[str, str],
        table: ParameterTable,
        carried: Mapping[tuple[str, str], Carried] | None,
        apart: Collection[str],
    ) -> None:
        self._table = table
        self._seen: dict[Hashable, list[Record | None]] = {}
        self._writers: dict[Hashable, Callable[[Part], LocalPart]] = {}
        self._of: dict[str, Hashable] = {}
        if len(flat.parts) < _FEWEST or flat.space.is_line or carried or flat.contact_states:
            return
        alone = {path for path, _ in (*flat.links, *flat.links.values(), *flat.varied)}.union(apart)
        found = {path: _kind(part, modes.get(path, "")) for path, part in flat.parts.items() if path not in alone}
        many = Counter(found.values())
        self._of = {path: kind for path, kind in found.items() if kind is not None and many[kind] >= _FEWEST}

    def read(self, part: Part, read_laws: Callable[[Part], LocalPart]) -> LocalPart:
        """Return what a part contributes: as others of its kind, or as its laws tell."""
        kind, graph = self._of.get(part.path), self._table.graph
        seen = self._seen.setdefault(kind, [])
        if kind is None or (len(seen) == _ATTEMPTS and kind not in self._writers):
            return read_laws(part)
        if kind in self._writers:
            for spec in part.component.parameter_specs().values():
                read_parameter(part, spec, self._table)
            for name, given in part.signals.items():
                self._table.scalar(f"{part.path}.{name}", given)
            return self._writers[kind](part)
        from atwood.model.local.record import take_down  # small scenes have no kinds of so many parts

        start = len(graph)
        local = read_laws(part)
        record = None if local.binding.asked else take_down(local, graph, start)
        if record is not None and seen and seen[-1] == record:
            self._writers[kind] = record.writer(graph, local.unread)
        seen.append(record)
        return local


def _kind(part: Part, mode: str) -> Hashable:
    """Return what decides what the laws of a part make of its symbols; None for what is read by itself."""
    component = part.component
    if vars(component).keys() - OWN:
        return None
    told: list[Hashable] = [type(component), mode]
    for name, spec in component.parameter_specs().items():
        value = part.values[name]
        if callable(value):
            return None
        if value is None or spec.integer or spec.choices or spec.text or spec.function_of or spec.array:
            told.append((type(value), value))
        else:
            several = (value,) if spec.size is None else tuple(value)
            told.append(tuple([float(one) if spec.structural or one == 0.0 else None for one in several]))
    for value in part.signals.values():
        if callable(value):
            return None
        told.append(value == 0.0)
    try:
        hash(kind := tuple(told))
    except TypeError:
        return None
    return kind
