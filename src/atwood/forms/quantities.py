"""Quantities of a scene as programs of the state: by path, energies, and maximal coordinates."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import TYPE_CHECKING, Literal

from atwood.errors import ParameterError, check_known, suggestion_in_parts
from atwood.expr import Expression, InputGroup, OutputGroup, Program, substitute
from atwood.forms.caches import Key
from atwood.forms.program import state_groups
from atwood.mechanics.constraints.read_multipliers import with_known
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.outputs.observables import Observable
from atwood.mechanics.outputs.reactions import InternalReactions, internal_reaction_program
from atwood.mechanics.outputs.totals import energies

if TYPE_CHECKING:
    from atwood.forms.assembly import Assembly

_OBSERVER: Key[Program] = Key("quantities")
_ENERGIES: Key[Program] = Key("energies")


def find_observables(assembly: Assembly, paths: Sequence[str]) -> list[Observable]:
    """Return observables of a scene by path."""
    known = assembly.observables
    for path in paths:
        check_known(path, known, "there is no such quantity", hint=suggestion_in_parts, error=ParameterError)
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
    assembly: Assembly,
    name: str,
    equations: Equations,
    expressions: Sequence[Expression] | Mapping[str, Sequence[Expression]],
    **more: Sequence[Expression],
) -> Program:
    """Return a program of (t, q, u), and more symbols by name, in the coordinates of some equations of an assembly.

    It gives expressions, or groups of these by name.
    """
    groups = expressions if isinstance(expressions, Mapping) else {name: expressions}
    outputs = tuple(OutputGroup(one, tuple(some)) for one, some in groups.items())
    inputs = (*state_groups(equations), *(InputGroup(one, tuple(some)) for one, some in more.items()))
    return Program(f"{assembly.flat.name} {name}", inputs, assembly.parameters, outputs)


_INTERNAL: Key[InternalReactions | None] = Key("reactions inside bodies")
TO_MAXIMAL: Key[Program] = Key("maximal coordinates in terms of generalized ones")


def to_maximal(assembly: Assembly, given: Literal["reduced", "regular"] = "reduced") -> Program:
    """Return the program of (t, q, u) in generalized coordinates that gives maximal coordinates and speeds."""
    equations = assembly.in_coordinates(given)
    is_reduced = equations is assembly.reduced
    return assembly.shared.get(TO_MAXIMAL, lambda: _make(assembly, equations, assembly.maximal), is_reduced)


def internal_reactions_of(assembly: Assembly) -> InternalReactions | None:
    """Return the program of all reactions inside bodies, in maximal coordinates; None if no component reports one."""
    parts = assembly.mechanism, assembly.maximal, assembly.reactions, assembly.parameters
    return assembly.shared.get(_INTERNAL, lambda: internal_reaction_program(*parts))


def places(reduced: Equations, maximal: Equations) -> tuple[list[Expression], list[Expression]]:
    """Return maximal coordinates and speeds in terms of generalized ones."""
    forest = maximal.forest
    positions: list[Expression] = [reduced.graph.constant(0.0)] * len(forest.coordinates)
    speeds: list[Expression] = [reduced.graph.constant(0.0)] * len(forest.speeds)
    kinematics = reduced.kinematics
    for one in forest.attachments:
        for k, (coordinate, speed) in enumerate(zip(one.coordinates, one.speeds, strict=True)):
            positions[coordinate] = kinematics.placements.references[one.body][k]
            speeds[speed] = kinematics.reference_velocities[one.body][k]
        for k, number in enumerate(one.orientation):
            positions[number] = kinematics.placements.quaternions[one.body][k]
        for k, number in enumerate(one.spin):
            speeds[number] = kinematics.angular_velocities[one.body][k]
    for turn in forest.orientations:
        if turn.coordinate is not None:
            positions[turn.coordinate] = kinematics.placements.angles[turn.body]
            speeds[turn.coordinate] = kinematics.angular_velocities[turn.body][0]
    for symbol, (coordinate, speed) in forest.counted.items():
        positions[coordinate] = kinematics.placements.joint_coordinates[symbol]
        speeds[speed] = kinematics.joint_rates[symbol]
    return [*positions, *maximal.coordinates[maximal.placing :]], speeds


def with_reactions(reduced: Equations, maximal: Equations) -> Equations:
    """Return equations in generalized coordinates with the reactions that forces read as functions of the state."""
    positions, speeds = places(reduced, maximal)
    where = dict(zip((*maximal.coordinates, *maximal.speeds), (*positions, *speeds), strict=True))
    return with_known(reduced, dict(zip(maximal.read, substitute(list(maximal.read.values()), where), strict=True)))


def _make(assembly: Assembly, reduced: Equations, maximal: Equations) -> Program:
    positions, speeds = places(reduced, maximal)
    return coordinate_program(assembly, "to maximal coordinates", reduced, {"q": positions, "u": speeds})
