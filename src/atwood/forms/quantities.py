"""Quantities of a scene as programs: by path, by expression, and the energies."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from typing import TYPE_CHECKING

from atwood.errors import ParameterError, suggestion_in_parts
from atwood.expr import Expression, InputGroup, OutputGroup, Program
from atwood.forms.kept import Key
from atwood.forms.program import state_groups
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.outputs.observables import Observable, energies

if TYPE_CHECKING:
    from atwood.forms.assembly import Assembly


_OBSERVER: Key[Program] = Key("quantities")
_ENERGIES: Key[Program] = Key("energies")


def find_observables(assembly: Assembly, paths: Sequence[str]) -> list[Observable]:
    """Return observables of a scene by path."""
    known = assembly.observables
    for path in paths:
        if path not in known:
            raise ParameterError("there is no such quantity", where=path, advice=suggestion_in_parts(path, known))
    return [known[path] for path in paths]


def observer(assembly: Assembly, paths: tuple[str, ...]) -> Program:
    """Return the program of (t, q, u, a, reactions) that gives quantities by path."""
    found = find_observables(assembly, paths)
    return known_program(assembly, _OBSERVER, lambda: [one.value for one in found], paths)


def energy_program(assembly: Assembly) -> Program:
    """Return the program of (t, q, u, a, reactions) that gives kinetic and potential energy, J."""
    return known_program(assembly, _ENERGIES, lambda: energies(assembly.mechanism, assembly.own_equations))


def known_program(
    assembly: Assembly, key: Key[Program], expressions: Callable[[], Sequence[Expression]], *about: Hashable
) -> Program:
    """Return a program of (t, q, u, a, reactions) that is made once for all assemblies of a structure."""
    return assembly.shared.get(key, lambda: state_program(assembly, key.name, expressions()), *about)


def state_program(assembly: Assembly, name: str, expressions: Sequence[Expression]) -> Program:
    """Return a program of (t, q, u, a, reactions) in the coordinates of the form of an assembly."""
    equations = assembly.own_equations
    groups = (
        *state_groups(equations),
        InputGroup("a", equations.accelerations),
        InputGroup("reactions", tuple(one.symbol for one in assembly.reactions)),
    )
    outputs = (OutputGroup(name, tuple(expressions)),)
    return Program(f"{assembly.flat.name} {name}", groups, assembly.parameters, outputs)


def coordinate_program(
    assembly: Assembly, name: str, equations: Equations, expressions: Sequence[Expression]
) -> Program:
    """Return a program of (t, q, u) in the coordinates of some equations of an assembly."""
    outputs = (OutputGroup(name, tuple(expressions)),)
    return Program(f"{assembly.flat.name} {name}", state_groups(equations), assembly.parameters, outputs)
