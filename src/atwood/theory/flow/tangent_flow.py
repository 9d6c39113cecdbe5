"""How all neighbours of a motion move: growth of volumes of phase space, and Lyapunov exponents.

The volume element of a scene with mass matrix M whose deviations meet holonomic constraints is, in displacements s and
speeds u, ``det(T^T M T) ds du`` with T a basis of the directions that the constraints leave free: Liouville's measure
``dq dp`` in minimal coordinates, whichever these are (Arnold, Mathematical Methods of Classical Mechanics, sections 16
and 38). In bases that are orthonormal with respect to M it is the plain volume.
"""

from __future__ import annotations

from dataclasses import field
from functools import cached_property
from typing import Any

import numpy as np

from atwood.arguments import check, command, number, optional, takes, whole
from atwood.arrays import FloatArray
from atwood.display import data_of, fitted
from atwood.errors import UsageError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import Model
from atwood.numerics.matrices import least_norm
from atwood.numerics.rank import null_space
from atwood.pipeline import SCENE
from atwood.result.result import Result
from atwood.simulation.problem.arguments import OUTPUTS, RTOL, SOLVER, T_END
from atwood.theory.flow.variational_equations import Deviations, VariationalEquations, find_deviations
from atwood.theory.formulas.described import Described


@dataclass(frozen=True, eq=False)
class TangentFlow(Described):
    """The derivative of the state at output times by the state at the start.

    Attributes
    ----------
    result
        The motion at the same times.
    time
        Output times, s.
    matrices
        The derivatives, shape (times, rows, columns). Rows are displacements and speeds, columns independent ones of
        the start: all of them where no constraint is left.
    names, units
        Of the rows: the path of a coordinate, or of a small rotation of a body in its axes, such as
        ``body.rotation.x``; then those of speeds.
    start_names
        Of the columns.
    """

    result: Result
    time: FloatArray
    matrices: FloatArray
    names: tuple[str, ...]
    units: tuple[str, ...]
    start_names: tuple[str, ...]
    deviations: Deviations = field(repr=False)

    @cached_property
    def growth(self) -> FloatArray:
        """By how much the smallest sphere that holds all small errors of the start has grown, shape (times,).

        Errors of lengths are compared with the extent of the scene, those of angles with 1 rad, and those of speeds
        with these times the pace at which things happen along the motion.
        """
        sizes = self.deviations.sizes
        start = np.linalg.qr(self.deviations.start / sizes[:, None])[1]
        scaled = self.matrices / sizes[:, None] @ np.linalg.inv(start)
        return np.asarray(np.linalg.norm(scaled, ord=2, axis=(1, 2)))

    @cached_property
    def volume(self) -> FloatArray:
        """By how much a small volume of phase space has grown, shape (times,): 1 without dissipation (Liouville).

        Phase space is that of coordinates and their momenta; with closed loops that of the independent ones.

        Raises
        ------
        UsageError
            If there is no such volume: where a velocity is no derivative of a coordinate, as in rolling, or something
            without mass moves.
        """
        equations = self.deviations.equations()
        scene = self.deviations.scene
        pairs = equations.matrix[:, : len(scene.tangents), len(scene.tangents) :]
        square = pairs.shape[1] == pairs.shape[2] and equations.by_displacement.shape == equations.rate_by_speed.shape
        if not square or not np.allclose(pairs, np.eye(pairs.shape[2]), rtol=0.0, atol=1e-9):
            raise UsageError(
                "it has no momenta that belong to coordinates, so that its phase space has no volume",
                where=self.result.assembly.flat.name,
                advice="Rolling, and parts with states of their own, are such.",
            )
        try:
            steps = log_volumes(equations, self.deviations.propagators, scene.sizes)
        except np.linalg.LinAlgError:
            raise UsageError(
                "something without mass moves in it, so that its phase space has no volume",
                where=self.result.assembly.flat.name,
                advice="Give it a mass.",
            ) from None
        total = np.concatenate([[0.0], np.cumsum(steps)])
        return np.asarray(np.exp(total[np.searchsorted(self.deviations.edges, self.time)]))

    @property
    def density(self) -> FloatArray:
        """By how much the density of a cloud of states has grown around this one, shape (times,)."""
        return 1.0 / self.volume

    def horizon(self, error: float, limit: float = 1.0) -> float:
        """Return the time until which the motion can be told from a start with an error, s.

        Parameters
        ----------
        error
            Of the start, relative to the scene's sizes; see `growth`.
        limit
            Up to which error, relative to the same sizes.

        Returns
        -------
        float
            s; infinite if the error stays below the limit to the end.
        """
        beyond = np.nonzero(self.growth * error >= limit)[0]
        return float(self.time[beyond[0]]) if len(beyond) else np.inf

    def __repr__(self) -> str:
        name, growth = self.result.assembly.flat.name, float(np.max(self.growth))
        shape = f"{len(self.names)} deviations by {len(self.start_names)} of the start"
        times = f"{len(self.time)} times to {self.time[-1]:g} s"
        return fitted(f"<TangentFlow of {name}: {shape}, {times}, growth up to {growth:.3g}>")


@takes(scene=SCENE, t_end=T_END, outputs=OUTPUTS, rtol=RTOL, solver=SOLVER)
def tangent_flow(
    scene: Model | Assembly,
    *,
    t_end: float | str | None = None,
    outputs: Any = 201,
    rtol: float = 1e-10,
    solver: str = "auto",
) -> TangentFlow:
    """Return how all neighbours of a motion move: the solution of its variational equations.

    The variational equations ``dz' = A(t) dz`` along the motion come from derivatives of the expression graph; no
    differences are taken. They are solved by Gauss's collocation of order 12 in steps of their own, along the motion
    that the solver gives (Hairer, Norsett and Wanner, Solving ODEs I, section I.14).

    Parameters
    ----------
    scene
        The scene, or an assembly of its reduced form. Closed loops and rolling are taken; events that change the
        state or the mode are not.
    t_end, outputs, solver
        See `atwood.simulate`.
    rtol
        Relative tolerance of the motion and of each step of the variational equations.

    Returns
    -------
    TangentFlow
        The derivatives, and what they do to errors, volumes and densities.

    Raises
    ------
    UsageError
        If the motion jumps on its way.
    SolveError
        If it does not get to its end, or neighbours move too fast.
    """
    options = {"t_end": t_end, "rtol": rtol, "solver": solver}
    found = find_deviations(scene, outputs, rtol, options)
    result, linear, minimal = found.motion.result, found.scene, found.minimal
    count = len(linear.tangents)
    names = (*linear.tangents.names, *(one.name for one in linear.equations.speed_names))
    units = (*linear.tangents.units, *(one.unit for one in linear.equations.speed_names))
    chosen = [*minimal.displacements, *(count + k for k in minimal.speeds)]
    return TangentFlow(
        result=result,
        time=result.time,
        matrices=_products(found, result.time),
        names=names,
        units=units,
        start_names=tuple(names[k] for k in chosen),
        deviations=found,
    )


def _products(found: Deviations, times: FloatArray) -> FloatArray:
    """Return the derivatives at output times from those of the steps between them."""
    present = found.start
    at = np.searchsorted(found.edges, times)
    matrices = np.empty((len(times), *present.shape))
    done = 0
    with np.errstate(over="ignore", invalid="ignore"):
        for k, number in enumerate(at):
            for step in found.propagators[done:number]:
                present = step @ present
            done = number
            matrices[k] = present
    if not np.all(np.isfinite(matrices)):
        raise UsageError(
            "neighbouring motions part by more than numbers can say",
            where=found.motion.assembly.flat.name,
            advice="Let the motion end before, or ask for `lyapunov_exponents`.",
        )
    return matrices


def log_volumes(equations: VariationalEquations, propagators: FloatArray, sizes: FloatArray) -> FloatArray:
    """Return the logarithm of the factor by which each step changes volumes of phase space, shape (steps,)."""
    into, back = _free_deviations(equations, sizes)
    return np.asarray(np.linalg.slogdet(back[1:] @ propagators @ into[:-1])[1])


def _free_deviations(equations: VariationalEquations, sizes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return bases of the deviations that meet the constraints, as columns, and their left inverses.

    With T orthonormal with respect to M, they are ``ds = T x`` and ``du = T y - G^+ d(G u)/ds T x``.
    """
    jacobian, mass = equations.by_displacement, equations.mass
    count, rows, n = jacobian.shape
    free = n - rows
    basis = np.broadcast_to(np.diag(sizes), mass.shape)
    if rows:
        scaled = jacobian * sizes
        basis = null_space(scaled / np.linalg.norm(scaled, axis=2, keepdims=True), rank=rows) * sizes[:, None]
    triangle = np.linalg.cholesky(np.swapaxes(basis, 1, 2) @ mass @ basis)
    across = np.linalg.solve(triangle, np.swapaxes(basis, 1, 2))
    into, back = np.zeros((count, 2 * n, 2 * free)), np.zeros((count, 2 * free, 2 * n))
    for one, other in ((slice(n), slice(free)), (slice(n, None), slice(free, None))):
        into[:, one, other], back[:, other, one] = np.swapaxes(across, 1, 2), across @ mass
    if rows:
        follow = least_norm(equations.rate_by_speed * sizes, equations.rate_by_displacement)
        into[:, n:, :free] = -(follow * sizes[:, None]) @ into[:, :n, :free]
    return into, back


def orthonormal_growth(propagators: FloatArray, basis: FloatArray) -> FloatArray:
    """Return the logarithms by which the axes of a volume grow in each step, shape (steps, columns).

    The volume is spanned anew by orthonormal vectors after each step (Benettin, Galgani, Giorgilli and Strelcyn,
    Meccanica 15, 1980).
    """
    frame = np.linalg.qr(basis)[0]
    found = np.empty((len(propagators), basis.shape[1]))
    with np.errstate(divide="ignore"):
        for k, step in enumerate(propagators):
            frame, triangle = np.linalg.qr(step @ frame)
            found[k] = np.log(np.abs(np.diagonal(triangle)))
    return found


_BLOCKS = 10
"""The motion is cut into so many, to tell how much the exponents still scatter."""

_POINTS = 201


@dataclass(frozen=True, eq=False)
class LyapunovExponents(Described):
    """The Lyapunov exponents of a motion, found over a finite time.

    Attributes
    ----------
    exponents
        1/s, largest first.
    errors
        The standard error of each by what a tenth of the motion after another says, 1/s. It says how much the
        exponents scatter, not how far a transient at the start has moved them.
    time
        Times along the motion, s, from `settle` on.
    running
        What the exponents are if the motion ends there, shape (times, exponents).
    rtol
        Relative tolerance of the motion.
    scene
        Name of the scene.
    """

    exponents: FloatArray
    errors: FloatArray
    time: FloatArray
    running: FloatArray
    rtol: float
    scene: str

    @property
    def is_chaotic(self) -> bool:
        """Whether the largest exponent is positive by more than three of its standard errors."""
        return bool(self.exponents[0] > 3.0 * self.errors[0])

    def horizon(self, error: float | None = None, limit: float = 1.0) -> float:
        """Return the time after which an error of the start has grown to a limit, at the rate of the largest exponent.

        Parameters
        ----------
        error
            Of the start, relative to the scene's sizes; the tolerance of the motion if not given.
        limit
            Up to which error.

        Returns
        -------
        float
            s; infinite where errors do not grow.
        """
        given = self.rtol if error is None else check(number(above=0.0), error, "error", "horizon")
        rate = float(self.exponents[0])
        return max(0.0, float(np.log(limit / given))) / rate if rate > 0.0 else np.inf

    def to_data(self) -> dict[str, Any]:
        """Return them as plain data, for JSON."""
        return data_of(self, "scene", "exponents", "errors", "time", "running", "rtol")

    def __repr__(self) -> str:
        pairs = zip(self.exponents, self.errors, strict=True)
        values = ", ".join(f"{one:.4g} +- {error:.1g}" for one, error in pairs)
        return fitted(f"<LyapunovExponents of {self.scene} over {self.time[-1]:g} s: {values} 1/s>")


@command("lyapunov")
@takes(
    scene=SCENE,
    t_end=T_END,
    count=optional(whole("a number of exponents, at most 10,000", 1, 10_000)),
    settle=T_END,
    rtol=RTOL,
    solver=SOLVER,
)
def lyapunov_exponents(
    scene: Model | Assembly,
    *,
    t_end: float | str | None = None,
    count: int | None = None,
    settle: float | str | None = None,
    rtol: float = 1e-10,
    solver: str = "auto",
) -> LyapunovExponents:
    """Return how fast neighbouring motions part in the long run.

    Volumes of one, two, ... dimensions are carried along the motion by its variational equations (see `tangent_flow`)
    and are spanned anew after each step (Benettin et al., Meccanica 15, 1980). Of a motion with closed loops, only
    deviations that meet the constraints are carried.

    Parameters
    ----------
    scene
        The scene, or an assembly of its reduced form.
    t_end, solver
        See `atwood.simulate`; the longer, the nearer to the limit.
    count
        How many exponents, the largest; all if not given.
    settle
        Time at the start that is not counted, s, in which deviations turn into the directions that grow; a tenth of
        the motion if not given.
    rtol
        Relative tolerance of the motion and of each step of the variational equations.

    Returns
    -------
    LyapunovExponents
        The exponents and how they settle, and the horizon of predictability.

    Raises
    ------
    UsageError
        If the motion jumps on its way, or there are not so many exponents.
    SolveError
        If it does not get to its end.
    """
    found = find_deviations(scene, 2, rtol, {"t_end": t_end, "rtol": rtol, "solver": solver})
    edges, sizes, where = found.edges, found.sizes, found.motion.assembly.flat.name
    begin, end = float(edges[0]), float(edges[-1])
    begun = begin + (0.1 * (end - begin) if settle is None else float(settle))
    if begun < begin:
        raise UsageError(f"settle cannot be {settle}", where=where, advice="Give a time of at least zero, in seconds.")
    if not begun < end:
        raise UsageError(f"after {settle} s nothing is left to be counted", where=where, advice="Give a later t_end.")
    start = found.start / sizes[:, None]
    if count is not None and count > start.shape[1]:
        advice = f"It has {start.shape[1]}."
        raise UsageError(f"there are no {count} Lyapunov exponents", where=where, advice=advice)
    # Directions without preference: those that grow are found from nearly any.
    turned = start @ np.linalg.qr(np.random.default_rng(1892).normal(size=(start.shape[1],) * 2))[0]
    logs = orthonormal_growth(found.propagators / sizes[:, None] * sizes, turned[:, :count])
    counted = edges[1:] > begun
    first = int(np.argmax(counted))
    since, total = edges[first], np.cumsum(logs[first:], axis=0)
    times = np.append(since, edges[first + 1 :])
    sums = np.vstack([np.zeros(total.shape[1]), total])
    running = total / (times[1:] - since)[:, None]
    order = np.argsort(-running[-1], kind="stable")
    cuts = np.linspace(since, end, _BLOCKS + 1)
    parts = np.stack([np.diff(np.interp(cuts, times, one)) / np.diff(cuts) for one in sums.T], axis=1)
    shown = np.unique(np.linspace(0, len(total) - 1, _POINTS).round().astype(int))
    return LyapunovExponents(
        exponents=running[-1, order],
        errors=np.std(parts, axis=0, ddof=1)[order] / np.sqrt(_BLOCKS),
        time=times[1:][shown],
        running=running[shown][:, order],
        rtol=rtol,
        scene=where,
    )
