"""`linearize`: the linear model of a scene about a state, with the errors that rounding makes in its matrices.

At a switch, where a law changes from one side to the other, there is no linear model. Outputs are coordinates or
quantities of components.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atwood.arguments import PATHS, takes
from atwood.arrays import FloatArray
from atwood.codegen.rounding import ROUGHNESS
from atwood.errors import AtwoodError, ParameterError, UnsupportedError, UsageError, check_known, suggestion_in_parts
from atwood.expr import Expression, InputGroup, OutputGroup, Program, jacobian, live
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE
from atwood.simulation.problem.arguments import FORM
from atwood.theory.linear.displacements import Minimal, find_minimal, image_of, pulled_back
from atwood.theory.linear.linear_model import LinearModel
from atwood.theory.linear.operating_point import AT, At, OperatingPoint, find_operating_point, speed_name, values_at
from atwood.theory.linear.steady import Steady, find_steady, pace_of, still
from atwood.theory.linear.variations import Flow, LinearScene
from atwood.tolerances import tolerances


@takes(scene=SCENE, at=AT, inputs=PATHS, outputs=PATHS, form=FORM)
def linearize(
    scene: Model | Assembly,
    *,
    at: At = None,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    form: str = "reduced",
) -> LinearModel:
    """Linearise a scene about a state of rest, a steady motion, or a state of a run.

    All derivatives are those of the expression graph; no differences are taken. States are minimal: of closed loops
    and of rolling, only independent deviations. About a steady motion (a relative equilibrium: a top that precesses, a
    wheel that rolls) neighbours are seen by somebody who moves along, so that A does not depend on time.

    Parameters
    ----------
    scene
        The scene, or an assembly of it, which is faster if it is linearised often.
    at
        Values by path, of positions and speeds: positions that are not said stay near the scene's own start, speeds
        that are not said are zero as far as the constraints let them. Or a result and one of its output times. The
        scene's start if not given.
    inputs
        Inputs of forces, motors and drives by path, such as ``"force.value"``, or outputs of sources that feed some. Of
        a prescribed motion the acceleration is the input, and its position and speed become states.
    outputs
        Quantities by path.
    form
        Whose equations are linearised: those of the reduced form, or with ``"dae"`` the constrained ones in maximal
        coordinates. The states are the same, and so are the matrices to rounding.

    Returns
    -------
    LinearModel
        The matrices, with the names of what they belong to.

    Raises
    ------
    StartError
        If there is no such state, or it is a singular position.
    ParameterError
        If there is no such input or output.
    UsageError
        If the motion at the state is not steady, or a switch or an event is there.
    """
    point = find_operating_point(scene, at, inputs)
    flow = point.scene.flow(point.t, point.q, point.u, point.kept)
    refuse_switches(point.scene, flow, point.kept)
    steady = still(flow) if point.is_from_result else find_steady(point.scene, flow, point.kept)
    if not steady.is_steady:
        raise not_steady(point, flow, steady)
    space = find_state_space(point.scene, flow, steady, point.kept)
    if form == "dae":
        space = _of_dae_form(point, flow, steady, space)
    rows = output_rows(point, flow, space.minimal, outputs)
    return _model(point, flow, space, rows, list(outputs), form)


def _of_dae_form(point: OperatingPoint, flow: Flow, steady: Steady, space: StateSpace) -> StateSpace:
    """Return the same model with accelerations from the constrained equations in maximal coordinates."""
    minimal, count = space.minimal, len(point.scene.tangents)
    image, _, own = image_of(point.scene, flow, minimal)
    accelerations = pulled_back(image, own) - steady.moving[count:] @ minimal.state
    matrix = space.matrix.copy()
    matrix[len(minimal.displacements) :] = accelerations[list(minimal.speeds)]
    return StateSpace(minimal, matrix, space.error, space.sizes)


def not_steady(point: OperatingPoint, flow: Flow, steady: Steady) -> UsageError:
    """Return the error that says what changes at a state that is no steady motion."""
    scene, count = point.scene, len(point.scene.tangents)
    if steady.fastest < 0:
        what = "nothing moves now, and the equations depend on time"
    elif steady.fastest < count:
        name, rate = scene.tangents.names[steady.fastest], flow.variation.displacement_rates[steady.fastest]
        unit = "m/s" if scene.tangents.units[steady.fastest] == "m" else "rad/s"
        what = f"{name} moves at {rate:.3g} {unit}, and the equations depend on it"
    else:
        number = steady.fastest - count
        one = scene.equations.speed_names[number]
        what = f"{one.name} changes at {flow.variation.a[number]:.3g} {one.unit}/s".replace("/s/s", "/s^2")
    return UsageError(
        f"the state is neither at rest nor a steady motion: {what}",
        where=point.assembly.flat.name,
        advice="Give `at=` values of one (`equilibria` and `trim` find them), or a result and a time for a linear "
        "model that holds at that time alone.",
    )


# -- the model -------------------------------------------------------------------------------------------------------


def _model(
    point: OperatingPoint, flow: Flow, space: StateSpace, rows: FloatArray, outputs: list[str], form: str
) -> LinearModel:
    minimal, n = space.minimal, space.minimal.states
    inputs, units, moved = _inputs(point, space, rows)
    count = n + 2 * len(moved)
    a, error = np.zeros((count, count)), np.zeros((count, count))
    a[:n, :n], error[:n, :n] = space.matrix[:, :n], space.error[:, :n]
    c, d = np.zeros((len(outputs), count)), np.zeros((len(outputs), len(inputs)))
    b = np.zeros((count, len(inputs)))
    c[:, :n] = rows[:, :n]
    for k, (_, columns) in enumerate(inputs.items()):
        value, rate, second = (n + column for column in columns)
        if k not in moved:
            b[:n, k], d[:, k] = space.matrix[:, value], rows[:, value]
            continue
        place = n + 2 * list(moved).index(k)
        for offset, column in enumerate((value, rate)):
            a[:n, place + offset], c[:, place + offset] = space.matrix[:, column], rows[:, column]
            error[:n, place + offset] = space.error[:, column]
        a[place, place + 1] = b[place + 1, k] = 1.0
        b[:n, k], d[:, k] = space.matrix[:, second], rows[:, second]
    names = _state_names(point, minimal)
    names += [name + mark for k in moved for name in [list(inputs)[k]] for mark in ("", "'")]
    shown = tuple(f"{name}''" if k in moved else name for k, name in enumerate(inputs))
    units |= _units(point, minimal) | {path: point.assembly.start_observables[path].unit for path in outputs}
    about = "motion" if point.is_from_result else "steady motion" if _moves(point) else "rest"
    driven = np.ones(2 * len(moved))
    return LinearModel(
        A=a,
        B=b,
        C=c,
        D=d,
        states=tuple(names),
        inputs=shown,
        outputs=tuple(outputs),
        units=units,
        values=values_at(point),
        scene=point.assembly.flat.name,
        form=form,
        about=about,
        error=error,
        sizes=np.concatenate([space.sizes, driven]),
        contacts=point.contacts,
    )


def _inputs(
    point: OperatingPoint, space: StateSpace, rows: FloatArray
) -> tuple[dict[str, tuple[int, int, int]], dict[str, str], tuple[int, ...]]:
    """Return the columns of each input, their units, and which of the inputs are prescribed motions."""
    n, first = space.minimal.states, 0
    found: dict[str, tuple[int, int, int]] = {}
    units: dict[str, str] = {}
    moved = []
    for k, one in enumerate(point.inputs):
        for other in range(1, len(one.keys)):  # one source that feeds several inputs
            for matrix in (space.matrix, rows):
                matrix[:, n + first : n + first + 3] += matrix[:, n + first + 3 * other : n + first + 3 * other + 3]
        found[one.path] = (first, first + 1, first + 2)
        units[one.path] = one.unit
        if _places_bodies(point, first):
            moved.append(k)
            units |= {f"{one.path}'": f"{one.unit}/s", f"{one.path}''": f"{one.unit}/s^2"}
        first += 3 * len(one.keys)
    return found, units, tuple(moved)


def _places_bodies(point: OperatingPoint, number: int) -> bool:
    """Return whether an input is a motion that is prescribed: whether positions or orientations depend on it."""
    placements, value = point.scene.equations.kinematics.placements, point.scene.inputs[number]
    found = [one for position in placements.positions.values() for one in position]
    found += [one for axes in placements.axes.values() for axis in axes for one in axis]
    found += list(placements.angles.values())
    return any(node is value for node in live(found))


def _moves(point: OperatingPoint) -> bool:
    sizes = point.scene.sizes
    return bool(np.any(np.abs(point.u) > 1e-12 * sizes * max(1.0, float(np.max(np.abs(point.u) / sizes, initial=0.0)))))


def _state_names(point: OperatingPoint, minimal: Minimal) -> list[str]:
    scene = point.scene
    return [
        *(scene.tangents.names[k] for k in minimal.displacements),
        *(speed_name(point, k) for k in minimal.speeds),
    ]


def _units(point: OperatingPoint, minimal: Minimal) -> dict[str, str]:
    scene = point.scene
    found = {scene.tangents.names[k]: scene.tangents.units[k] for k in minimal.displacements}
    return found | {speed_name(point, k): scene.equations.speed_names[k].unit for k in minimal.speeds}


_DISTURBANCES = 3
"""How often everything is disturbed to see what rounding can do."""


@dataclass(frozen=True, eq=False)
class StateSpace:
    """How minimal states change: ``x' = A x + B w``.

    Attributes
    ----------
    minimal
        The minimal states.
    matrix
        A and B side by side, shape (states, states and inputs).
    error
        How far rounding can have taken each entry.
    sizes
        What is large for each state: the scene's sizes, and for speeds the rate at which these change fastest.
    """

    minimal: Minimal
    matrix: FloatArray
    error: FloatArray
    sizes: FloatArray


def find_state_space(scene: LinearScene, flow: Flow, steady: Steady, kept: Sequence[int]) -> StateSpace:
    """Return the linear model about a state in minimal states."""
    minimal = find_minimal(scene, flow, kept)
    matrix = _matrix(flow, steady, minimal)
    random, largest = np.random.default_rng(1974), np.zeros_like(matrix)
    now = flow.variation
    pace = pace_of(scene, flow)
    for _ in range(_DISTURBANCES):
        other = scene.disturbed(random)
        by = ROUGHNESS * scene.displacement_sizes * random.uniform(-1.0, 1.0, len(scene.tangents))
        faster = ROUGHNESS * pace * scene.sizes * random.uniform(-1.0, 1.0, len(now.u))
        found = other.flow(now.t, scene.tangents.moved(now.q, by), now.u + faster, kept)
        near = _matrix(found, steady, find_minimal(other, found, kept, minimal))
        largest = np.maximum(largest, np.abs(near - matrix))
    n = len(minimal.displacements)
    own = scene.displacement_sizes[list(minimal.displacements)], scene.sizes[list(minimal.speeds)]
    fastest = np.sqrt(np.max(np.abs(matrix[n:, :n] * own[0] / own[1][:, None]), initial=0.0))
    fastest = max(float(fastest), float(np.max(np.abs(matrix[n:, n : minimal.states]), initial=0.0))) or 1.0
    sizes = np.concatenate([own[0], own[1] * fastest])
    return StateSpace(minimal, matrix, tolerances.CERTAIN * largest, sizes)


def _matrix(flow: Flow, steady: Steady, minimal: Minimal) -> FloatArray:
    size = len(flow.field)
    moved = (flow.matrix[:, :size] - steady.moving) @ minimal.state
    moved[:, minimal.states :] += flow.matrix[:, size + 1 :]
    return minimal.reduced(moved)


_SWITCHES = ("less", "less_equal", "sign", "absolute", "minimum", "maximum", "floor")

_ASIDE = 1e-7
"""How far from the state both sides are looked at, relative to the scene's sizes."""

_JUMP = 1e-3
"""Relative to their terms: derivatives that differ by more on two sides so near to each other jump."""

_SIDES = 4


def refuse_switches(scene: LinearScene, flow: Flow, kept: Sequence[int]) -> None:
    """Refuse a state at which the derivatives of the equations jump."""
    margins = _margins(scene)
    if not margins:
        return
    program = scene.program("switches", {"at": margins}, ())
    kernel, now = scene.assembly.kernel(program), flow.variation
    random = np.random.default_rng(5)
    with np.errstate(all="ignore"):
        here = np.asarray(kernel(np.array([now.t]), now.q, now.u, now.a, now.multipliers)[0])
    pace = float(np.max(np.abs(now.u) / scene.sizes, initial=0.0)) or 1.0
    for _ in range(_SIDES):
        by = _ASIDE * scene.displacement_sizes * random.uniform(-1.0, 1.0, len(scene.tangents))
        faster = _ASIDE * pace * scene.sizes * random.uniform(-1.0, 1.0, len(now.u))
        sides = []
        try:
            for sign in (1.0, -1.0):
                q, u = scene.tangents.moved(now.q, sign * by), now.u + sign * faster
                there = np.asarray(kernel(np.array([now.t + sign * _ASIDE / pace]), q, u, now.a, now.multipliers)[0])
                sides.append((there, scene.flow(now.t + sign * _ASIDE / pace, q, u, kept)))
        except (AtwoodError, ArithmeticError):
            continue
        (first, left), (second, right) = sides
        crossed = (first * second <= 0.0) | (here == 0.0)
        if not np.any(crossed):
            continue
        both = np.abs(left.acceleration) + np.abs(right.acceleration)
        jump = np.abs(left.acceleration - right.acceleration) - _JUMP * np.max(both, axis=1, initial=0.0)[:, None]
        worst = int(np.argmax(np.max(jump, axis=1, initial=-1.0)))
        if jump.size and np.max(jump) > 0.0:
            raise UsageError(
                f"a law switches here: {scene.equations.speed_names[worst].name} has another rate on each side",
                where=scene.assembly.flat.name,
                advice="Look at a state beside it, where one side holds.",
            )


def _margins(scene: LinearScene) -> tuple[Expression, ...]:
    """Return what changes its sign where laws switch."""
    e = scene.equations
    moving = {*e.coordinates, *e.speeds, e.time}
    nodes = live([*e.rows, *e.constraint_rows])
    reached = {symbol.index for symbol in moving}
    found: dict[Expression, None] = {}
    for node in nodes:
        if any(argument.index in reached for argument in node.arguments):
            reached.add(node.index)
            if node.operation in _SWITCHES:
                first = node.arguments[0]
                found[first if len(node.arguments) == 1 else first - node.arguments[1]] = None
    return tuple(found)


def output_rows(point: OperatingPoint, flow: Flow, minimal: Minimal, paths: Sequence[str]) -> FloatArray:
    """Return how quantities change with minimal states and inputs, shape (quantities, columns of `Minimal`)."""
    found, known = [], point.assembly.start_observables
    for path in paths:
        check_known(path, known, "there is no such quantity", hint=suggestion_in_parts, error=ParameterError)
        found.append(known[path].value)
    scene, now, inputs = point.scene, flow.variation, len(point.scene.inputs)
    total = np.zeros((len(found), minimal.states + inputs))
    if not found:
        return total
    parts = scene.differentiated("quantity", found)
    reads = {node for node in live(found) if node.is_symbol}
    reactions = [one for one in point.assembly.reactions if one.symbol in reads]
    by_reaction = jacobian(found, [one.symbol for one in reactions])
    outputs = [OutputGroup(f"quantity by {by}", tuple(matrix.entries)) for by, matrix in parts.places.items()]
    outputs.append(OutputGroup("by reactions", tuple(by_reaction.entries)))
    groups = (*scene.equations.inputs, InputGroup("reactions", tuple(one.symbol for one in reactions)))
    program = Program(f"{point.assembly.flat.name} outputs, varied", groups, point.assembly.parameters, tuple(outputs))
    values, changes = _reactions(point, flow, minimal, [one.path for one in reactions])
    state = (np.array([now.t]), now.q, now.u, now.a, now.multipliers, values)
    numbers = scene.evaluate(point.assembly.kernel(program), program, state)
    by = scene.matrices(parts, numbers)
    columns = minimal.states
    acceleration = flow.acceleration[:, : len(flow.field)] @ minimal.state
    acceleration[:, columns:] += flow.acceleration[:, len(flow.field) + 1 :]
    total += by["quantity", "q"] @ now.basis @ minimal.shift + by["quantity", "u"] @ minimal.speed
    total += by["quantity", "a"] @ acceleration
    total[:, columns:] += by["quantity", "w"]
    np.add.at(total, list(by_reaction.rows), numbers["by reactions"][:, None] * changes[list(by_reaction.columns)])
    return total


def _reactions(
    point: OperatingPoint, flow: Flow, minimal: Minimal, paths: Sequence[str]
) -> tuple[FloatArray, FloatArray]:
    """Return the values of reactions, and how they change with minimal states and inputs."""
    if not paths:
        return np.zeros(0), np.zeros((0, minimal.states + len(point.scene.inputs)))
    image, kept, _ = image_of(point.scene, flow, minimal)
    number = {one.key: i for i, one in enumerate(point.assembly.maximal.constraints)}
    of_path = {one.path: one for one in point.assembly.reactions}
    values, changes = [], []
    for path in paths:
        one = of_path[path]
        if one.key not in number or len(kept) < len(number):
            why = (
                "it is inside of a rigid body"
                if one.key not in number
                else "constraints are redundant, so that \
reactions are not unique"
            )
            raise UnsupportedError(
                f"it cannot be an output of a linear model: {why}", where=path, advice="Take another quantity."
            )
        values.append(one.sign * image.flow.variation.multipliers[number[one.key]])
        changes.append(one.sign * image.multiplier[number[one.key]])
    return np.array(values), np.array(changes)
