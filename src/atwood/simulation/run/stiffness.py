"""Whether a scene is stiff: whether something in it dies away far faster than anything else happens.

An explicit method must follow the fastest decay with its steps although nothing of it is left to be seen; an implicit
one steps over it. Fast vibrations that do not die away are not stiff in this sense: every method that is to give them
right must follow them.

Measured on masses with springs and dampers (both methods at the same true error): up to a ratio of about 300 between
the decay and the rest the explicit method of order 8(5,3) costs less than IDA. A mode that decays while it vibrates
fast costs IDA more, since only its order two stays stable beside the imaginary axis.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.errors import KernelEvaluationError
from atwood.expr import Expression, depends_on
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key
from atwood.integrators.protocol import Values
from atwood.lazy_dataclasses import dataclass

RATIO = 300.0
"""A decay that is so many times as fast as anything else is left to an implicit method."""

_GONE = 20.0
"""What decays so many times by e within the run is gone for most of it."""


@dataclass(frozen=True)
class Stiffness:
    """How stiff a scene is at a state.

    Attributes
    ----------
    decay
        Size of the eigenvalue of what dies away fastest, 1/s; zero if nothing does.
    ratio
        How many times as fast that is as anything else.
    limit
        The ratio from which on an implicit method costs less.
    """

    decay: float
    ratio: float
    limit: float

    @property
    def is_stiff(self) -> bool:
        """Whether an implicit method costs less."""
        return self.ratio > self.limit


_CAN_BE_STIFF: Key[bool] = Key("whether anything can be stiff")


def can_be_stiff(assembly: Assembly) -> bool:
    """Return whether anything can make motions die away: a Rayleigh function, or a load that reads velocities."""

    def find() -> bool:
        for local in assembly.mechanism.locals_.values():
            if local.dissipations:
                return True
            speeds: list[Expression] = []
            for one in local.connectors.values():
                speeds += [*one.velocity, *one.spin]
            speeds += local.signal_symbols.values()  # what it is linked to may be a velocity
            speeds += local.reads  # a reaction depends on velocities
            for load in local.loads:
                read = [*assembly.mechanism.space.components(load.force), *load.torque]
                if any(isinstance(one, Expression) and depends_on(one, speeds) for one in read):
                    return True
        return False

    return assembly.shared.get(_CAN_BE_STIFF, find)


def find_stiffness(
    rates: Callable[[float, FloatArray], Values],
    t: float,
    y: FloatArray,
    scale: FloatArray,
    time: float,
    span: float,
    relative_tolerance: float,
) -> Stiffness:
    """Return how stiff ``y' = f(t, y)``, ``y = (q, u)``, is at a state, from the eigenvalues of its Jacobian."""
    try:
        matrix = _jacobians(lambda rows: np.asarray([rates(t, rows[0])], dtype=float), y[None], scale[None])[0]
    except (KernelEvaluationError, ArithmeticError):
        return Stiffness(0.0, 0.0, RATIO)
    return _judged(matrix, time, span, relative_tolerance)


def present_time(
    rates: Callable[[float, FloatArray], Values],
    t: float,
    y: FloatArray,
    scale: FloatArray,
    coordinates: int,
    time: float,
    span: float,
) -> float:
    """Return the time in which something happens at a state, s, by how fast it changes."""
    try:
        changes = np.abs(np.asarray(rates(t, y), dtype=float)) / scale
    except (KernelEvaluationError, ArithmeticError):
        return time
    fastest = max(np.max(changes[:coordinates]), np.sqrt(np.max(changes[coordinates:], initial=0.0) / time))
    return min(span, 1.0 / float(fastest)) if fastest > 0.0 else span


def find_stiff_rows(
    rates: Callable[[FloatArray], FloatArray],
    y: FloatArray,
    scale: FloatArray,
    time: FloatArray,
    span: FloatArray,
    relative_tolerance: float,
) -> NDArray[np.bool_]:
    """Return which of many runs are stiff, as `find_stiffness` has it of one."""
    matrices = _jacobians(rates, y, scale)
    each = zip(matrices, time.tolist(), span.tolist(), strict=True)
    return np.array([_judged(*one, relative_tolerance).is_stiff for one in each], dtype=np.bool_)


def _judged(matrix: FloatArray, time: float, span: float, relative_tolerance: float) -> Stiffness:
    """Return how stiff a problem is by its Jacobian in units of its sizes."""
    if not np.isfinite(matrix).all():
        return Stiffness(0.0, 0.0, RATIO)
    try:
        values = np.linalg.eigvals(matrix)
    except np.linalg.LinAlgError:  # nothing is known of it; the explicit method tells by its steps where it is stiff
        return Stiffness(0.0, 0.0, RATIO)
    decays = (values.real < 0.0) & (np.abs(values.real) * span > _GONE)
    slow = max(1.0 / time, float(np.max(np.abs(values[~decays]), initial=0.0)))
    plain = decays & (np.abs(values.real) >= np.abs(values.imag))
    found = []
    # Beside the imaginary axis steps of order two remain, against those of order five.
    for chosen, limit in ((plain, RATIO), (decays, RATIO * relative_tolerance ** (-2.0 / 15.0))):
        fastest = float(np.max(np.abs(values[chosen]), initial=0.0))
        found.append(Stiffness(fastest, fastest / slow, limit))
    return next((one for one in found if one.is_stiff), found[0])


def _jacobians(rates: Callable[[FloatArray], FloatArray], y: FloatArray, scale: FloatArray) -> FloatArray:
    """Return the Jacobians of runs in units of their sizes, by differences; not finite where they have no value."""
    runs, count = y.shape
    matrix = np.empty((runs, count, count))
    with np.errstate(all="ignore"):
        here = rates(y)
        for j in range(count):
            moved = y.copy()
            moved[:, j] += 1e-7 * scale[:, j]
            step = moved[:, j] - y[:, j]
            matrix[:, :, j] = (rates(moved) - here) * (scale[:, j] / step)[:, None] / scale
    return matrix
