"""Expressions and balances of forces in which nothing is left to the clock or to a switch.

Numbers at a few states say nothing of a push that acts for a tenth of a second, or of a stop that nothing touches. So
what depends on time alone becomes a symbol that may have any value, and so does the choice of each switch, and each
function that can be as good as zero nearly everywhere. What switches alike, or is the same function of equal numbers,
has equal values: two stops on both sides of a mass that is in the middle belong together.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

import numpy as np

from atwood.arrays import BoolArray, FloatArray
from atwood.codegen import compile_program
from atwood.codegen.rounding import ROUGHNESS
from atwood.expr import Expression, Graph, InputGroup, OutputGroup, Program, jacobian_by_rows
from atwood.expr.core import algebra
from atwood.expr.core.relations import TimeRelations
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.kinematics.orientation import spin_in_world
from atwood.numerics.matrices import from_entries, to_array
from atwood.numerics.rank import certain, independent_rows
from atwood.simulation.dynamics.balance import BalanceValues, balance_of, solve_balance
from atwood.simulation.dynamics.kinematic_map import KinematicMap, kinematic_map_of
from atwood.simulation.dynamics.scales import motion_scales
from atwood.simulation.initialization.start import Start

_COMPARISONS = ("less", "less_equal")
_CONDITIONS = (*_COMPARISONS, "logical_and", "logical_or", "logical_not")
_SWITCHES = (*_COMPARISONS, "sign", "absolute", "minimum", "maximum")
_EVEN, _ODD = ("exp", "cosh"), ("sinh", "tanh")

_ALIKE = 1e-9
"""Numbers that switch something are equal if they are this near, relative to the largest of them."""


@dataclass(frozen=True)
class Loosened:
    """A program in which what the clock and switches decide are parameters.

    Attributes
    ----------
    program
        The program; the further parameters are its last ones: those of the clock, of switches, of functions.
    probe
        Program of the same inputs that says what those of the clock are, and by which numbers the others are decided.
    conditions
        Which of those of the clock are conditions, 0 or 1.
    odd
        Which of those of functions have the sign of their argument.
    """

    program: Program
    probe: Program
    conditions: BoolArray
    odd: BoolArray

    @property
    def is_plain(self) -> bool:
        """Whether neither the clock nor a switch nor such a function decides anything."""
        return not self.probe.results

    def choose(self, probed: Sequence[FloatArray], random: np.random.Generator, number: int) -> FloatArray:
        """Return values of the further parameters."""
        at, sides, arguments = (np.asarray(one, dtype=float) for one in probed)
        # What is zero now may not be at another time.
        clock = np.where(at == 0.0, random.uniform(-1.0, 1.0, len(at)), at * random.uniform(0.5, 1.5, len(at)))
        clock[self.conditions] = random.integers(0, 2, np.count_nonzero(self.conditions))
        chosen = _alike(sides, lambda: float(random.choice([-1.0, 1.0])) if number > 1 else 1.0 - 2.0 * number)
        chosen[sides == 0.0] = 0.0
        functions = _alike(np.abs(arguments), lambda: float(random.uniform(0.5, 1.5)))
        functions = np.where(self.odd, np.sign(arguments) * functions, functions)
        return np.concatenate([clock, chosen, functions])


def _alike(keys: FloatArray, draw: Callable[[], float]) -> FloatArray:
    """Return a value drawn for each number, the same for numbers that are equal."""
    found = np.zeros(len(keys))
    near = _ALIKE * float(np.max(np.abs(keys), initial=0.0))
    last = -np.inf
    value = 0.0
    for i in np.argsort(keys):
        if keys[i] - last > near:
            value = draw()
        last = keys[i]
        found[i] = value
    return found


def loosen(program: Program, relations: TimeRelations, moving: Collection[Expression]) -> Loosened:
    """Return a program in which what the clock and switches decide are parameters."""
    maker = _Maker(program.graph, relations)
    nodes = program.nodes
    by_clock, by_motion = _followers(nodes, relations.roots), _followers(nodes, moving)

    def taken(node: Expression) -> Expression:
        if node.index in by_motion or node.index not in by_clock:
            return maker.made.get(node.index, node)
        return maker.by_clock(node)

    unknowns: dict[int, list[Expression]] = {}
    for node in nodes:
        if node.index not in by_motion or not node.arguments:
            continue
        if node.operation == "component":
            maker.made[node.index] = unknowns[node.arguments[0].index][node.payload]
            continue
        arguments = [taken(one) for one in node.arguments]
        if node.operation == "solve":
            split = node.payload**2
            unknowns[node.index] = algebra.solve(arguments[:split], arguments[split:])
            continue
        maker.made[node.index] = maker.rebuilt(node, arguments)
    outputs = tuple(OutputGroup(name, tuple(taken(one) for one in found)) for name, found in program.outputs)
    return maker.finish(program, outputs)


def _followers(nodes: Sequence[Expression], roots: Collection[Expression]) -> set[int]:
    found = {one.index for one in roots}
    for node in nodes:
        if any(argument.index in found for argument in node.arguments):
            found.add(node.index)
    return found


class _Maker:
    """Puts symbols in the place of what is decided, and notes what decides it."""

    def __init__(self, graph: Graph, relations: TimeRelations) -> None:
        self.graph = graph
        self._relations = {one.symbol: one.kind for one in relations.found}
        self.made: dict[int, Expression] = {}
        self._clock: dict[Expression, Expression] = {}
        self._sides: list[tuple[Expression, Expression]] = []
        self._functions: list[tuple[Expression, Expression, bool]] = []

    def by_clock(self, node: Expression) -> Expression:
        """Return what stands for a function of time alone."""
        if node not in self._clock:
            self._clock[node] = self.graph.symbol(f"clock:{len(self._clock)}")
        return self._clock[node]

    def _side(self, node: Expression) -> Expression:
        """Return what stands for the side on which a switch is, -1 or 1; 0 where it is on the very edge."""
        first = node.arguments[0]
        key = first if len(node.arguments) == 1 else first - node.arguments[1]
        self._sides.append((key, self.graph.symbol(f"side:{len(self._sides)}")))
        return self._sides[-1][1]

    def rebuilt(self, node: Expression, arguments: list[Expression]) -> Expression:
        """Return a node of the state on other arguments; what is decided there is a symbol."""
        if node.operation in _EVEN or node.operation in _ODD:
            symbol = self.graph.symbol(f"function:{len(self._functions)}")
            self._functions.append((node.arguments[0], symbol, node.operation in _ODD))
            return symbol
        if node.operation not in _SWITCHES:
            return algebra.build(self.graph, node.operation, arguments, node.payload)
        side = self._side(node)
        if node.operation == "sign":
            return side
        if node.operation == "absolute":
            return side * arguments[0]
        if node.operation in _COMPARISONS:
            return algebra.less(self.graph.zero, side)
        return algebra.select(algebra.less(self.graph.zero, side), arguments[0], arguments[1])

    def _is_condition(self, node: Expression) -> bool:
        return node.operation in _CONDITIONS or self._relations.get(node, "sign") != "sign"

    def finish(self, program: Program, outputs: tuple[OutputGroup, ...]) -> Loosened:
        """Return the programs."""
        symbols = (*self._clock.values(), *(one for _, one in self._sides), *(one for _, one, _ in self._functions))
        keys = (
            OutputGroup("clock", tuple(self._clock)),
            OutputGroup("sides", tuple(key for key, _ in self._sides)),
            OutputGroup("arguments", tuple(argument for argument, _, _ in self._functions)),
        )
        inputs: tuple[InputGroup, ...] = program.inputs
        return Loosened(
            Program(f"{program.name}, loosened", inputs, (*program.parameters, *symbols), outputs),
            Program(f"{program.name}, probed", inputs, program.parameters, keys),
            np.array([self._is_condition(one) for one in self._clock], dtype=bool),
            np.array([is_odd for _, _, is_odd in self._functions], dtype=bool),
        )


@dataclass(frozen=True, eq=False)
class Bodies:
    """Where bodies are, and how they move: a point of each, and of those that have one the orientation.

    Attributes
    ----------
    places
        Of the points, m, shape (points, 3).
    velocities
        Of the points, m/s, or their accelerations, m/s^2.
    by_place
        Derivatives of the velocities by the speeds, shape (points, 3, speeds).
    axes
        The three axes of each orientation as rows, in world axes.
    spins
        Angular velocities in world axes, rad/s, or angular accelerations, rad/s^2, shape (orientations, 3).
    by_spin
        Derivatives of the angular velocities by the speeds, shape (orientations, 3, speeds).
    """

    places: FloatArray
    velocities: FloatArray
    by_place: FloatArray
    axes: FloatArray
    spins: FloatArray
    by_spin: FloatArray


class LooseScene:
    """The numbers of a scene at any state, with what the clock and switches decide set free.

    Parameters
    ----------
    assembly
        The scene.
    start
        Its start.
    """

    def __init__(self, assembly: Assembly, start: Start) -> None:
        self.assembly, self.start = assembly, start
        equations = assembly.reduced
        self.kinematic_map: KinematicMap = kinematic_map_of(assembly, "reduced")
        self.sizes = motion_scales(equations, start.length)
        balance = assembly.balance("reduced")
        self._errors = balance_of(assembly, "reduced").errors
        self._balance, self.holonomic = balance, list(balance.holonomic)
        groups, self._counts = _body_groups(assembly, equations)
        inputs = (*balance.program.inputs, InputGroup("a", equations.accelerations))
        program = Program(
            f"{assembly.flat.name} symmetry", inputs, assembly.parameters, (*balance.program.outputs, *groups)
        )
        moving = {*equations.coordinates, *equations.speeds, *equations.accelerations}
        self.loosened: Loosened = loosen(program, assembly.mechanism.relations, moving)
        self._exact, self._kernel = (compile_program(one) for one in (program, self.loosened.program))
        self._probe = compile_program(self.loosened.probe)
        self.bound = self._exact.bind(assembly.parameter_values)

    def loosely(self, t: float, q: FloatArray, u: FloatArray, random: np.random.Generator, number: int) -> None:
        """Take other values for what the clock and switches decide at a state; see `Loosened.choose`."""
        known = self.assembly.parameter_values
        probed = self._probe.bind(known)([t], q, u, np.zeros_like(u))
        self.bound = self._kernel.bind(np.concatenate([known, self.loosened.choose(probed, random, number)]))

    def exactly(self) -> None:
        """Take what they are."""
        self.bound = self._exact.bind(self.assembly.parameter_values)

    def row_units(self, t: float, q: FloatArray, rows: FloatArray, shifts: int) -> FloatArray:
        """Return the size of each row, and of one that is rounding alone the size of what it is computed from."""
        held = self._errors.near(t, q, self.sizes)[self.holonomic] / ROUGHNESS
        turns = len(rows) - len(held) - shifts
        made_of = np.concatenate([held, np.full(shifts, self.start.length), np.ones(turns)])
        sizes = np.max(np.abs(rows), axis=1, initial=0.0)
        is_known = sizes > certain(ROUGHNESS * made_of, sizes)
        return np.where(is_known, sizes, np.where(made_of > 0.0, made_of, 1.0))

    def at(self, t: float, q: FloatArray, u: FloatArray, a: FloatArray | None = None) -> tuple[BalanceValues, Bodies]:
        """Return the balance of forces and the bodies at a state, with accelerations these in place of speeds."""
        n, b = len(u), self._balance
        values = [np.asarray(x, dtype=float) for x in self.bound([t], q, u, np.zeros(n) if a is None else a)]
        if not all(np.all(np.isfinite(x)) for x in values):
            raise np.linalg.LinAlgError("a law has no value here")
        mass, bias, value, rate, gamma, constraint_jacobian, explicit_rate, *of_bodies = values
        places, velocities, seconds, by_place, axes, spins, turns, by_spin = of_bodies
        matrix = to_array(from_entries(b.mass_rows, b.mass_columns, mass, (n, n), True))
        jacobian_ = to_array(
            from_entries(b.jacobian_rows, b.jacobian_columns, constraint_jacobian, (b.constraints, n), True)
        )
        now = BalanceValues(matrix, bias, value, rate, gamma, jacobian_, explicit_rate)
        points, turning = self._counts
        moved = (velocities, spins) if a is None else (seconds, turns)
        return now, Bodies(
            places.reshape(points, 3),
            moved[0].reshape(points, 3),
            by_place.reshape(points, 3, n),
            axes.reshape(turning, 3, 3),
            moved[1].reshape(turning, 3),
            by_spin.reshape(turning, 3, n),
        )

    def accelerations(self, t: float, q: FloatArray, u: FloatArray) -> Bodies:
        """Return the accelerations of the bodies at a state."""
        now, _ = self.at(t, q, u)
        errors = self._errors.of_jacobian(t, q, self.sizes)
        kept = np.asarray(independent_rows(np.asarray(now.jacobian) * self.sizes, errors), dtype=np.intp)
        return self.at(t, q, u, solve_balance(now, kept, t)[0])[1]


def _body_groups(assembly: Assembly, equations: Equations) -> tuple[tuple[OutputGroup, ...], tuple[int, int]]:
    """Return the outputs of `Bodies`, and the numbers of points and of orientations."""
    graph, kinematics = equations.graph, equations.kinematics
    lists: tuple[list[Expression], ...] = ([], [], [], [], [], [])
    places, velocities, seconds, axes, spins, turns = lists
    for body in assembly.mechanism.bodies.bodies[1:]:
        places += kinematics.placements.positions[body.root]
        velocities += kinematics.velocities[body.root]
        seconds += kinematics.accelerations[body.root]
        own = kinematics.placements.axes.get(body.index)
        if own is not None:
            axes += [graph.convert(component) for axis in own for component in axis]
            spins += [graph.convert(c) for c in spin_in_world(kinematics.angular_velocities[body.index], own)]
            turns += [graph.convert(c) for c in spin_in_world(kinematics.angular_accelerations[body.index], own)]
    groups = (
        OutputGroup("places", tuple(places)),
        OutputGroup("velocities", tuple(velocities)),
        OutputGroup("accelerations", tuple(seconds)),
        OutputGroup("by place", tuple(jacobian_by_rows(velocities, equations.speeds))),
        OutputGroup("axes", tuple(axes)),
        OutputGroup("spins", tuple(spins)),
        OutputGroup("turning", tuple(turns)),
        OutputGroup("by spin", tuple(jacobian_by_rows(spins, equations.speeds))),
    )
    return groups, (len(places) // 3, len(spins) // 3)
