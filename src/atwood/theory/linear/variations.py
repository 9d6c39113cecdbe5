"""First variations of the equations of motion about a state, by derivatives of the expression graph.

The equations ``F(t, q, u, a, w) = G^T lambda``, the constraints' values, rates ``c1`` and second derivatives ``c2``,
and the coordinates' rates are differentiated by displacements, speeds, time and inputs; no differences are taken. They
give the variations of accelerations and multipliers as the equations themselves do:

    M da - G^T dlambda = -(F_s ds + F_u du + F_t dt + F_w dw),    G da = -(c2_s ds + c2_u du + c2_t dt + c2_w dw).

Displacements of a configuration are small: along each coordinate, and rotations where coordinates are orientations.
The tangent of a quaternion is the small rotation of the body in its own axes, so that three numbers stand for it and
its size, which means nothing, does not appear. ``dq = N(q) ds`` with N block by block; N is linear in q.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.codegen import BoundKernel
from atwood.codegen.rounding import ROUGHNESS
from atwood.expr import Expression, OutputGroup, Program, SparseMatrix, jacobian
from atwood.forms.assembly import Assembly, FormName
from atwood.forms.caches import Key
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import Equations
from atwood.simulation.dynamics.balance import balance_of, solve_determined
from atwood.simulation.dynamics.redundancy import RankFinding, find_rank
from atwood.simulation.dynamics.scales import motion_scales, scene_length
from atwood.simulation.problem.preparation import find_not_compilable
from atwood.topology.orientation_coordinates import OrientationCoordinates

Times: TypeAlias = float | FloatArray
"""The time of a state, or of many."""

_VARIATIONS: Key[tuple[list[Differentiated], Program]] = Key("derivatives of the equations")


@dataclass(frozen=True)
class Differentiated:
    """One group of expressions with its derivatives by some groups of symbols."""

    name: str
    rows: int
    columns: Mapping[str, int]
    places: Mapping[str, SparseMatrix]

    @cached_property
    def numbers(self) -> dict[str, tuple[NDArray[np.intp], NDArray[np.intp]]]:
        """Rows and columns of the entries, by what the derivatives are taken."""
        return {by: (np.array(x.rows, np.intp), np.array(x.columns, np.intp)) for by, x in self.places.items()}


@dataclass(frozen=True, eq=False)
class Variation:
    """Numbers of the equations at a state, with their derivatives along displacements, speeds, time and inputs.

    At many states all arrays have one more axis, the first.

    Attributes
    ----------
    t, q, u, a, multipliers
        The state, with the accelerations and multipliers that belong to it.
    basis
        ``N(q)``; see `Tangents`.
    displacement_rates
        ``s'``: how the configuration moves, shape (displacements,).
    values
        Of each group of expressions.
    by
        Derivatives of each group: ``by["force", "q"]`` and so on, along coordinates.
    """

    t: Times
    q: FloatArray
    u: FloatArray
    a: FloatArray
    multipliers: FloatArray
    basis: FloatArray
    displacement_rates: FloatArray
    values: Mapping[str, FloatArray]
    by: Mapping[tuple[str, str], FloatArray]

    def along(self, name: str) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return the derivatives of a group along displacements, speeds, time and inputs."""
        return self.by[name, "q"] @ self.basis, self.by[name, "u"], self.by[name, "t"], self.by[name, "w"]


@dataclass(frozen=True, eq=False)
class Flow:
    """How a state moves, and how neighbouring states move beside it.

    Columns are displacements, speeds, time and inputs, in this order.

    Attributes
    ----------
    variation
        What it was found from.
    shift
        ``s'`` of neighbours, shape (displacements, columns).
    acceleration, multiplier
        ``da`` and ``dlambda``, of shape (speeds, columns) and (constraints, columns).
    """

    variation: Variation
    shift: FloatArray
    acceleration: FloatArray
    multiplier: FloatArray

    @property
    def field(self) -> FloatArray:
        """The state's own motion: ``s'`` and ``u'``."""
        return np.concatenate([self.variation.displacement_rates, self.variation.a], axis=-1)

    @property
    def matrix(self) -> FloatArray:
        """The derivative of that along displacements and speeds, then time and inputs."""
        return np.concatenate([self.shift, self.acceleration], axis=-2)


class LinearScene:
    """The equations of a scene with their first derivatives as programs.

    Parameters
    ----------
    assembly
        The scene.
    form
        In which coordinates: generalized ones, in which orientations are quaternions, or maximal ones.
    inputs
        The symbols of inputs: parameters that are zero.
    """

    def __init__(self, assembly: Assembly, form: FormName, inputs: Sequence[Expression] = ()) -> None:
        self.assembly, self.form, self.inputs = assembly, form, tuple(inputs)
        self.equations: Equations = assembly.regular if form == "reduced" else assembly.maximal
        self.tangents: Tangents = find_tangents(self.equations)
        self._measure(scene_length(assembly))
        self._bound: BoundKernel | None = None

    def _measure(self, length: float) -> None:
        self.length = length
        self.sizes = motion_scales(self.equations, length)
        self.displacement_sizes = np.array([length if unit == "m" else 1.0 for unit in self.tangents.units])

    def sized(self, length: float) -> LinearScene:
        """Return the same with another size of the scene, m."""
        found = copy(self)
        found._measure(length)
        return found

    # -- programs -------------------------------------------------------------------------------------------------

    @cached_property
    def _expressions(self) -> dict[str, list[Expression]]:
        e = self.equations
        zero = e.graph.zero
        force = [row - held for row, held in zip(e.rows, e.constraint_rows, strict=True)] if e.constraints else e.rows
        return {
            "rates": list(e.rates),
            "force": list(force),
            "value": [zero if one.value is None else one.value for one in e.constraints],
            "rate": [one.rate for one in e.constraints],
            "second": [one.second for one in e.constraints],
        }

    @cached_property
    def _made(self) -> tuple[list[Differentiated], Program]:
        """The derivatives and their program, made once for all scenes of a structure."""

        def make() -> tuple[list[Differentiated], Program]:
            parts = [self.differentiated(name, found) for name, found in self._expressions.items()]
            return parts, self.program("variations", self._expressions, parts)

        about = self.form, tuple(symbol.name for symbol in self.inputs)
        return self.assembly.shared.get(_VARIATIONS, make, *about)

    @property
    def parts(self) -> list[Differentiated]:
        """Where the derivatives of each group of expressions stand."""
        return self._made[0]

    def differentiated(self, name: str, found: Sequence[Expression]) -> Differentiated:
        """Return where the derivatives of some expressions stand, with the expressions of the entries."""
        e = self.equations
        symbols = {
            "q": e.coordinates,
            "u": e.speeds,
            "a": e.accelerations,
            "multipliers": e.multipliers,
            "t": (e.time,),
            "w": self.inputs,
        }
        places = {one: jacobian(list(found), list(by)) for one, by in symbols.items() if by and found}
        return Differentiated(name, len(found), {one: len(by) for one, by in symbols.items()}, places)

    def program(
        self, name: str, expressions: Mapping[str, Sequence[Expression]], parts: Sequence[Differentiated]
    ) -> Program:
        """Return the program of a state that gives expressions and the entries of their derivatives."""
        outputs = [OutputGroup(group, tuple(found)) for group, found in expressions.items()]
        for part in parts:
            outputs += [
                OutputGroup(f"{part.name} by {by}", tuple(matrix.entries)) for by, matrix in part.places.items()
            ]
        return Program(
            f"{self.assembly.flat.name} {name}", self.equations.inputs, self.assembly.parameters, tuple(outputs)
        )

    @property
    def derivatives(self) -> Program:
        """The program of the expressions and the entries of their derivatives at a state."""
        return self._made[1]

    def _kernel(self, of_many: bool) -> Any:
        if self._bound is not None:
            assert not of_many, "other values of parameters are for one state at a time"
            return self._bound
        assembly, program = self.assembly, self.derivatives
        in_python = of_many and find_not_compilable(assembly, program)
        return assembly.columns(program) if of_many and not in_python else assembly.kernel(program, of_many)

    def _with_values(self, values: FloatArray) -> LinearScene:
        """Return the same with other values of the parameters."""
        found = copy(self)
        found._bound = self.assembly.compiled(self.derivatives).bind(values)
        return found

    def with_inputs(self, values: Mapping[str, float]) -> LinearScene:
        """Return the same with inputs that have other values than zero, by the name of their symbol."""
        numbers = self.assembly.parameter_values.copy()
        place = {symbol.name: i for i, symbol in enumerate(self.assembly.parameters)}
        for name, value in values.items():
            numbers[place[name]] = value
        return self._with_values(numbers)

    @property
    def depends_on_time(self) -> bool:
        """Whether time appears in the equations."""
        return any(len(part.places["t"].entries) > 0 for part in self.parts if "t" in part.places)

    def disturbed(self, random: np.random.Generator) -> LinearScene:
        """Return the same with parameters that are off by a little more than rounding."""
        values = self.assembly.parameter_values
        return self._with_values(values * (1.0 + ROUGHNESS * random.uniform(-1.0, 1.0, values.shape)))

    # -- numbers --------------------------------------------------------------------------------------------------

    def rank(self, t: float, q: FloatArray) -> RankFinding:
        """Return which constraints are independent; `find_rank` asks places near by as well."""
        return find_rank(balance_of(self.assembly, "dae" if self.form == "dae" else "reduced"), t, q, self.sizes)

    def matrices(self, part: Differentiated, values: Mapping[str, FloatArray]) -> dict[tuple[str, str], FloatArray]:
        """Return the derivatives of a group as matrices, shape (..., rows, columns)."""
        found: dict[tuple[str, str], FloatArray] = {}
        states = next(iter(values.values())).shape[:-1]
        for by, count in part.columns.items():
            matrix = np.zeros((*states, part.rows, count))
            if by in part.numbers:
                matrix[..., *part.numbers[by]] = values[f"{part.name} by {by}"]
            found[part.name, by] = matrix
        return found

    def evaluate(self, kernel: Any, program: Program, state: tuple[FloatArray, ...]) -> dict[str, FloatArray]:
        """Return the output groups of a program by name, of states along the first axis."""
        groups = [group.name for group in program.outputs]
        found = kernel(*(group.T for group in state))
        return {name: np.asarray(x, dtype=float).T for name, x in zip(groups, found, strict=True)}

    def variation(self, t: Times, q: FloatArray, u: FloatArray, a: FloatArray, held: FloatArray) -> Variation:
        """Return the equations and their derivatives at a state, or at many, along the first axis."""
        kernel = self._kernel(q.ndim > 1)
        values = self.evaluate(kernel, self.derivatives, (np.asarray(t, dtype=float)[..., None], q, u, a, held))
        by: dict[tuple[str, str], FloatArray] = {}
        for part in self.parts:
            by |= self.matrices(part, values)
        basis, inverse = self.tangents.basis(q), self.tangents.inverse(q)
        return Variation(t, q, u, a, held, basis, (inverse @ values["rates"][..., None])[..., 0], values, by)

    def flow(self, t: Times, q: FloatArray, u: FloatArray, kept: Sequence[int]) -> Flow:
        """Return how a state and its neighbours move, or many states, along the first axis."""
        n, kept = len(self.equations.speeds), list(kept)
        zero_a, zero_held = (np.zeros((*q.shape[:-1], size)) for size in (n, len(self.equations.constraints)))
        still = self.variation(t, q, u, zero_a, zero_held)
        m, first = len(kept), float(np.ravel(t)[0])
        matrix = np.zeros((*q.shape[:-1], n + m, n + m))
        matrix[..., :n, :n] = still.by["force", "a"]
        if m:
            matrix[..., :n, n:] = still.by["force", "multipliers"][..., kept]
            matrix[..., n:, :n] = still.by["second", "a"][..., kept, :]
        right = np.concatenate([still.values["force"], still.values["second"][..., kept]], axis=-1)
        solved = solve_determined(matrix, -right, first)
        a, held = solved[..., :n], zero_held.copy()
        held[..., kept] = solved[..., n:]
        now = self.variation(t, q, u, a, held)
        force, second, rates = (np.concatenate(now.along(name), axis=-1) for name in ("force", "second", "rates"))
        moved = solve_determined(matrix, -np.concatenate([force, second[..., kept, :]], axis=-2), first)
        multiplier = np.zeros((*zero_held.shape, force.shape[-1]))
        multiplier[..., kept, :] = moved[..., n:, :]
        return Flow(now, self.shift(q, now.basis, now.displacement_rates, rates), moved[..., :n, :], multiplier)

    def shift(self, q: FloatArray, basis: FloatArray, moving: FloatArray, rates: FloatArray) -> FloatArray:
        """Return how displacements of neighbours change: ``ds' = N^+ (R_q N - N') ds + N^+ R_u du + ...``."""
        found = rates
        if self.tangents.orientation_coordinates:
            # N is linear in q; coordinates that move by themselves have a constant part of it, which does not change.
            turned = self.tangents.basis((basis @ moving[..., None])[..., 0])
            for i, k in self.tangents.plain:
                turned[..., i, k] = 0.0
            found = rates.copy()
            found[..., : len(self.tangents)] -= turned
        return np.asarray(self.tangents.inverse(q) @ found)


@dataclass(frozen=True)
class Tangents:
    """The displacements of a configuration.

    Attributes
    ----------
    coordinates
        Number of coordinates.
    names, units
        Of each displacement: the coordinate's name, or that of a small rotation, such as ``body.rotation.x``.
    plain
        For each coordinate that is displaced by itself: its number, and that of the displacement.
    orientation_coordinates
        The orientations, each with the numbers of its displacements.
    """

    coordinates: int
    names: tuple[str, ...]
    units: tuple[str, ...]
    plain: tuple[tuple[int, int], ...]
    orientation_coordinates: tuple[tuple[OrientationCoordinates, tuple[int, ...]], ...]

    def __len__(self) -> int:
        return len(self.names)

    def basis(self, q: FloatArray) -> FloatArray:
        """Return N(q), shape (..., coordinates, displacements) for coordinates of shape (..., coordinates)."""
        found = np.zeros((*q.shape[:-1], self.coordinates, len(self)))
        for i, k in self.plain:
            found[..., i, k] = 1.0
        for orientation, numbers in self.orientation_coordinates:
            rows, columns = np.ix_(orientation.coordinates, numbers)
            found[..., rows, columns] = _block(q[..., list(orientation.coordinates)])
        return found

    def inverse(self, q: FloatArray) -> FloatArray:
        """Return the left inverse of N(q), shape (..., displacements, coordinates)."""
        found = np.zeros((*q.shape[:-1], len(self), self.coordinates))
        for i, k in self.plain:
            found[..., k, i] = 1.0
        for orientation, numbers in self.orientation_coordinates:
            own = q[..., list(orientation.coordinates)]
            scale = (4.0 if own.shape[-1] == 4 else 1.0) / np.sum(own * own, axis=-1)
            rows, columns = np.ix_(numbers, orientation.coordinates)
            found[..., rows, columns] = scale[..., None, None] * np.swapaxes(_block(own), -1, -2)
        return found

    def moved(self, q: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return coordinates after a displacement, orientations turned by its whole angle."""
        found = q.copy()
        for i, k in self.plain:
            found[i] += displacement[k]
        for orientation, numbers in self.orientation_coordinates:
            own, by = q[list(orientation.coordinates)], displacement[list(numbers)]
            angle = float(np.linalg.norm(by))
            half = 0.5 * angle if len(own) == 4 else angle
            step = _block(own) @ by * (np.sinc(half / np.pi) if angle else 1.0)
            found[list(orientation.coordinates)] = np.cos(half) * own + step
        return found


def _block(own: FloatArray) -> FloatArray:
    """Return the derivative of the coordinates of an orientation by a small rotation in the body's axes."""
    parts = np.moveaxis(own, -1, 0)
    if len(parts) == 2:  # cosine and sine
        return np.stack([-parts[1], parts[0]], axis=-1)[..., None]
    w, x, y, z = parts
    rows = [[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]]
    return 0.5 * np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def find_tangents(equations: Equations) -> Tangents:
    """Return the displacements of the coordinates of a set of equations, whose orientations are quaternions."""
    of_orientation = {orientation.coordinates[0]: orientation for orientation in equations.orientation_coordinates}
    inside = {i for orientation in equations.orientation_coordinates for i in orientation.coordinates}
    names: list[str] = []
    units: list[str] = []
    plain: list[tuple[int, int]] = []
    orientation_coordinates: list[tuple[OrientationCoordinates, tuple[int, ...]]] = []
    for i, one in enumerate(equations.names):
        if i not in inside:
            plain.append((i, len(names)))
            names.append(one.name)
            units.append(one.unit)
        elif i in of_orientation:
            orientation = of_orientation[i]
            axes = ("x", "y", "z") if orientation.kind == "quaternion" else ("",)
            orientation_coordinates.append((orientation, tuple(range(len(names), len(names) + len(axes)))))
            names += [f"{orientation.body}.rotation{'.' * bool(axis)}{axis}" for axis in axes]
            units += ["rad"] * len(axes)
    return Tangents(len(equations.names), tuple(names), tuple(units), tuple(plain), tuple(orientation_coordinates))
