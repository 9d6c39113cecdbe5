"""The bodies of a scene and the balance of forces at any state, with what the clock and switches decide set free."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from atwood.arrays import FloatArray
from atwood.codegen import compile_program
from atwood.codegen.rounding import ROUGHNESS
from atwood.expr import Expression, InputGroup, OutputGroup, Program, jacobian
from atwood.forms.assembly import Assembly
from atwood.late import dataclass
from atwood.mechanics.dynamics.equations import Equations
from atwood.mechanics.kinematics.orientation import spin_in_world
from atwood.numerics.independence import certain, independent_rows
from atwood.numerics.matrices import from_entries, to_array
from atwood.simulation.dynamics.balance import BalanceValues, balance_of, solve_balance
from atwood.simulation.dynamics.kinematic_map import KinematicMap, kinematic_map_of
from atwood.simulation.dynamics.scales import motion_scales
from atwood.simulation.initialization.start import Start
from atwood.theory.symmetry.generic_switches import Loosened, loosen

__all__ = ["Bodies", "LooseScene"]


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
        """Return the size of each row, and of one that is rounding alone the size of what it is computed from.

        Parameters
        ----------
        t, q
            Where they belong.
        rows
            Those of the constraints on positions, then so many of displacements, then those of rotations.
        shifts
            How many belong to displacements.
        """
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
        (
            mass,
            bias,
            value,
            rate,
            gamma,
            constraint_jacobian,
            explicit_rate,
            places,
            velocities,
            seconds,
            by_place,
            axes,
            spins,
            turns,
            by_spin,
        ) = values
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
    places: list[Expression] = []
    velocities: list[Expression] = []
    seconds: list[Expression] = []
    axes: list[Expression] = []
    spins: list[Expression] = []
    turns: list[Expression] = []
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
        OutputGroup("by place", _dense(velocities, equations)),
        OutputGroup("axes", tuple(axes)),
        OutputGroup("spins", tuple(spins)),
        OutputGroup("turning", tuple(turns)),
        OutputGroup("by spin", _dense(spins, equations)),
    )
    return groups, (len(places) // 3, len(spins) // 3)


def _dense(values: Sequence[Expression], equations: Equations) -> tuple[Expression, ...]:
    n = len(equations.speeds)
    found = [equations.graph.zero] * (len(values) * n)
    slopes = jacobian(list(values), list(equations.speeds))
    for row, column, entry in zip(slopes.rows, slopes.columns, slopes.entries, strict=True):
        found[row * n + column] = entry
    return tuple(found)
