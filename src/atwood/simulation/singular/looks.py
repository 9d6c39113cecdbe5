"""Looks at the motion of a mechanism with loops: what one is, when they are taken, and what lies between two.

While IDA goes on by itself they are taken by compiled functions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from atwood.arrays import FloatArray
from atwood.forms.kept import Key
from atwood.integrators.compiled_functions import Lookout
from atwood.simulation.problem.problem import Plan

if TYPE_CHECKING:
    from atwood.codegen.sundials.lookout import LookoutCode, LookoutData
from atwood.lazy_dataclasses import dataclass

_LOOKOUT: Key[LookoutCode] = Key("machine code of the singularity monitor")

_MOVE = 0.3
"""Between two looks nothing moves by more of its size; an angle by so many radians."""

_SHARE = 0.01
"""What rests is looked at after this share of a run: it may be set in motion."""

_LOW = 0.35
"""Only where less than this share of the most that it has been is left of a constraint, beside those before it, is
anything done in Python. At a singular position nothing is left of one, and a look before it at most `_MOVE`."""

_WORN = 0.5
"""Which of redundant constraints are kept is asked again where less than this share of what it was is left of one."""

_LARGEST = 600
"""With more constraints they are looked at in Python, which knows where their slopes have no entries."""


@dataclass(frozen=True, eq=False)
class Look:
    """A state on the way: time, unknowns and their rates."""

    t: float
    y: FloatArray
    yp: FloatArray


def stride_from(plan: Plan, look: Look, whole: float) -> float:
    """Return the time in which something moves as far as it may until the next look; never beyond the end."""
    speeds = slice(plan.program.coordinates, plan.program.coordinates + len(plan.sizes))
    speed, pull = (float(np.max(np.abs(one[speeds]) / plan.sizes)) for one in (look.y, look.yp))
    if not np.isfinite(speed + pull):
        return _SHARE * whole
    # the root of pull/2 h^2 + speed h = move, without cancellation
    below = speed + np.sqrt(speed * speed + 2.0 * pull * _MOVE)
    stride = 2.0 * _MOVE / below if below > 0.0 else np.inf
    return stride if stride < whole else _SHARE * whole


def cubic(s: FloatArray, ends: tuple[FloatArray, FloatArray], slopes: tuple[FloatArray, FloatArray]) -> FloatArray:
    """Return the cubic through two states with their rates, at shares of the way from one to the other."""
    (a, b), (v, w) = ends, slopes
    found: FloatArray = a + s * v + s**2 * (3.0 * (b - a) - 2.0 * v - w) + s**3 * (2.0 * (a - b) + v + w)
    return found


def going_on(plan: Plan, look: Look, times: FloatArray) -> FloatArray:
    """Predict coordinates and speeds at times near a look from the accelerations there, shape (number, times)."""
    n, m = plan.program.coordinates, len(plan.sizes)
    later = np.asarray(times) - look.t
    u = look.y[n : n + m, None] + look.yp[n : n + m, None] * later
    middle = look.y[n : n + m, None] + 0.5 * look.yp[n : n + m, None] * later
    q = np.repeat(look.y[:n, None], len(later), axis=1)
    moved = plan.balance.kinematic_map.moved_each(np.full(len(later), look.t), q, middle * later)
    return np.concatenate([moved, u])


def compiled_looks(plan: Plan, whole: float, size: int) -> LookoutData | None:
    """Return what looks at a motion by itself, for one run; None where nothing can be compiled."""
    held, assembly = plan.balance.program, plan.assembly
    if plan.not_compilable or held.constraints > _LARGEST:
        return None
    from atwood.codegen.sundials.lookout import Pace, compile_lookout

    places = held.jacobian_rows, held.jacobian_columns
    code = assembly.shared.get(
        _LOOKOUT,
        lambda: compile_lookout(held.constraints_alone, held.speeds, size, places),
        assembly.form,
        size,
    )
    pace = Pace(_MOVE, whole, _SHARE * whole, _LOW, _WORN if plan.finding.redundant else 0.0)
    return code.bind(assembly.parameter_values, plan.sizes, plan.finding.kept, pace)


def as_lookout(data: LookoutData) -> Lookout:
    """Return what a session is given to look with."""
    from atwood.codegen.sundials.lookout_routines import NOTICED, PAUSED

    code = data.code
    return Lookout(code.drive, code.fill, NOTICED, PAUSED, data.address, data.due, data.due_at, code.look_address, data)
