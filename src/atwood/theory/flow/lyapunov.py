"""`lyapunov_exponents`: how fast neighbouring motions part in the long run."""

from __future__ import annotations

from typing import Any

import numpy as np

from atwood.arguments import check, command, number, optional, takes, whole
from atwood.arrays import FloatArray
from atwood.display import data_of, fitted
from atwood.errors import UsageError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE
from atwood.simulation.problem.arguments import RTOL, SOLVER, T_END
from atwood.theory.flow.tangent_flow import orthonormal_growth
from atwood.theory.flow.variational_equations import find_deviations

_BLOCKS = 10
"""The motion is cut into so many, to tell how much the exponents still scatter."""

_POINTS = 201


@dataclass(frozen=True, eq=False)
class LyapunovExponents:
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
