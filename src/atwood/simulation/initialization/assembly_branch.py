"""Joints that close loops in space, and whether their frames are turned as the joint says.

The constraints of a hinge say that two axes are parallel, which they are as well if one points the other way; those of
a guide hold after half a turn. A body hung on the joint could never get there, so that is no way to assemble it.
"""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import KernelEvaluationError
from atwood.expr import Expression, Program, Scalar, substitute
from atwood.forms.assembly import Assembly
from atwood.forms.kept import Key
from atwood.forms.quantities import coordinate_program
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.dynamics.forces import local_map
from atwood.mechanics.kinematics.orientation import node_axes
from atwood.model.values.rotation import as_rotation, compose
from atwood.model.values.vector import dot
from atwood.topology.graph import Joint

__all__ = ["wrongly_turned"]


def wrongly_turned(assembly: Assembly, equations: Equations, t: float, q: FloatArray) -> list[str]:
    """Return the paths of joints that close loops and whose frames are turned as their joint cannot turn them.

    Parameters
    ----------
    assembly, equations
        The scene, in generalized coordinates.
    t, q
        Time and coordinates that fulfil the constraints.
    """
    if not assembly.mechanism.space.is_spatial or not equations.forest.loop_joints:
        return []
    parts, program = assembly.shared.get(_BRANCH_TESTS, lambda: _branch_tests(assembly, equations))
    if not parts:
        return []
    try:
        traces = assembly.kernel(program)([t], q, np.zeros(len(equations.speeds)))[0]
    except KernelEvaluationError:  # an angle of the joint means nothing here
        return []
    # The trace of the rotation between the two is 1 + 2 cos; what is wrong at all is wrong by half a turn.
    return [part for part, trace in zip(parts, traces, strict=True) if trace < 2.0]


_BRANCH_TESTS: Key[tuple[tuple[str, ...], Program]] = Key("tests of the assembly branch")


def _branch_tests(assembly: Assembly, equations: Equations) -> tuple[tuple[str, ...], Program]:
    found = {}
    for joint in equations.forest.loop_joints:
        if joint.says_rotation:
            trace = _trace(equations, joint)
            if trace is not None:
                found[joint.part] = trace
    return tuple(found), coordinate_program(assembly, "facing", equations, list(found.values()))


def _trace(equations: Equations, joint: Joint) -> Expression | None:
    """Return the trace of the rotation between frame b of a joint and where its coordinates would have it."""
    site, kinematics = equations.site, equations.kinematics
    local = equations.locals_[joint.part]
    coordinates = joint.local.coordinates
    if any(symbol not in local.formulas for symbol in coordinates):
        return None
    mapping = local_map(site, local, kinematics)
    values = substitute([local.formulas[symbol][0] for symbol in coordinates], mapping)
    inner = as_rotation(joint.local.placement.rotation).axes()
    bodies = [site.bodies.body_of[node] for node in (joint.a, joint.b)]
    if any(body not in kinematics.placements.axes for body in bodies):
        return None
    axes_a, axes_b = (
        node_axes(None, kinematics.placements.axes[body], site.node_turns[node])
        for body, node in zip(bodies, (joint.a, joint.b), strict=True)
    )
    if axes_a is None or axes_b is None:
        return None
    total: Scalar = 0.0
    for should, actual in zip(compose(axes_a, inner), axes_b, strict=True):
        total = total + dot(should, actual)
    by_values = dict(zip(coordinates, values, strict=True))
    return substitute([site.graph.convert(total)], by_values)[0]
