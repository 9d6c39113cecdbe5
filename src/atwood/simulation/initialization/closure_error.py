"""How far a joint is from closing, in metres and radians, and whether its frames are turned as the joint says.

The constraints of a hinge say that two axes are parallel, which they are as well if one points the other way; those of
a guide hold after half a turn. A body hung on the joint could never get there, so that is no way to assemble it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import KernelEvaluationError
from atwood.expr import Expression, Program, Scalar, depends_on, evaluate, live, substitute
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.quantities import coordinate_program
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.build import resolve_signals
from atwood.mechanics.constraints.knots import BALANCES
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.dynamics.forces import place_part
from atwood.mechanics.kinematics.orientation import node_axes
from atwood.model.local.parts import LocalConnector, LocalConstraint, LocalPart
from atwood.model.values.rotation import as_rotation, compose
from atwood.model.values.space import dot
from atwood.numerics.matrices import least_norm
from atwood.tolerances import tolerances
from atwood.topology.graph import Joint


@dataclass(frozen=True)
class ClosureError:
    """What a joint lacks.

    The least displacement of one of its connectors with which it would close, the other staying where it is; and the
    least rotation.

    Attributes
    ----------
    part
        Path of the joint, or of whatever holds by a constraint.
    distance
        m.
    angle
        rad.
    """

    part: str
    distance: float
    angle: float

    def describe(self, length: float) -> str:
        """Return the gap in words, as in ``0.1 m`` or ``0.1 m and 3 deg``, without what is rounding beside the rest."""
        said = []
        if self.distance > tolerances.CLOSED * length * max(1.0, self.angle):
            said.append(f"{self.distance:.4g} m")
        if self.angle > tolerances.CLOSED:
            said.append(f"{np.degrees(self.angle):.4g} deg")
        return " and ".join(said) or f"{self.distance:.4g} m and {np.degrees(self.angle):.4g} deg"

    def size(self, length: float) -> float:
        """Return how large it is for a scene of a given extent."""
        return float(np.hypot(self.distance / length, self.angle))


def find_closure_errors(
    assembly: Assembly, equations: Equations, t: float, q: FloatArray, length: float
) -> list[ClosureError]:
    """Return the gaps of all joints that close loops, and of ties, in the order of declaration."""
    table = assembly.known_values
    place = {**table, equations.time: t, **dict(zip(equations.coordinates, np.asarray(q).tolist(), strict=True))}
    signals = resolve_signals(assembly.mechanism, equations.site, equations.kinematics, equations.read)
    rows: dict[str, list[LocalConstraint]] = {}
    for one in equations.constraints:
        if one.value is not None and one.key[1] not in BALANCES:
            local = equations.locals_[one.key[0]]
            rows.setdefault(one.key[0], []).extend(c for c in local.constraints if (c.law.name, c.index) == one.key[1:])
    found = []
    for path, constraints in rows.items():
        local = equations.locals_[path]
        mapping = place_part(equations.site, local, equations.kinematics, signals).mapping
        wanted = _read(local, constraints, mapping)
        numbers = dict(zip(wanted, evaluate([mapping[s] for s in wanted], place), strict=True))
        known = {**table, equations.time: t, **numbers}
        lengths = [c.value for c in constraints if c.law.options.unit == "N"]
        turns = [c.value for c in constraints if c.law.options.unit != "N"]
        distance = _least(lengths, local, known, _shifted, length)
        found.append(ClosureError(path, distance, _least(turns, local, known, _rotated, 1.0)))
    return found


def _read(
    local: LocalPart, constraints: Iterable[LocalConstraint], mapping: Mapping[Expression, Expression]
) -> list[Expression]:
    """Return the symbols that are needed to evaluate constraints wherever the connectors of their part are."""
    read = {node for node in live([c.value for c in constraints]) if node.is_symbol}
    for symbols in local.connectors.values():
        read.update((*symbols.position, *symbols.orientation))
    return [symbol for symbol in mapping if symbol in read]


Numbers = Mapping[Expression, float]
Moved = Callable[[LocalConnector, Numbers, FloatArray], dict[Expression, float]]


def _shifted(symbols: LocalConnector, known: Numbers, by: FloatArray) -> dict[Expression, float]:
    """Return the numbers of a connector after a displacement, in world axes."""
    return {s: known[s] + float(d) for s, d in zip(symbols.position, by, strict=False) if s in known}


def _rotated(symbols: LocalConnector, known: Numbers, by: FloatArray) -> dict[Expression, float]:
    """Return the numbers of a connector after a rotation: by an angle in the plane, else by a rotation vector."""
    if symbols.axes is None:
        return {s: known[s] + float(by[0]) for s in symbols.orientation if s in known}
    angle = float(np.linalg.norm(by))
    n = by / angle if angle > 0.0 else by
    found = {}
    for axis in symbols.axes:
        v = np.array([known.get(component, 0.0) for component in axis])
        turned = v * np.cos(angle) + np.cross(n, v) * np.sin(angle) + n * (n @ v) * (1.0 - np.cos(angle))
        found.update({s: float(x) for s, x in zip(axis, turned, strict=True) if s in known})
    return found


def _least(values: Sequence[Expression], local: LocalPart, known: Numbers, moved: Moved, unit: float) -> float:
    """Return the size of the least movement of a connector that makes values zero; without one, their own size.

    What counts as one is given by `unit`: the extent of the scene, or a radian.
    """
    if not values:
        return 0.0
    miss = np.array(evaluate(values, known))
    own = float(np.linalg.norm(miss))
    is_turn = moved is _rotated
    for symbols in reversed(list(local.connectors.values())):
        read = symbols.orientation if is_turn else symbols.position
        if not read or not any(depends_on(value, list(read)) for value in values):
            continue
        n = 1 if is_turn and symbols.axes is None else 3 if is_turn else len(symbols.position)
        by = np.zeros(n)

        def at(d: FloatArray, symbols: LocalConnector = symbols) -> FloatArray:
            return np.array(evaluate(values, {**known, **moved(symbols, known, d)}))

        h = 1e-6 * max(own, 1e-3 * unit)
        for _ in range(50):
            now = at(by)
            if float(np.linalg.norm(now)) <= 1e-13 * max(own, unit):
                break
            derivative = np.array([(at(by + h * e) - at(by - h * e)) / (2.0 * h) for e in np.eye(n)]).T
            # Of all movements that would do to first order the least one: not only the least change of this one.
            by = least_norm(derivative, derivative @ by - now)
        if float(np.linalg.norm(at(by))) <= tolerances.CLOSED * max(own, unit) and np.all(np.isfinite(by)):
            return float(np.linalg.norm(by))
    return own


def wrongly_turned(assembly: Assembly, equations: Equations, t: float, q: FloatArray) -> list[str]:
    """Return the paths of joints that close loops and whose frames are turned as their joint cannot turn them."""
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
    values = place_part(site, local, kinematics).put([local.formulas[symbol][0] for symbol in coordinates])
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
