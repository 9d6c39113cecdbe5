"""What the start of a scene is found with: conditions on places and on speeds, and their slopes along the speeds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from atwood.expr import Expression, Program, jacobian
from atwood.forms.program import rates_are_speeds
from atwood.forms.quantities import coordinate_program, to_maximal
from atwood.mechanics.dynamics.equations import Equations
from atwood.plotting.live.mode import ModeText
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of, reference_coordinates
from atwood.simulation.dynamics.scales import motion_scales
from atwood.simulation.initialization.start import Start, with_closed
from atwood.simulation.initialization.system import Target, sort_targets


def add_start(mode: ModeText, start: Start) -> dict[str, Any] | None:
    """Add the programs of a start to those of the mode it begins in, and return what goes with them as data.

    None where constants of integration are read from the start: such a start stays as it is.
    """
    assembly, equations = mode.assembly, with_closed(mode.assembly)
    if assembly.mechanism.constants or equations.states:
        return None
    levels = sort_targets(assembly, equations)
    held = [one for one in equations.constraints if one.value is not None]
    own = [[one.value for one in held if one.value is not None], [one.rate for one in equations.constraints]]
    data: dict[str, Any] = {
        "reference": reference_coordinates(equations).tolist(),
        "sizes": motion_scales(equations, start.length).tolist(),
        "length": start.length,
        "turns": [list(one.coordinates) for one in equations.orientation_coordinates],
        "counts": [len(equations.coordinates), len(equations.speeds)],
        "place": start.coordinates.tolist(),
    }
    for name, level, constraints, unknowns in zip(
        ("places", "speeds"), levels, own, (equations.coordinates, equations.speeds), strict=True
    ):
        targets = [(one, fixed) for fixed, ones in ((False, level.guessed), (True, level.fixed)) for one in ones]
        expressions = [*constraints, *(one.observable.value for one, _ in targets)]
        program, rows, columns = _conditions(mode, equations, expressions, name == "speeds")
        mode.programs[f"start_{name}"] = program
        places = {symbol: i for i, symbol in enumerate(unknowns)}
        data[name] = {
            "constraints": len(constraints),
            "targets": [_target(one, fixed, places) for one, fixed in targets],
            "slopes": [rows, columns],
        }
    if assembly.form == "dae":
        mode.programs["start_maximal"] = to_maximal(assembly, "regular")
    return data


def _target(one: Target, fixed: bool, places: dict[Expression, int]) -> dict[str, Any]:
    said = one.observable
    return {
        "path": one.path,
        "value": one.value,
        "unit": said.unit,
        "fixed": fixed,
        "wrapped": said.periodic,
        "settable": not one.given,
        "direct": places.get(said.value, -1),
    }


def _conditions(
    mode: ModeText, equations: Equations, expressions: Sequence[Expression], of_speeds: bool
) -> tuple[Program, list[int], list[int]]:
    """Return the program of (t, q, u) with conditions and their slopes along the speeds, and where these are."""
    found: dict[tuple[int, int], Expression] = {}
    if expressions:
        slopes = jacobian(list(expressions), list(equations.speeds if of_speeds else equations.coordinates))
        if of_speeds or rates_are_speeds(equations):
            found = {(i, j): entry for i, j, entry in slopes.triples}
        else:
            tangent = jacobian(list(equations.rates[: equations.placing]), list(equations.speeds))
            for i, k, entry in slopes.triples:
                for row, j, moved in tangent.triples:
                    if row == k:
                        found[i, j] = found.get((i, j), equations.graph.zero) + entry * moved
    groups = {"values": expressions, "slopes": [*found.values()]}
    return coordinate_program(mode.assembly, "start", equations, groups), [i for i, _ in found], [j for _, j in found]


def add_tangent(mode: ModeText) -> None:
    """Add how the coordinates at a start move along the speeds, where these are not their rates."""
    equations = mode.assembly.regular
    program = kinematic_map_of(mode.assembly, "regular").program
    if program.program is not None:
        mode.programs["tangent"] = program.program
        mode.data["tangent"] = [program.rows.tolist(), program.columns.tolist()]
    assert len(equations.speeds) == program.speeds
