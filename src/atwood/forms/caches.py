"""Caches: of what is made from one assembly, from all assemblies of one structure, and of derivations on disk.

A derivation, as of equations rewritten as by hand or solved for accelerations, reads expressions and adds nodes to
their graph. What it adds depends on the whole graph, since products meet products that are there already; on what it
reads; and on its code. All of that is the name of its entry on disk, so a change of any of it is another entry. What
is kept there are the nodes themselves in their order, so that the graph is afterwards just as if they had been derived.
"""

from __future__ import annotations

import gc
import marshal
import pickle
import platform
import sys
import threading
from collections.abc import Callable, Hashable, Sequence
from functools import cache
from hashlib import sha256
from io import BytesIO
from itertools import count
from pathlib import Path
from typing import Any, Generic, TypeVar

from atwood.codegen.cache import default_cache, make_key
from atwood.errors import UnsupportedError
from atwood.expr import Expression, Graph
from atwood.expr.core.graph import MANY
from atwood.expr.core.operations import BINARY, UNARY
from atwood.expr.simplify.collect import collect
from atwood.mechanics.dynamics.equations import Equations
from atwood.stages import stage

T = TypeVar("T")

_MUCH = 20_000
"""From so many new objects on the collector takes a millisecond to look through them."""

_AGED = count(1)
"""How often what was made counted as old at once."""


_REMEMBERED = 64
"""Of so many values it is known what was made of them: a run begins anew at its start, and comes to the same events."""


class without_collection:
    """Leave cycles of objects alone: graphs of expressions have none, and to look for them is a sixth of deriving.

    What was made meanwhile counts as old afterwards, if it is much. Else the next object that is made would begin to
    look through it. That takes the counts of the collector back to zero: every tenth time all is looked through, or
    cycles of who runs one scene after another would never be.
    """

    __slots__ = ("_was_enabled",)

    def __enter__(self) -> None:
        self._was_enabled = gc.isenabled()
        gc.disable()

    def __exit__(self, *_: object) -> None:
        if self._was_enabled:
            is_much = gc.get_count()[0] > _MUCH and not gc.get_freeze_count()  # what somebody has frozen stays so
            if is_much:
                gc.freeze()
                gc.unfreeze()
            gc.enable()
            if is_much and next(_AGED) % 10 == 0:
                gc.collect()


class Key(Generic[T]):
    """Under which something of one type is kept; no two keys are equal.

    Parameters
    ----------
    name
        What it is, in words.
    """

    def __init__(self, name: str) -> None:
        self.name = name

    def __repr__(self) -> str:
        return f"<{self.name}>"


class Kept:
    """What was made from one value. It is not part of the value, and is made again for a copy."""

    def __init__(self) -> None:
        self._made: dict[Hashable, Any] = {}

    def get(self, key: Key[T], make: Callable[[], T], *about: Hashable) -> T:
        """Return what was made under a key, making it if it is not there."""
        known = self._made.get(key)
        if known is not None and known[0] == about:
            found: T = known[1]
            return found
        made = make()
        self._made[key] = about, made
        return made

    def recall(self, key: Key[dict[tuple[Hashable, ...], T]], make: Callable[[], T], *about: Hashable) -> T:
        """Return what was made of some values, making it if that is not known any more; so much is of the last ones."""
        known = self.get(key, dict)
        try:
            return known[about]
        except KeyError:  # or another thread has just dropped it
            made = make()
        for oldest in [*known][: max(0, len(known) - _REMEMBERED + 1)]:
            known.pop(oldest, None)
        known[about] = made
        return made

    def take(self, key: Key[T]) -> T | None:
        """Return what was last made under a key, which then is the caller's alone; None if nothing was."""
        found: T | None = self._made.pop(key, (None, None))[1]
        return found

    def known(self, key: Key[T]) -> T | None:
        """Return what was last made under a key; None if nothing was."""
        found: T | None = self._made.get(key, (None, None))[1]
        return found


class Shared:
    """What is made once for all assemblies of one structure, when it is first asked for; any thread may ask.

    Parameters
    ----------
    family
        What the other modes of the scene share with it; its own if not given.

    Attributes
    ----------
    lock
        Held while something is made: the expressions of one structure live in one graph.
    """

    def __init__(self, family: Shared | None = None) -> None:
        self.family = family or self
        self._made: dict[Hashable, Any] = {}
        self.lock = threading.RLock()

    def __repr__(self) -> str:
        return f"<Shared: {len(self._made)} of equations, programs and the like>"

    def __reduce__(self) -> tuple[Any, ...]:
        return Shared, ()  # what was made belongs to the process; who shared it does so again

    def get(self, key: Key[T], make: Callable[[], T], *about: Hashable) -> T:
        """Return what was made under a key, making it if it is not there."""
        place = (key, *about) if about else key
        try:
            found: T = self._made[place]
        except KeyError:
            with self.lock, stage("equations"), without_collection():
                if place not in self._made:
                    self._made[place] = make()
                found = self._made[place]
        return found

    def known(self, key: Key[T]) -> T | None:
        """Return what was made under a key; None if nothing was."""
        found: T | None = self._made.get(key)
        return found


_FORMAT = 1
"""Counts changes to what an entry holds."""

SOURCES = ("expr", "forms", "mechanics", "numerics")
"""The rooms whose code derives; what other rooms give is read as expressions."""

_PLAIN = 2
"""The format of `marshal` that writes equal values equally, whoever else refers to them."""


def derive_once(
    what: str, graph: Graph, read: object, derive: Callable[[], tuple[str, Sequence[Expression]]]
) -> tuple[str, list[Expression]]:
    """Return what a derivation gives, from the cache if the same was derived before."""
    store = default_cache()
    key = None if store is None else derivation_key(what, graph, read)
    if store is None or key is None:
        start = len(graph)
        word, values = derive()
        graph.forget(start)
        return word, list(values)
    found = store.read(key)
    known = None if found is None else _replayed(graph, found)
    if known is not None:
        return known
    before, relations = len(graph), _relations(graph)
    word, values = derive()
    content = _written((word, graph.recorded(before), [value.index for value in values]))
    if content is not None and relations == _relations(graph) and len(graph) <= MANY:
        store.write(key, content)
    return word, list(values)


def _replayed(graph: Graph, content: bytes) -> tuple[str, list[Expression]] | None:
    """Return what an entry says, whose nodes are then in the graph; None if it says nothing that could be derived."""
    try:
        word, added, places = marshal.loads(content)
        if not all(0 <= place < len(graph) + len(added) for place in places):
            return None
        for number, (operation, arguments, _, _) in enumerate(added, start=len(graph)):
            wanted = 1 if operation in UNARY else 2 if operation in BINARY else len(arguments)
            if len(arguments) != wanted or not all(0 <= place < number for place in arguments):
                return None
        graph.replay(added)
        return str(word), [graph.nodes[place] for place in places]
    except (ValueError, TypeError, EOFError, IndexError, AttributeError):
        return None


def derivation_key(what: str, graph: Graph, read: object) -> str | None:
    """Return the name of an entry; None where functions of Python are in the graph, whose code no name tells."""
    if len(graph) > MANY:  # their entries would fill the cache
        return None
    nodes, described = _written(graph.plain()), _described(read)
    if nodes is None or described is None:
        return None
    versions = (sys.version, sys.platform, platform.machine())
    return make_key([_FORMAT, what, versions, hash_of_sources(), sha256(nodes).digest(), described])


@cache
def hash_of_sources(root: Path = Path(__file__).parents[1]) -> str:
    """Return a hash of all code that derives."""
    total = sha256()
    for room in SOURCES:
        files = sorted((root / room).rglob("*.py"))
        if not files:
            raise UnsupportedError(
                "the sources cannot be read",
                where=f"atwood.{room}",
                advice="Install atwood with its sources, or switch the cache off: ATWOOD_CACHE=0.",
            )
        for file in files:
            total.update(b"%s %d\n" % (file.name.encode(), file.stat().st_size) + file.read_bytes())
    return total.hexdigest()


class _Pickler(pickle.Pickler):
    """Writes expressions as their places in the graph, and sets in an order that is always the same."""

    def persistent_id(self, value: Any) -> Any:
        if isinstance(value, Expression):
            return value.index
        if isinstance(value, (set, frozenset)):
            return sorted(marshal.dumps(one, _PLAIN) for one in value)
        return "graph" if isinstance(value, Graph) else None


def _described(read: object) -> bytes | None:
    made = BytesIO()
    pickler = _Pickler(made, protocol=5)
    pickler.fast = True  # equal values are written equally, whether or not they are one object
    try:
        pickler.dump(read)
    except (pickle.PicklingError, TypeError, ValueError, AttributeError):
        return None
    return sha256(made.getvalue()).digest()


def _written(data: Any) -> bytes | None:
    try:
        return marshal.dumps(data, _PLAIN)
    except ValueError:
        return None


def _relations(graph: Graph) -> int:
    return 0 if graph.relations is None else len(graph.relations.found)


_MOST_COORDINATES = 12
"""Up to so many coordinates equations are rewritten; beyond, the recursion is shorter than any closed form."""


def as_by_hand(equations: Equations, parameters: Sequence[Expression], rows: Sequence[Expression]) -> list[Expression]:
    """Return rows rewritten with fewer operations, for scenes of the size that one would do by hand.

    Rows with forces of gaps and slips stay as they are: they are solved for in the graph, which is no work by hand.
    """
    if len(equations.coordinates) > _MOST_COORDINATES or equations.solved_speeds or equations.contacts:
        return list(rows)
    angles = [q for q, c in zip(equations.coordinates, equations.names, strict=True) if c.unit == "rad"]
    read = tuple(rows), tuple(angles), parameters
    _, found = derive_once("rows", equations.graph, read, lambda: ("", collect(list(rows), angles, parameters)))
    return found
