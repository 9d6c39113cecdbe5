"""The Legendre transform of a scene in numbers, and which scenes have one.

With ``p = dL/dq'`` and ``H(q, p, t) = p q' - L`` (Goldstein, equations 8.2 and 8.15) the derivatives of H follow from
those of L at the same state, ``dH/dq = -dL/dq``, ``dH/dp = q'``, ``dH/dt = -dL/dt`` (equations 8.18 and 8.19). So
only L is differentiated, and nothing but a linear system is solved.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property

import numpy as np

from atwood.arrays import FloatArray
from atwood.display import count_of
from atwood.errors import AtwoodError, KernelEvaluationError, SolveError, UnsupportedError, UsageError
from atwood.expr import Expression, InputGroup, Program, depends_on, jacobian_by_rows, jvp, substitute, vjp
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.lagrangian import Lagrangian
from atwood.simulation.dynamics.orientation_coordinates import from_regular
from atwood.simulation.initialization.start import find_start
from atwood.theory.dynamics.functions import Function, Numbers, as_numbers, known_function, shape_of_states
from atwood.tolerances import tolerances

_PROGRAM: Key[Program] = Key("program of the Legendre transformation")

_NEWTON, _CONVERGED = 50, 1e-13
"""So many steps at most, and the change relative to the size of the velocities at which they end."""


class LegendreTransform:
    """The Legendre transform of a scene whose coordinates are free, as functions of numbers.

    States are arrays of n numbers, or of many states with a row each.

    Parameters
    ----------
    assembly
        The scene.
    found
        Its Lagrangian, in which every velocity is the derivative of a coordinate.
    """

    def __init__(self, assembly: Assembly, found: Lagrangian) -> None:
        self.assembly, self.lagrangian = assembly, found
        # Velocities may stand in another order than the coordinates of which they are the derivatives.
        places = [place for place in found.moves if place is not None]
        order = sorted(range(len(places)), key=places.__getitem__)
        self.velocity_symbols = tuple(found.velocities[k] for k in order)
        self.force_order = tuple(order)

    @property
    def size(self) -> int:
        """The number n of coordinates."""
        return len(self.lagrangian.coordinates)

    def momenta(self, q: Numbers, v: Numbers, t: float | None = None) -> FloatArray:
        """Return ``p = dL/dq'`` at coordinates and velocities."""
        return self._at("momenta", q, v, t)

    def lagrange_function(self, q: Numbers, v: Numbers, t: float | None = None) -> FloatArray:
        """Return L, J; shape () or (states,)."""
        return self._at("Lagrangian", q, v, t)[..., 0]

    def forces(self, q: Numbers, v: Numbers, t: float | None = None) -> FloatArray:
        """Return the generalized forces that L does not give: loads, less the derivatives of the Rayleigh function."""
        return self._at("other forces", q, v, t)

    def energies(self, q: Numbers, v: Numbers, t: float | None = None) -> FloatArray:
        """Return T and V, J; shape (2,) or (states, 2)."""
        return self._at("energies", q, v, t)

    def coordinate_gradient(self, q: Numbers, v: Numbers, t: float | None = None) -> FloatArray:
        """Return ``dL/dq`` at coordinates and velocities."""
        return self._at("dL/dq", q, v, t)

    def time_derivative(self, q: Numbers, v: Numbers, t: float | None = None) -> FloatArray:
        """Return ``dL/dt`` at coordinates and velocities; shape () or (states,)."""
        return self._at("dL/dt", q, v, t)[..., 0]

    def mass_matrix(self, q: Numbers, v: Numbers = None, t: float | None = None) -> FloatArray:
        """Return ``d2L/dq'2``, shape (n, n), or (states, n, n); velocities where it depends on them."""
        n, name = self.size, self.assembly.flat.name
        coordinates = as_numbers(q, n, "q", name)
        still = np.zeros(n) if v is None else as_numbers(v, n, "v", name)
        if self.has_moving_mass:
            return self._at("mass matrix", coordinates, np.broadcast_to(still, coordinates.shape), t)
        shape = (*coordinates.shape[:-1], n, n)
        units = np.broadcast_to(np.eye(n), shape)
        columns = self._at("columns", np.broadcast_to(coordinates[..., None, :], shape), units, t)
        return np.asarray(0.5 * (columns + np.swapaxes(columns, -1, -2)))

    def velocities(self, q: Numbers, p: Numbers, t: float | None = None) -> FloatArray:
        """Return the velocities with given momenta."""
        q, p = (as_numbers(one, self.size, letter, self.assembly.flat.name) for one, letter in ((q, "q"), (p, "p")))
        shape = (*shape_of_states((q, p), "qp", self.assembly.flat.name), self.size)
        q, p = np.broadcast_to(q, shape), np.broadcast_to(p, shape)
        v = np.zeros(q.shape)
        if not self.has_moving_mass:
            return self._solved(self.mass_matrix(q, t=t), p - self.momenta(q, v, t))
        for _ in range(_NEWTON):
            step = self._solved(self.mass_matrix(q, v, t), p - self.momenta(q, v, t))
            # Where a velocity has a bound, as that of light, a full step may lead beyond it: then a shorter one is.
            for _ in range(_NEWTON):
                tried = self._tried(q, v + step, t)
                if tried is not None:
                    break
                step = 0.5 * step
            v = v + step
            if np.all(np.abs(step) <= _CONVERGED * np.max(np.abs(v), axis=-1, keepdims=True)):
                return v
        raise SolveError("its momenta do not determine its velocities here", where=self.assembly.flat.name)

    def value(self, q: Numbers, p: Numbers, t: float | None = None) -> FloatArray:
        """Return H, J; shape () or (states,)."""
        v = self.velocities(q, p, t)
        return np.asarray(np.sum(np.asarray(p, dtype=float) * v, axis=-1) - self.lagrange_function(q, v, t))

    # -- programs -------------------------------------------------------------------------------------------------

    @cached_property
    def has_moving_mass(self) -> bool:
        """Whether L is not quadratic in the velocities."""
        return depends_on(self._inertia, self.velocity_symbols)

    @cached_property
    def _inertia(self) -> list[Expression]:
        """The second derivatives of L along one direction of velocities, which tell whether they depend on these."""
        graph = self.lagrangian.graph
        along: dict[Expression, Expression | float] = {
            v: graph.symbol(f"direction:{v.name}") for v in self.velocity_symbols
        }
        return jvp(self.momentum_expressions, along)

    @cached_property
    def momentum_expressions(self) -> list[Expression]:
        """The momenta as expressions of coordinates and velocities, in the order of the coordinates."""
        found = self.lagrangian
        return vjp([found.lagrangian], [found.graph.one], list(self.velocity_symbols))

    @cached_property
    def _quantities(self) -> Mapping[str, tuple[Callable[[], Sequence[Expression]], tuple[int, ...]]]:
        """Expressions of quantities of coordinates and velocities, and the shape of each at one state."""
        found, n = self.lagrangian, self.size
        return {
            "momenta": (lambda: self.momentum_expressions, (n,)),
            "Lagrangian": (lambda: [found.lagrangian], (1,)),
            "energies": (lambda: [found.kinetic, found.potential], (2,)),
            "dL/dq": (lambda: vjp([found.lagrangian], [found.graph.one], list(found.coordinates)), (n,)),
            "dL/dt": (lambda: jvp([found.lagrangian], {found.time: 1.0}), (1,)),
            "other forces": (lambda: self.force_expressions, (n,)),
            "columns": (self._mass_times_velocities, (n,)),
            "mass matrix": (lambda: jacobian_by_rows(self.momentum_expressions, self.velocity_symbols), (n, n)),
        }

    @cached_property
    def _functions(self) -> dict[str, Function]:
        return {}

    def _at(self, name: str, q: Numbers, v: Numbers, t: float | None) -> FloatArray:
        """Return one of the quantities in numbers; its function is made when it is first asked for."""
        if name not in self._functions:
            expressions, shape = self._quantities[name]
            state = {"t": (self.lagrangian.time,), "q": self.lagrangian.coordinates, "v": self.velocity_symbols}
            inputs = [InputGroup(letter, symbols) for letter, symbols in state.items()]
            kind = self.assembly.orientation.kind
            self._functions[name] = known_function(self.assembly, _PROGRAM, inputs, name, expressions, shape, kind)
        return self._functions[name](t, (q, v), None)

    @cached_property
    def force_expressions(self) -> tuple[Expression, ...]:
        """The forces of `forces`, as expressions."""
        found = self.lagrangian
        losses = vjp([found.rayleigh], [found.graph.one], list(self.velocity_symbols))
        return tuple(found.forces[k] - loss for k, loss in zip(self.force_order, losses, strict=True))

    def _mass_times_velocities(self) -> list[Expression]:
        """Return the product of the mass matrix with a direction, which stands in the place of the velocities."""
        graph = self.lagrangian.graph
        back: dict[Expression, Expression | float] = {
            graph.symbol(f"direction:{v.name}"): v for v in self.velocity_symbols
        }
        return substitute(self._inertia, back)

    # -- numbers --------------------------------------------------------------------------------------------------

    def _tried(self, q: FloatArray, v: FloatArray, t: float | None) -> FloatArray | None:
        """Return the momenta at velocities, None where there are none."""
        try:
            return self.momenta(q, v, t)
        except KernelEvaluationError:
            return None

    def _solved(self, mass: FloatArray, right: FloatArray) -> FloatArray:
        try:
            found = np.linalg.solve(mass, right[..., None])[..., 0]
        except np.linalg.LinAlgError:
            found = np.full(right.shape, np.nan)
        if not np.all(np.isfinite(found)):
            raise SolveError(
                "its mass matrix is singular at this place, so that momenta do not determine velocities",
                where=self.assembly.flat.name,
                advice="The coordinates are singular there, as angles at a pole are; take another place.",
            )
        return np.asarray(found)


_SAMPLES = 6
"""States at random at which it is looked whether the mass matrix is singular everywhere, and whether H is T + V."""


def refuse_without_hamiltonian(assembly: Assembly) -> None:
    """Refuse a scene whose motion is not that of free coordinates with a momentum each."""
    name = assembly.flat.name
    if assembly.form == "dae":
        raise UsageError(
            "in the dae form coordinates are tied by constraints, and have no free momenta",
            where=name,
            advice="Assemble the scene in the reduced form.",
        )
    equations = assembly.reduced
    rolling = [one for one in equations.constraints if not one.holonomic]
    if rolling or equations.solved_speeds:
        where = rolling[0].key[0] if rolling else name
        raise UnsupportedError(
            "it rolls: its constraints hold velocities and cannot be integrated, so that the forces of these are in no "
            "Hamiltonian, and its flow is not canonical",
            where=where,
            advice="Its energy function is kept all the same (`simulate` has it as `energy`), and `equations` has its "
            "equations of motion with multipliers.",
        )
    if equations.constraints:
        raise UnsupportedError(
            f"closed loops tie its {count_of(len(equations.coordinates), 'coordinate')} by "
            f"{count_of(len(equations.constraints), 'constraint')}, so that their momenta are not free",
            where=equations.constraints[0].key[0],
            advice="Take coordinates that the constraints leave free, such as angles in place of positions; or "
            "`equations`, which keeps the constraints with multipliers.",
        )
    if equations.states:
        raise UnsupportedError(
            "parts have states of their own, which follow equations of first order and have no momenta",
            where=name,
            advice="Take the scene without these parts, or `equations`.",
        )
    if not equations.coordinates:
        raise UnsupportedError("nothing in it can move, so that it has no momenta", where=name)


def sample_states(transform: LegendreTransform) -> tuple[float, FloatArray, FloatArray]:
    """Return a time and states: coordinates and velocities, a row each; those of the start first if there is one."""
    assembly, n = transform.assembly, transform.size
    random = np.random.default_rng(20)
    try:
        begun = find_start(assembly)
        t, q, size = begun.time, from_regular(assembly, begun.coordinates), begun.length
    except AtwoodError:
        t, q, size = assembly.flat.t_start, np.zeros(n), 1.0
    units = np.array([1.0 if one.unit == "rad" else size for one in transform.lagrangian.names])
    near = q + 0.5 * units * random.uniform(-1.0, 1.0, (_SAMPLES, n))
    return t, np.vstack([q, near]), units * random.uniform(-1.0, 1.0, (_SAMPLES + 1, n))


def check_mass(transform: LegendreTransform) -> None:
    """Refuse a scene whose mass matrix is singular everywhere."""
    t, places, velocities = sample_states(transform)
    worst: FloatArray | None = None
    for q, v in zip(places, velocities, strict=True):
        try:
            mass = transform.mass_matrix(q, 0.1 * v, t)
        except KernelEvaluationError:  # not every place is one where all laws have values
            continue
        sizes = np.sqrt(np.abs(np.diag(mass)))
        if np.all(sizes > 0.0):
            values, vectors = np.linalg.eigh(mass / np.outer(sizes, sizes))
            if np.min(np.abs(values)) > tolerances.SAME * len(values):
                return
            worst = np.abs(vectors[:, int(np.argmin(np.abs(values)))]) if worst is None else worst
        elif worst is None:
            worst = np.where(sizes > 0.0, 0.0, 1.0)
    if worst is None:
        return
    names = transform.lagrangian.names
    found = [names[i].name for i in np.flatnonzero(worst > 0.5 * np.max(worst))]
    what = f"{found[0]} has no inertia" if len(found) == 1 else f"{' and '.join(found)} move together without inertia"
    raise UnsupportedError(
        f"its mass matrix is singular: {what}, so that momenta do not determine velocities and there is no Hamiltonian",
        where=found[0],
        advice="Give what moves there a mass, or leave that coordinate out; `simulate` and `equations` need neither.",
    )


def is_energy(transform: LegendreTransform) -> bool:
    """Return whether H is T + V, as compared at random states."""
    t, places, velocities = sample_states(transform)
    for q, v in zip(places, velocities, strict=True):
        try:
            h = float(transform.momenta(q, v, t) @ v - transform.lagrange_function(q, v, t))
            kinetic, potential = transform.energies(q, v, t)
        except KernelEvaluationError:
            continue
        if abs(h - kinetic - potential) > tolerances.CLOSED * (abs(kinetic) + abs(potential) + abs(h)):
            return False
    return True


def changes_in_time(transform: LegendreTransform) -> bool:
    """Return whether ``dL/dt`` is not zero at some of some random states and times."""
    begin, places, velocities = sample_states(transform)
    span = transform.assembly.flat.t_end - begin
    for k, (q, v) in enumerate(zip(places, velocities, strict=True)):
        t = begin + span * (k + 0.5) / (len(places) + 1)
        try:
            rate = float(transform.time_derivative(q, v, t))
            size = float(np.sum(np.abs(transform.energies(q, v, t)))) + abs(float(transform.lagrange_function(q, v, t)))
        except KernelEvaluationError:
            continue
        if abs(rate) > tolerances.CLOSED * size / span:
            return True
    return False
