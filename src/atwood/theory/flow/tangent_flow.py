"""`tangent_flow`: how all neighbours of a motion move, and how volumes of phase space grow.

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

from atwood.arguments import takes
from atwood.arrays import FloatArray
from atwood.display import fitted
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


@dataclass(frozen=True, eq=False)
class TangentFlow:
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
