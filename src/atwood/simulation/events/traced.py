"""Updates of states as machine code: laws that are pure arithmetic, traced operation by operation.

A law is called once on values that note what is done with them, in the order of writing, and without any
simplification: what is compiled rounds as the law does on numbers. A law that asks what a number is, or calls
functions that are not Atwood's, is not traced, and stays Python.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from atwood.arrays import address_of
from atwood.codegen.llvm.build import RoutineSource, build_code, default_options
from atwood.codegen.llvm.module import Part
from atwood.errors import AtwoodError
from atwood.expr import Expression, Graph, InputGroup, OutputGroup, Program
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.model.declare.laws import numbers_in
from atwood.simulation.events.sampling import (
    TRACED,
    Sampler,
    Update,
    UpdateInputs,
    in_order,
    update_inputs_of,
    with_states,
)

_CODE: Key[UpdateCode | None] = Key("machine code of updates")

_MOST_CHAINS = 16
"""Updates that are due together in more ways than these stay Python."""


class _Noted(Expression):
    """A value of a law that is traced."""

    __slots__ = ()
    __hash__ = Expression.__hash__

    def _two(self, operation: str, a: object, b: object) -> Expression:
        return self.graph.node(operation, (_operand(self.graph, a), _operand(self.graph, b)))

    def __add__(self, other: object) -> Expression:
        return self._two("add", self, other)

    def __radd__(self, other: object) -> Expression:
        return self._two("add", other, self)

    def __sub__(self, other: object) -> Expression:
        return self._two("sub", self, other)

    def __rsub__(self, other: object) -> Expression:
        return self._two("sub", other, self)

    def __mul__(self, other: object) -> Expression:
        return self._two("mul", self, other)

    def __rmul__(self, other: object) -> Expression:
        return self._two("mul", other, self)

    def __truediv__(self, other: object) -> Expression:
        return self._two("div", self, other)

    def __rtruediv__(self, other: object) -> Expression:
        return self._two("div", other, self)

    def __neg__(self) -> Expression:
        return self.graph.node("neg", (self,))

    def _refuse(self, *_: object) -> Any:
        raise TypeError("a traced law does with a value what rounds otherwise, or asks what it is")

    __pow__ = __rpow__ = __floordiv__ = __rfloordiv__ = __mod__ = __rmod__ = __eq__ = __ne__ = __bool__ = _refuse
    __float__ = _refuse


class _Notes(Graph):
    """The graph of a law that is traced."""

    __slots__ = ()

    def _insert(self, *given: Any, **named: Any) -> Expression:
        made = super()._insert(*given, **named)
        made.__class__ = _Noted
        return made


def _operand(graph: Graph, value: object) -> Expression:
    if isinstance(value, (Expression, float, int, np.floating, np.integer)):
        return graph.convert(value)  # type: ignore[arg-type]
    raise TypeError(f"a traced law computes with {value!r}")


def numbers_of(symbolic: Any, known: Any) -> Iterator[float]:
    """Yield the numbers of a parameter that are no part of the structure, in order."""
    if isinstance(symbolic, Expression):
        yield float(known)
    elif isinstance(symbolic, (tuple, list)):
        for one, other in zip(symbolic, known, strict=True):
            yield from numbers_of(one, other)


class _Law:
    """One update that is traced, and what it reads of an assembly."""

    def __init__(self, one: Update, assembly: Assembly, reading: UpdateInputs) -> None:
        self.update, self._symbolic = one, assembly.mechanism.locals_[one.path].binding.values
        part, graph = assembly.flat.parts[one.path], _Notes()
        self._names = [name for name in part.values if name not in part.signals]
        parameters: list[Expression] = []

        def symbols(symbolic: Any, known: Any) -> Any:
            if isinstance(symbolic, Expression):
                parameters.append(graph.parameter(f"p{len(parameters)}"))
                return parameters[-1]
            if isinstance(symbolic, (tuple, list)):
                return tuple(symbols(a, b) for a, b in zip(symbolic, known, strict=True))
            return known

        known = {name: symbols(self._symbolic.get(name), part.values[name]) for name in self._names}
        t, inputs = graph.symbol("t"), []
        for number, (path, name) in enumerate(reading.inputs):
            inputs.append(graph.symbol(f"input {number}"))
            if path == one.path:
                known[name] = inputs[-1]
        held = {i: graph.symbol(f"held {i}") for i in range(len(assembly.discrete_states))}
        q = {i: graph.symbol(f"q {i}") for i in range(len(assembly.own_equations.coordinates))}

        def state(path: str) -> Expression:
            return held[reading.held[path]] if path in reading.held else q[reading.states[path]]

        bound = with_states(assembly, one.path, t, known, state)
        found = [_operand(graph, value) for value in numbers_in(getattr(bound, one.law.name)())]
        if len(found) != len(one.sets):
            raise TypeError("an update returns another number of values than it sets")
        plain = Graph()  # whose nodes can be compared
        plain.replay(graph.recorded(len(plain)))
        groups = ("t", (t,)), ("inputs", tuple(inputs)), ("held", tuple(held.values())), ("q", tuple(q.values()))
        again = [InputGroup(name, tuple(plain.nodes[x.index] for x in given)) for name, given in groups]
        values, own = ([plain.nodes[x.index] for x in some] for some in (found, parameters))
        self.program = Program(one.label, tuple(again), tuple(own), (OutputGroup("sets", tuple(values)),))
        self.places = [(reading.held.get(path, -1), reading.states.get(path, -1)) for path in one.sets]

    def values(self, assembly: Assembly) -> list[float]:
        """Return the values of its parameters."""
        known = assembly.flat.parts[self.update.path].values
        return [x for name in self._names for x in numbers_of(self._symbolic.get(name), known[name])]


class UpdateCode:
    """The updates of a scene as one function, by the numbers of those that are due together.

    Parameters
    ----------
    laws, chains
        The updates that are traced, and for each way to be due together which of them are called, in order.
    reading
        What they read.
    sizes
        How many coordinates, speeds, discrete states and parameters before these there are.
    """

    def __init__(
        self, laws: Sequence[_Law], chains: Sequence[Sequence[int]], reading: UpdateInputs, sizes: Sequence[int]
    ) -> None:
        self.laws, self.reading, self.sizes = laws, reading, tuple(sizes)
        parts = [Part("inputs", reading.program), *(Part(f"update_{k}", one.program) for k, one in enumerate(laws))]
        places = tuple(tuple(one.places) for one in laws)
        source = RoutineSource(
            "simulation.events.update_routine", (), (places, tuple(map(tuple, chains)), self.sizes, len(reading.inputs))
        )
        self.built = build_code(parts, default_options(parts, is_brief=True), exports=["update"], routines=source)
        self.address = self.built.code.addresses["update"]

    def bind(self, assembly: Assembly) -> tuple[int, object]:
        """Return the address of the data of the function, and what keeps it."""
        *_, count, first = self.sizes
        values = assembly.parameter_values
        rest = np.concatenate([values[:first], values[first + count :]])
        given = [(self.reading.program, rest), *((one.program, np.array(one.values(assembly))) for one in self.laws)]
        names = ["inputs", *(f"update_{k}" for k in range(len(self.laws)))]
        derived = [
            self.built.derive(name, program, numbers)[0] for name, (program, numbers) in zip(names, given, strict=True)
        ]
        room = np.zeros(len(rest) + len(self.reading.inputs) + max(len(one.places) for one in self.laws))
        scratch = np.zeros(max(1, self.built.scratch))
        kept = [room, scratch, *derived]
        data = np.array([address_of(one) for one in kept], dtype=np.uint64)
        return address_of(data), (data, kept, self.built)


def update_code(assembly: Assembly, sampler: Sampler) -> tuple[UpdateCode, dict[tuple[int, ...], int]] | None:
    """Return the updates that are due at times as machine code, with the numbers of their chains; None if one is not.

    Only updates that are pure are traced.
    """
    chains = {due: number for number, due in enumerate(dict.fromkeys(sampler.due), start=1)}
    if not chains or len(chains) > _MOST_CHAINS:
        return None

    def make() -> UpdateCode | None:
        reading, called = update_inputs_of(assembly), sorted({i for due in chains for i in due})
        updates = [sampler.updates[i] for i in called]
        if reading.program.calls_python or not all(one.law.options.pure for one in updates):
            return None
        try:
            laws = [_Law(one, assembly, reading) for one in updates]
        except (AtwoodError, TypeError, ValueError, ArithmeticError, AttributeError, IndexError, KeyError):
            return None  # it says what is wrong where it is called on numbers
        orders = [in_order([sampler.updates[i] for i in due], reading) for due in chains]
        numbers = [[updates.index(one) for one in order] for order in orders]
        equations, first = assembly.own_equations, len(assembly.mechanism.table.values)
        sizes = len(equations.coordinates), len(equations.speeds), len(assembly.discrete_states), first
        assembly.shared.get(TRACED, set).update(one.label for one in updates)
        return UpdateCode(laws, numbers, reading, sizes)

    made = assembly.shared.get(_CODE, make, tuple(chains))
    return None if made is None else (made, chains)
