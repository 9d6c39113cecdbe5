"""What updates of states read, as one program."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen import BoundKernel
from atwood.errors import DeclarationError
from atwood.expr import Expression, InputGroup, OutputGroup, Program, depends_on
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.program import state_groups
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.build import resolve_signals

_BOUND_KERNELS: Key[dict[bytes, BoundKernel]] = Key("what updates read, with parameters")


_MOST_KERNELS = 64
"""So many programs with other parameters are kept ready."""


@dataclass(frozen=True, eq=False)
class UpdateInputs:
    """What updates read, as one program.

    Attributes
    ----------
    program
        Of (t, q, u, held), with the inputs of all parts that have updates.
    inputs
        Part and name of each of its results.
    feeds
        For each of these, the paths of the states that it depends on.
    held, states
        Numbers of discrete states among the assembly's, and of continuous ones among the coordinates, by path.
    """

    program: Program
    inputs: tuple[tuple[str, str], ...]
    feeds: Mapping[tuple[str, str], frozenset[str]]
    held: Mapping[str, int]
    states: Mapping[str, int]

    def values(
        self, assembly: Assembly, t: float, q: FloatArray, u: FloatArray, held: Sequence[float]
    ) -> dict[str, dict[str, Any]]:
        """Return what the laws of parts read: inputs by part and name, and states by path under an empty name."""
        (results,) = self._kernel(assembly)([t], q, u, held)
        found: dict[str, dict[str, Any]] = {"": {path: float(q[i]) for path, i in self.states.items()}}
        found[""] |= {path: held[i] for path, i in self.held.items()}
        for (part, name), value in zip(self.inputs, results, strict=True):
            found.setdefault(part, {})[name] = float(value)
        return found

    def _kernel(self, assembly: Assembly) -> BoundKernel:
        """Return the program with the values of all parameters but the discrete states, which are arguments here."""
        first = len(assembly.mechanism.table.values)
        values = assembly.parameter_values
        others = np.concatenate([values[:first], values[first + len(assembly.discrete_states) :]])
        known, about = assembly.shared.get(_BOUND_KERNELS, dict), others.tobytes()
        if about not in known:
            if len(known) >= _MOST_KERNELS:
                known.clear()
            known[about] = assembly.compiled(self.program).bind(others)
        return known[about]


_UPDATE_INPUTS: Key[UpdateInputs] = Key("what updates read")


def update_inputs_of(assembly: Assembly) -> UpdateInputs:
    """Return what the updates of a scene read."""
    return assembly.shared.get(_UPDATE_INPUTS, lambda: _read_inputs(assembly))


def _read_inputs(assembly: Assembly) -> UpdateInputs:
    mechanism, equations, graph = assembly.mechanism, assembly.own_equations, assembly.own_equations.graph
    signals = resolve_signals(mechanism, equations.site, equations.kinematics, equations.read)
    places, expressions = [], []
    for path, local in mechanism.locals_.items():
        for name in local.part.signals if local.part.component.laws("update") else ():
            symbol = local.signal_symbols.get(name)
            places.append((path, name))
            expressions.append(graph.convert(local.binding.values[name] if symbol is None else signals[symbol]))
    late = [*equations.accelerations, *equations.multipliers, *(one.symbol for one in assembly.reactions)]
    for (path, name), value in zip(places, expressions, strict=True):
        if depends_on(value, late):
            raise DeclarationError(
                "it is sampled, and reads accelerations or reactions that no force reads",
                where=f"{path}.{name}",
                advice="Sample positions, velocities and states.",
            )
    symbols: dict[Expression, str] = {one.symbol: one.path for one in assembly.discrete_states}
    symbols |= {one.symbol: one.path for one in equations.states}
    feeds = {
        place: frozenset(path for symbol, path in symbols.items() if depends_on(value, [symbol]))
        for place, value in zip(places, expressions, strict=True)
    }
    held = tuple(one.symbol for one in assembly.discrete_states)
    rest = tuple(one for one in assembly.parameters if one not in set(held))
    groups = (*state_groups(equations), InputGroup("held", held))
    program = Program(
        f"{assembly.flat.name} sampled inputs", groups, rest, (OutputGroup("inputs", tuple(expressions)),)
    )
    return UpdateInputs(
        program,
        tuple(places),
        feeds,
        {one.path: i for i, one in enumerate(assembly.discrete_states)},
        {one.path: i for i, one in enumerate(equations.states, start=equations.placing)},
    )
