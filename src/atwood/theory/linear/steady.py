"""Steady motions, which are states that move along a symmetry of the scene; and trim, values that make a state steady.

A vector field xi is a symmetry if it solves the variational equation along every motion: ``d xi / dt = A xi``. It is
looked for among shifts of time and of single coordinates, rotations of places and orientations about axes of the
space, and rotations of a body about axes of its own. If the motion at a state is such a field there, neighbours move by
``A - A_xi`` as seen by somebody who moves along, and that matrix does not change (Marsden and Ratiu, Introduction to
Mechanics and Symmetry, section 4.1: relative equilibria).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field

import numpy as np

from atwood.arguments import PATHS, takes
from atwood.arrays import FloatArray
from atwood.display import fitted
from atwood.errors import AtwoodError, ParameterError, SolveError, check_known
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import Model
from atwood.numerics.matrices import least_norm, or_one
from atwood.numerics.newton import Missing, largest, newton
from atwood.numerics.rank import null_space
from atwood.pipeline import SCENE, smooth_assembly_of
from atwood.simulation.dynamics.balance import balance_of
from atwood.theory.linear.displacements import Minimal, speed_of
from atwood.theory.linear.operating_point import AT, At, OperatingPoint, find_operating_point, moved_to, values_at
from atwood.theory.linear.rest import slopes_at
from atwood.theory.linear.variations import Flow, LinearScene
from atwood.tolerances import tolerances

_STEADY = 1e-7
"""Relative to the terms that it is made of: how well a motion must be a symmetry at the state.

A start is solved to 1e-11 of its scale, and what it gives for accelerations can be several powers of ten less exact.
"""

_KEPT = 1e-8
"""Relative to its terms: how well a field must solve the variational equation at random states."""

_NOTHING = 1e-12
"""Relative to the fastest rates of the scene: what is missed by less is rounding of terms that cancel."""

_STATES = 4
_REACH = 0.3
"""At so many random states near by, so far away in each coordinate and speed relative to their sizes."""


@dataclass(frozen=True, eq=False)
class _Field:
    """A vector field that may be a symmetry, with values along displacements and speeds.

    Attributes
    ----------
    at
        Its value at a flow.
    carried
        The rate of that value along the motion.
    matrix
        How it moves neighbours.
    is_time
        Whether it is the shift of time.
    """

    at: Callable[[Flow], FloatArray]
    carried: Callable[[Flow], FloatArray]
    matrix: FloatArray
    is_time: bool = False


@dataclass(frozen=True, eq=False)
class Steady:
    """What is known of the motion at a state.

    Attributes
    ----------
    is_steady
        Whether it is a steady motion, or rest.
    moving
        What the symmetry along which it moves does to neighbours, shape (displacements and speeds, twice).
    symmetries
        The directions along which the symmetries that were found lead from the state, as columns.
    fastest
        Number of the displacement or speed that changes most where the motion is not steady; -1 where it is, and where
        nothing moves now but the equations depend on time.
    """

    is_steady: bool
    moving: FloatArray
    symmetries: FloatArray
    fastest: int = -1


def find_steady(scene: LinearScene, flow: Flow, kept: Sequence[int]) -> Steady:
    """Find the symmetry along which a state moves."""
    size = len(flow.field)
    pace = pace_of(scene, flow)
    extents = np.concatenate([scene.displacement_sizes, scene.sizes * pace])
    sizes = extents * pace
    goal = flow.field / sizes
    is_still = bool(np.all(np.abs(goal) <= _STEADY)) or len(kept) == len(scene.sizes)  # or all is held
    if is_still and not scene.depends_on_time and not np.any(flow.variation.u):
        return still(flow)
    tiers = [[_constant(np.zeros(size), is_time=True)], _shifts(scene), _rotations(scene), _own_rotations(scene)]
    found: list[_Field] = []
    states = [flow, *_near_by(scene, flow, kept, pace)]
    symmetries = np.zeros((size, 0))
    for tier in tiers:
        found += tier
        combinations = _symmetric(found, states, sizes, extents)
        values = np.stack([one.at(flow) for one in found], axis=1) @ combinations
        symmetries = values
        timely = np.array([float(one.is_time) for one in found]) @ combinations  # by so many 1 / pace
        # Time goes on by itself: the symmetry shifts it at rate one, or nothing depends on it.
        rows = np.concatenate([values / sizes[:, None], timely[None, :] / pace])
        right = np.concatenate([goal, [1.0]])
        terms = least_norm(rows, right)
        missed = np.abs(rows @ terms - right)
        if np.all(missed <= _STEADY * (1.0 + np.abs(rows) @ np.abs(terms))):
            weights = combinations @ terms
            moving = sum((w * one.matrix for w, one in zip(weights, found, strict=True)), np.zeros((size, size)))
            return Steady(True, np.asarray(moving), symmetries)
    # Where coordinates grow along shifts this is no steady motion for what accelerates, not for what moves.
    moves = bool(np.any(np.abs(goal) > _STEADY))
    return Steady(False, np.zeros((size, size)), symmetries, int(np.argmax(missed[:size])) if moves else -1)


def still(flow: Flow) -> Steady:
    """Return the moving frame of a state at which neighbours are looked at as they are."""
    size = len(flow.field)
    return Steady(True, np.zeros((size, size)), np.zeros((size, 0)))


def pace_of(scene: LinearScene, flow: Flow) -> float:
    """Return how fast things happen, 1/s: the largest of what speeds and accelerations say beside the scene's sizes."""
    found = [1e-300]
    found += list(np.abs(flow.variation.displacement_rates) / scene.displacement_sizes)
    found += list(np.abs(flow.variation.u) / scene.sizes)
    matrix = flow.acceleration[:, : len(scene.tangents)] * scene.displacement_sizes / scene.sizes[:, None]
    found.append(float(np.sqrt(np.max(np.abs(matrix), initial=0.0))))
    return float(max(found)) if max(found) > 1e-300 else 1.0


def _near_by(scene: LinearScene, flow: Flow, kept: Sequence[int], pace: float) -> list[Flow]:
    """Return the flow at random states around one; where a law has no value another is taken."""
    random = np.random.default_rng(19180717)  # the year of Noether's theorem
    now, found = flow.variation, list[Flow]()
    for _ in range(5 * _STATES):
        reach = _REACH * 0.7 ** len(found)
        aside = reach * scene.displacement_sizes * random.uniform(-1.0, 1.0, len(scene.tangents))
        faster = reach * pace * scene.sizes * random.uniform(-1.0, 1.0, len(now.u))
        t = now.t + random.uniform(0.0, 2.0) / pace
        try:
            found.append(scene.flow(t, scene.tangents.moved(now.q, aside), now.u + faster, kept))
        except (AtwoodError, ArithmeticError):
            continue
        if len(found) == _STATES:
            break
    return found


def _symmetric(fields: Sequence[_Field], states: Sequence[Flow], sizes: FloatArray, extents: FloatArray) -> FloatArray:
    """Return the combinations of fields that are symmetries, as columns."""
    n = len(sizes)
    pace = float(np.max(sizes / extents, initial=0.0)) or 1.0
    large = np.array(
        [max(float(np.max(np.abs(one.at(flow)) / extents, initial=0.0)) for flow in states) or 1.0 for one in fields]
    )
    rows, own = [], []
    for flow in states:
        matrix, time = flow.matrix[:, :n], flow.matrix[:, n]
        missed, terms = np.zeros((n, len(fields))), np.zeros((n, len(fields)))
        for k, one in enumerate(fields):
            value, carried = one.at(flow), one.carried(flow)
            shifted = time / pace if one.is_time else np.zeros(n)
            missed[:, k] = (matrix @ value + shifted - carried) / sizes / large[k]
            terms[:, k] = (np.abs(matrix) @ np.abs(value) + np.abs(shifted) + np.abs(carried)) / sizes / large[k]
        rows.append(missed)
        own.append(terms)
    found, terms = np.concatenate(rows), np.concatenate(own)
    found = np.where(np.abs(found) > np.maximum(_KEPT * terms, _NOTHING), found, 0.0)
    row_sizes = np.max(np.abs(found), axis=1, initial=0.0)
    found = found[row_sizes > 0.0] / row_sizes[row_sizes > 0.0, None]
    if not len(found):
        return np.diag(1.0 / large)
    return np.asarray(null_space(found, np.full(len(found), _KEPT)) / large[:, None])


# -- candidates ------------------------------------------------------------------------------------------------------


def _constant(value: FloatArray, is_time: bool = False) -> _Field:
    size = len(value)
    still = np.zeros(size)
    return _Field(lambda _: value, lambda _: still, np.zeros((size, size)), is_time)


def _shifts(scene: LinearScene) -> Iterator[_Field]:
    """Yield the shift of each coordinate that is displaced by itself."""
    size = len(scene.tangents) + len(scene.sizes)
    for _, k in scene.tangents.plain:
        value = np.zeros(size)
        value[k] = 1.0
        yield _constant(value)
    for orientation, numbers in scene.tangents.orientation_coordinates:
        if orientation.kind == "direction":
            value = np.zeros(size)
            value[numbers[0]] = 1.0
            yield _constant(value)


def _rotations(scene: LinearScene) -> list[_Field]:
    """Return rotations of places and of orientations about axes of the space that they are in."""
    found = [_place_rotation(scene, pair) for pair in _pairs(scene)]
    for number, (orientation, _) in enumerate(scene.tangents.orientation_coordinates):
        if orientation.kind == "quaternion":
            found += [_turned_in_space(scene, number, axis) for axis in np.eye(3)]
    return found


def _pairs(scene: LinearScene) -> list[tuple[int, int]]:
    """Return the pairs of lengths that belong to one joint or body."""
    lengths: dict[str, list[int]] = {}
    for _, k in scene.tangents.plain:
        if scene.tangents.units[k] == "m":
            head, _, last = scene.tangents.names[k].rpartition(".")
            head = head if len(last) == 1 else f"{head}/{last.rstrip('0123456789')}"
            lengths.setdefault(head, []).append(k)
    return [(a, b) for own in lengths.values() for i, a in enumerate(own) for b in own[i + 1 :] if len(own) <= 3]


def _place_rotation(scene: LinearScene, pair: tuple[int, int]) -> _Field:
    size, count = len(scene.tangents) + len(scene.sizes), len(scene.tangents)
    matrix = np.zeros((size, size))
    (a, b), of_displacement = pair, {k: i for i, k in scene.tangents.plain}
    speeds = speed_of(scene)
    matrix[a, b], matrix[b, a] = -1.0, 1.0
    if a in speeds and b in speeds:
        u, v = count + speeds[a], count + speeds[b]
        matrix[u, v], matrix[v, u] = -1.0, 1.0

    def at(flow: Flow) -> FloatArray:
        state = np.zeros(size)
        for k in pair:
            state[k] = flow.variation.q[of_displacement[k]]
        state[count:] = flow.variation.u
        return np.asarray(matrix @ state)

    return _Field(at, lambda flow: np.asarray(matrix @ flow.field, dtype=float), matrix)


def _turned_in_space(scene: LinearScene, orientation: int, axis: FloatArray) -> _Field:
    """Return the rotation of an orientation about an axis of the space: neighbours are moved alike."""
    size = len(scene.tangents) + len(scene.sizes)
    own, numbers = scene.tangents.orientation_coordinates[orientation]

    def at(flow: Flow) -> FloatArray:
        value = np.zeros(size)
        value[list(numbers)] = _in_body(flow.variation.q[list(own.coordinates)], axis)
        return value

    def carried(flow: Flow) -> FloatArray:
        value = at(flow)
        value[list(numbers)] = -np.cross(flow.variation.displacement_rates[list(numbers)], value[list(numbers)])
        return value

    return _Field(at, carried, np.zeros((size, size)))


def _in_body(quaternion: FloatArray, axis: FloatArray) -> FloatArray:
    """Return an axis of the space in the body's own axes."""
    w, v = quaternion[0], quaternion[1:]
    found = (w * w - v @ v) * axis + 2.0 * (v @ axis) * v - 2.0 * w * np.cross(v, axis)
    return np.asarray(found / (quaternion @ quaternion))


def _own_rotations(scene: LinearScene) -> Iterator[_Field]:
    """Yield rotations of bodies about axes of their own, of which only the body's own velocities know."""
    size, count = len(scene.tangents) + len(scene.sizes), len(scene.tangents)
    for orientation, numbers in scene.tangents.orientation_coordinates:
        if orientation.kind != "quaternion":
            continue
        spins = [count + k for k in orientation.speeds]
        for axis in np.eye(3):
            matrix = np.zeros((size, size))
            crossed = -np.array([np.cross(axis, e) for e in np.eye(3)]).T
            matrix[np.ix_(numbers, numbers)] = crossed
            if len(spins) == 3:
                matrix[np.ix_(spins, spins)] = crossed
            yield _own_rotation(matrix, numbers, axis, spins, count)


def _own_rotation(
    matrix: FloatArray, numbers: Sequence[int], axis: FloatArray, spins: Sequence[int], count: int
) -> _Field:
    def at(flow: Flow) -> FloatArray:
        value = np.zeros(len(matrix))
        value[list(numbers)] = axis
        if len(spins) == 3:
            value[spins] = -np.cross(axis, flow.variation.u[[k - count for k in spins]])
        return value

    def carried(flow: Flow) -> FloatArray:
        value = np.zeros(len(matrix))
        if len(spins) == 3:
            value[spins] = -np.cross(axis, flow.variation.a[[k - count for k in spins]])
        return value

    return _Field(at, carried, matrix)


_STEPS, _FAR = 50, 0.5
"""So many steps at most, each of which turns nothing by more, rad."""


@dataclass(frozen=True, eq=False)
class Trim:
    """A steady state with the inputs that hold it.

    Attributes
    ----------
    inputs
        What has to be added to each input, by path.
    values
        Coordinates and speeds, by path.
    scene
        Name of the scene.
    point
        The state with its equations.
    """

    inputs: Mapping[str, float]
    values: Mapping[str, float]
    scene: str
    point: OperatingPoint = field(repr=False)

    def __str__(self) -> str:
        lines = [f"{self.scene}: trimmed"]
        lines += [f"  input {path} = {value:.9g}" for path, value in self.inputs.items()]
        lines += [f"  {path} = {value:.9g}" for path, value in list(self.values.items())[:7]]
        return "\n".join(lines)

    def __repr__(self) -> str:
        return fitted(str(self))


@takes(scene=SCENE, at=AT, inputs=PATHS, free=PATHS)
def trim(scene: Model | Assembly, *, at: At = None, inputs: Sequence[str] = (), free: Sequence[str] = ()) -> Trim:
    """Find inputs, and coordinates that are not given, with which nothing accelerates.

    Parameters
    ----------
    scene
        The scene, or an assembly of it.
    at
        The state that is wanted, by path; see `linearize`.
    inputs
        Inputs whose constant value may be chosen. Where several do, their squares add up to the least.
    free
        Coordinates that may move away from what `at` and the scene's start say; the others keep their values.

    Returns
    -------
    Trim
        The values.

    Raises
    ------
    SolveError
        If no values of these inputs and coordinates hold the state.
    ParameterError
        If there is no such input or coordinate.
    """
    point = find_operating_point(smooth_assembly_of(scene), at, inputs)
    first = _trial(point, {one.path: 0.0 for one in point.inputs}, _free_numbers(point, free))
    found, left = newton(lambda one: one.missing, _moved, first, np.ones(1), steps=_STEPS, exact=tolerances.MET)
    if left.miss <= tolerances.MET:
        return Trim(found.values, values_at(found.point), point.assembly.flat.name, found.point)
    name = point.scene.equations.speed_names[found.minimal.speeds[int(np.argmax(np.abs(left.value)))]].name
    raise SolveError(
        f"no values of these inputs and coordinates hold the state: {name} goes on changing",
        where=point.assembly.flat.name,
        advice="Let more inputs or coordinates be chosen, or ask for another state.",
    )


@dataclass(frozen=True, eq=False)
class _Trial:
    """A state with values of the inputs, and the accelerations there.

    Attributes
    ----------
    point, values, free
        The state, the values, and the numbers of coordinates that may move.
    minimal, chosen
        Independent coordinates, and which of them are free.
    scale
        How much accelerations change with each value and each free coordinate.
    missing
        The accelerations.
    """

    point: OperatingPoint
    values: Mapping[str, float]
    free: set[int]
    minimal: Minimal
    chosen: list[int]
    scale: FloatArray
    missing: Missing


def _trial(point: OperatingPoint, values: Mapping[str, float], free: set[int]) -> _Trial:
    linear = point.scene
    pushed = {linear.inputs[k].name: value for path, value in values.items() for k in _numbers_of(point, path)}
    current = linear.with_inputs(pushed)
    flow = current.flow(point.t, point.q, point.u, point.kept)
    minimal, a, slopes = slopes_at(current, flow, point.kept)
    own = linear.sizes[list(minimal.speeds)]
    by = flow.acceleration[list(minimal.speeds), len(flow.field) + 1 :] / own[:, None]
    gains = [sum((by[:, k] for k in _numbers_of(point, path)), np.zeros(len(own))) for path in values]
    chosen = [i for i, k in enumerate(minimal.displacements) if k in free]
    matrix = np.column_stack([*gains, slopes[:, chosen]])
    size = largest(slopes) + largest(a) or 1.0
    scale = or_one(np.max(np.abs(matrix), axis=0, initial=0.0))
    missing = Missing(a, np.full(len(a), size), lambda: matrix / scale, np.ones(len(a)))
    return _Trial(point, values, free, minimal, chosen, scale, missing)


def _moved(one: _Trial, by: FloatArray) -> _Trial:
    """Return the trial with other values and coordinates; no coordinate moves by more than half a radian."""
    point, linear, step = one.point, one.point.scene, by / one.scale
    values = {path: old + float(value) for (path, old), value in zip(one.values.items(), step, strict=False)}
    turned = step[len(values) :]
    turned = turned * min(1.0, _FAR / max(largest(turned), 1e-300))
    moved = np.zeros(len(linear.tangents))
    for i, value in zip(one.chosen, turned, strict=True):
        moved += one.minimal.shift[:, i] * value * linear.displacement_sizes[one.minimal.displacements[i]]
    q, u = balance_of(point.assembly, "reduced").project(
        point.t, linear.tangents.moved(point.q, moved), point.u, linear.sizes
    )
    return _trial(moved_to(point, q, u), values, one.free)


def _numbers_of(point: OperatingPoint, path: str) -> list[int]:
    first, found = 0, []
    for one in point.inputs:
        if one.path == path:
            found = [first + 3 * k for k in range(len(one.keys))]
        first += 3 * len(one.keys)
    return found


def _free_numbers(point: OperatingPoint, free: Sequence[str]) -> set[int]:
    names = list(point.scene.tangents.names)
    for path in free:
        check_known(path, names, "there is no such coordinate", error=ParameterError)
    return {names.index(path) for path in free}
