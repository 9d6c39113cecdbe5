"""The dynamics of a scene as functions of numbers: compiled, for one state and for many, for trees and loops.

In the notation of Featherstone (Rigid Body Dynamics Algorithms, chapters 2 and 3), with ``h`` of all forces of the
scene and its weight: ``M a + h = tau + G^T lambda``, ``G a + gamma = 0``, along the speeds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from atwood.arguments import NAME, check, optional, takes
from atwood.arrays import FloatArray
from atwood.errors import SolveError, UsageError, suggestion_in_parts
from atwood.expr import (
    Expression,
    InputGroup,
    Program,
    depends_on,
    jacobian,
    jacobian_by_rows,
    jvp,
    substitute,
)
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.forms.program import is_too_long, state_groups
from atwood.lazy_dataclasses import dataclass
from atwood.mechanics.dynamics.equations import Equations
from atwood.model.compose.composite import Model
from atwood.numerics.rank import independent_rows
from atwood.pipeline import SCENE, smooth_assembly_of
from atwood.simulation.dynamics.balance import BalanceValues, balance_of, mass_at, solve_balance
from atwood.simulation.dynamics.scales import motion_scales
from atwood.simulation.initialization.start import Start, find_start, own_state
from atwood.simulation.problem.arguments import FORM, ORIENTATION
from atwood.theory.dynamics.functions import Function, Numbers, as_numbers, as_time, at_time, known_function

_PROGRAM: Key[Program] = Key("program of a function of the state")


@dataclass(frozen=True, eq=False)
class Dynamics:
    """Functions of numbers of a scene: mass matrix, bias, constraint Jacobian, inverse and forward dynamics.

    States are arrays of coordinates q and speeds u, in the order of `coordinates` and `speeds`; of many states at once
    they have a row for each, and so have results. Speeds are derivatives of coordinates, and for orientations in space
    angular velocities in the axes of the body. Arrays to be filled can be given (`out`), of float64, contiguous: then a
    call for one state copies nothing.

    Attributes
    ----------
    assembly
        The scene.
    """

    assembly: Assembly

    # -- what there is ------------------------------------------------------------------------------------------------

    @property
    def equations(self) -> Equations:
        """What the functions are made of."""
        return self.assembly.in_coordinates(self.assembly.form)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Paths of the coordinates, in the order of q."""
        return tuple(one.name for one in self.equations.names)

    @property
    def speeds(self) -> tuple[str, ...]:
        """Names of the speeds, in the order of u: `rod.angle'` is the derivative of `rod.angle`."""
        return tuple(one.name for one in self.equations.speed_names)

    @property
    def constraints(self) -> tuple[str, ...]:
        """Names of the constraints that the coordinates do not solve, in the order of the rows of G."""
        return tuple(one.label for one in self.equations.constraints)

    @cached_property
    def _start(self) -> Start:
        return find_start(self.assembly)

    def start(self) -> tuple[FloatArray, FloatArray]:
        """Return coordinates and speeds where the scene starts.

        Raises
        ------
        StartError
            If the start is not consistent, or three coordinates of an orientation are singular there.
        """
        q, u = own_state(self.assembly, self._start)
        return q.copy(), u.copy()

    def __repr__(self) -> str:
        n, m = len(self.speeds), len(self.constraints)
        held = f", {m} constraint{'s' if m > 1 else ''}" if m else ""
        return f"Dynamics({self.assembly.flat.name!r}, {self.assembly.form}: {n} speed{'s' if n != 1 else ''}{held})"

    # -- functions ----------------------------------------------------------------------------------------------------

    def mass_matrix(
        self, q: Numbers, *, u: Numbers = None, t: float | None = None, out: FloatArray | None = None
    ) -> FloatArray:
        """Return the mass matrix M, shape (speeds, speeds), or (states, speeds, speeds).

        Parameters
        ----------
        q
            Coordinates.
        u
            Speeds, where the mass matrix depends on them, as that of a relativistic Lagrangian does.
        t
            Time, s; that of the start if not given.
        out
            An array to fill.

        Raises
        ------
        KernelEvaluationError
            If a law has no value at a state.
        UsageError
            If an array has the wrong shape, or speeds are needed.
        """
        if self._mass is None:
            return self._mass_by_columns(q, u, t, out)
        if u is None and self._mass_moves:
            raise UsageError("its mass matrix depends on the speeds", where=self._name, advice="Give u.")
        n = len(self.equations.speeds)
        return self._mass(t, (q, np.zeros(n) if u is None else u) if self._mass_moves else (q,), out)

    def bias(self, q: Numbers, u: Numbers, *, t: float | None = None, out: FloatArray | None = None) -> FloatArray:
        """Return h, all terms without accelerations: velocity terms, less weight and all forces; shape (speeds,).

        Parameters
        ----------
        q, u
            Coordinates and speeds.
        t, out
            See `mass_matrix`.
        """
        return self._bias(t, (q, u), out)

    def inverse_dynamics(
        self, q: Numbers, u: Numbers, a: Numbers, *, t: float | None = None, out: FloatArray | None = None
    ) -> FloatArray:
        """Return the generalized forces ``M a + h`` that give the accelerations a, those of constraints included.

        Parameters
        ----------
        q, u, a
            Coordinates, speeds, and the derivatives of the speeds.
        t, out
            See `mass_matrix`.
        """
        return self._inverse(t, (q, u, a), out)

    def constraint_jacobian(self, q: Numbers, *, t: float | None = None, out: FloatArray | None = None) -> FloatArray:
        """Return G, derivatives of the constraints' rates by the speeds, shape (constraints, speeds).

        Parameters
        ----------
        q
            Coordinates.
        t, out
            See `mass_matrix`.
        """
        return self._slopes(t, (q,), out)

    def constraint_bias(
        self, q: Numbers, u: Numbers, *, t: float | None = None, out: FloatArray | None = None
    ) -> FloatArray:
        """Return gamma, the constraints' second derivative without accelerations, shape (constraints,).

        Parameters
        ----------
        q, u
            Coordinates and speeds.
        t, out
            See `mass_matrix`.
        """
        return self._gamma(t, (q, u), out)

    def forward_dynamics(self, q: Numbers, u: Numbers, tau: Numbers = None, *, t: float | None = None) -> FloatArray:
        """Return the accelerations under generalized forces, constraints kept; shape (speeds,).

        Parameters
        ----------
        q, u
            Coordinates and speeds, which fulfil the constraints.
        tau
            Generalized forces along the speeds, on top of those of the scene; none if not given.
        t
            See `mass_matrix`.

        Raises
        ------
        SolveError
            If the forces do not determine the accelerations.
        """
        return self._solved(q, u, tau, t)[0]

    def multipliers(self, q: Numbers, u: Numbers, tau: Numbers = None, *, t: float | None = None) -> FloatArray:
        """Return the multipliers lambda of the constraints, whose generalized forces are ``G^T lambda``.

        Of constraints that follow from others, those that are left out have none.

        Parameters
        ----------
        q, u, tau, t
            See `forward_dynamics`.
        """
        return self._solved(q, u, tau, t)[1]

    def jacobian(self, path: str, q: Numbers, *, t: float | None = None, out: FloatArray | None = None) -> FloatArray:
        """Return the derivative of a velocity by the speeds.

        Parameters
        ----------
        path
            A quantity: of a position or an angle, such as ``"bob.position"`` or ``"rod.angle"``, it is the derivative
            of its rate; of a velocity, such as ``"body.angular_velocity"``, its own. A vector gives a row for each
            component that the scene has, in world axes.
        q
            Coordinates.
        t, out
            See `mass_matrix`.

        Returns
        -------
        ndarray
            Shape (speeds,) for a number, (components, speeds) for a vector; for many states with these in front.

        Raises
        ------
        UsageError
            If there is no such quantity, or it depends on accelerations or reactions.
        """
        path = check(NAME, path, "path", self._name)
        if path not in self._jacobians:
            entries, shape = velocity_jacobian(self.assembly, self.equations, path)
            self._jacobians[path] = self._function(f"jacobian of {path}", lambda: entries, "q", shape)
        return self._jacobians[path](t, (q,), out)

    # -- how they are made --------------------------------------------------------------------------------------------

    @property
    def _name(self) -> str:
        return self.assembly.flat.name

    def _function(
        self, name: str, expressions: Callable[[], Sequence[Expression]], inputs: str, shape: tuple[int, ...]
    ) -> Function:
        groups = {group.name: group for group in state_groups(self.equations)}
        groups["a"] = InputGroup("a", self.equations.accelerations)
        chosen = [groups[letter] for letter in ("t", *inputs)]
        return known_function(self.assembly, _PROGRAM, chosen, name, expressions, shape, self.assembly.form)

    @cached_property
    def _inverse(self) -> Function:
        return self._function("inverse dynamics", lambda: self.equations.rows, "qua", (len(self.equations.speeds),))

    @cached_property
    def _bias(self) -> Function:
        e = self.equations
        still = dict.fromkeys(e.accelerations, 0.0)
        return self._function("bias", lambda: substitute(list(e.rows), still), "qu", (len(e.speeds),))

    @cached_property
    def _entries(self) -> list[Expression] | None:
        """The mass matrix by rows; None where it is too long to be written out.

        Only entries on and below the diagonal are computed: the others are the same.
        """
        e, n = self.equations, len(self.equations.speeds)
        if is_too_long(e.rows, e.accelerations):
            return None
        found = jacobian(list(e.rows), list(e.accelerations))
        known = found.by_place
        return [known.get((max(i, j), min(i, j)), e.graph.zero) for i in range(n) for j in range(n)]

    @cached_property
    def _mass_moves(self) -> bool:
        entries = self._entries or []
        return any(depends_on(one, self.equations.speeds) for one in dict.fromkeys(entries) if not one.is_parametric)

    @cached_property
    def _mass(self) -> Function | None:
        entries, n = self._entries, len(self.equations.speeds)
        if entries is None:
            return None
        return self._function("mass matrix", lambda: entries, "qu" if self._mass_moves else "q", (n, n))

    @cached_property
    def _slopes(self) -> Function:
        e, shape = self.equations, (len(self.equations.constraints), len(self.equations.speeds))
        rates = [one.rate for one in e.constraints]
        return self._function("constraint Jacobian", lambda: jacobian_by_rows(rates, e.speeds), "q", shape)

    @cached_property
    def _gamma(self) -> Function:
        e = self.equations
        still = dict.fromkeys(e.accelerations, 0.0)
        seconds = [one.second for one in e.constraints]
        return self._function("constraint bias", lambda: substitute(seconds, still), "qu", (len(seconds),))

    @cached_property
    def _jacobians(self) -> dict[str, Function]:
        return {}

    # -- numbers ------------------------------------------------------------------------------------------------------

    def _mass_by_columns(self, q: Numbers, u: Numbers, t: float | None, out: FloatArray | None) -> FloatArray:
        """Return a mass matrix that is too long to be written out, column by column."""
        time, n = self._time(t), len(self.equations.speeds)
        states = np.atleast_2d(as_numbers(q, len(self.coordinates), "q", self._name))
        speeds = np.zeros((len(states), n)) if u is None else np.atleast_2d(as_numbers(u, n, "u", self._name))
        assembly = at_time(self.assembly, time)
        found = np.stack([mass_at(assembly, assembly.form, time, *one) for one in zip(states, speeds, strict=True)])
        result = found.reshape(*np.shape(q)[:-1], n, n)
        if out is not None:
            out[...] = result
            return out
        return result

    def _time(self, t: float | None) -> float:
        return self.assembly.flat.t_start if t is None else as_time(t, self._name)

    def _solved(self, q: Numbers, u: Numbers, tau: Numbers, t: float | None) -> tuple[FloatArray, FloatArray]:
        mass, right = self.mass_matrix(q, u=u, t=t), -self.bias(q, u, t=t)
        if tau is not None:
            right = right + as_numbers(tau, len(self.equations.speeds), "tau", self._name)
        if not self.equations.constraints:
            try:
                a = np.linalg.solve(mass, right[..., None])[..., 0]
            except np.linalg.LinAlgError:
                raise self._undetermined() from None
            if not np.all(np.isfinite(a)):
                raise self._undetermined()
            return np.asarray(a), np.zeros((*a.shape[:-1], 0))
        slopes, gamma = self.constraint_jacobian(q, t=t), self.constraint_bias(q, u, t=t)
        shape = right.shape[:-1]
        states = np.broadcast_to(np.asarray(q, dtype=float), (*shape, np.shape(q)[-1]))
        mass, slopes = (np.broadcast_to(one, (*shape, *one.shape[-2:])) for one in (mass, slopes))
        gamma = np.broadcast_to(gamma, (*shape, gamma.shape[-1]))
        a, multipliers = np.empty(right.shape), np.zeros(gamma.shape)
        for i in np.ndindex(*shape):
            a[i], multipliers[i] = self._held(states[i], mass[i], right[i], slopes[i], gamma[i], self._time(t))
        return a, multipliers

    def _held(
        self, q: FloatArray, mass: FloatArray, right: FloatArray, slopes: FloatArray, gamma: FloatArray, t: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return accelerations and multipliers of one state; of constraints that follow from others none are used."""
        form, nothing = self.assembly.form, np.zeros(len(gamma))
        sizes = motion_scales(self.equations, self._start.length)
        errors = balance_of(self.assembly, form).errors.of_jacobian(t, q, sizes)
        kept = np.asarray(independent_rows(slopes * sizes, errors), dtype=np.intp)
        now = BalanceValues(mass, -right, nothing, nothing, gamma, slopes, nothing)
        a, found = solve_balance(now, kept, t)
        multipliers = np.zeros(len(gamma))
        multipliers[kept] = found
        return a, multipliers

    def _undetermined(self) -> SolveError:
        return SolveError(
            "the forces do not determine the accelerations",
            where=self._name,
            advice="Something without mass is free to move, or the mechanism is in a singular position.",
        )


@takes(scene=SCENE, form=optional(FORM), orientation=optional(ORIENTATION))
def dynamics(scene: Model | Assembly, *, form: str | None = None, orientation: str | None = None) -> Dynamics:
    """Return the dynamics of a scene as functions of numbers, for control, optimisation and teaching.

    Mass matrix, bias, constraint Jacobian, inverse and forward dynamics, and Jacobians of quantities: compiled when
    they are first called, for one state or for many, for trees and for closed loops.

    Parameters
    ----------
    scene
        The scene, or an assembly of it; what contradicts that is refused.
    form, orientation
        See `atwood.assemble`.

    Returns
    -------
    Dynamics
        Its functions.
    """
    return Dynamics(smooth_assembly_of(scene, form=form, orientation=orientation))


def velocity_jacobian(assembly: Assembly, equations: Equations, path: str) -> tuple[list[Expression], tuple[int, ...]]:
    """Return the derivatives of a quantity's rate, or of a velocity, by the speeds, and the shape of what they make."""
    e, observables = equations, assembly.observables
    vector = [f"{path}.{axis}" for axis in "xyz" if f"{path}.{axis}" in observables]
    if path not in observables and not vector:
        known = sorted({one.rpartition(".")[0] if one[-2:] in (".x", ".y", ".z") else one for one in observables})
        raise UsageError("there is no such quantity", where=path, advice=suggestion_in_parts(path, known))
    values = [observables[one].value for one in ([path] if path in observables else vector)]
    others = [*e.accelerations, *(one.symbol for one in assembly.reactions)]
    if depends_on(values, others):
        raise UsageError(
            "it depends on accelerations or reactions, and has no derivative of motion",
            where=path,
            advice="Ask for a position, an angle or a velocity.",
        )
    if not depends_on(values, e.speeds):
        values = jvp(values, {e.time: 1.0, **dict(zip(e.coordinates, e.rates, strict=True))})
    entries = jacobian_by_rows(values, e.speeds)
    if depends_on(entries, e.speeds):
        raise UsageError("it is not linear in the speeds", where=path, advice="Ask for a position or a velocity.")
    shape = (len(e.speeds),)
    return entries, shape if path in observables else (len(vector), *shape)
