"""On a line: on which side of each other the connectors of a part really are, at a state that has been found."""

from __future__ import annotations

from atwood.arrays import FloatArray
from atwood.expr import Program
from atwood.forms.assembly import Assembly
from atwood.forms.kept import Key
from atwood.forms.quantities import coordinate_program

_POSITIONS: Key[Program] = Key("positions of nodes on the line")

LineSigns = dict[tuple[str, str, str], float]


def actual_line_signs(assembly: Assembly, t: float, q: FloatArray, u: FloatArray, form: str) -> LineSigns:
    """Return, for pairs of connectors of each part, the sign of the second's position minus the first's."""
    if not assembly.mechanism.space.is_line:
        return {}
    equations = assembly.reduced if form == "reduced" else assembly.maximal
    positions = equations.kinematics.placements.positions
    nodes = list(positions)
    program = assembly.shared.get(
        _POSITIONS,
        lambda: coordinate_program(assembly, "places", equations, [positions[node][0] for node in nodes]),
        form,
    )
    places = dict(zip(nodes, assembly.kernel(program)([t], q, u)[0], strict=True))
    found: LineSigns = {}
    for path, local in assembly.mechanism.locals_.items():
        for a in local.connectors:
            for b in local.connectors:
                gap = places[equations.site.node(path, b)] - places[equations.site.node(path, a)]
                if gap != 0.0:
                    found[path, a, b] = 1.0 if gap > 0.0 else -1.0
    return found


def line_signs_differ(assembly: Assembly, actual: LineSigns) -> bool:
    """Return whether the signs that lengths were given differ from where things are."""
    for (path, a, b), sign in actual.items():
        given = assembly.mechanism.locals_[path].binding.line_signs or {}
        order = list(assembly.mechanism.locals_[path].connectors)
        usual = 1.0 if order.index(a) < order.index(b) else -1.0  # what laws take where the start does not tell
        if given.get((a, b), usual) != sign:
            return True
    return False
