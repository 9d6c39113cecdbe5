"""A mode of oscillation as a motion of the mechanism, so that whatever draws runs can draw it."""

from __future__ import annotations

import numpy as np

from atwood.arrays import ComplexArray
from atwood.late import replace
from atwood.result.result import Result
from atwood.simulation.dynamics.balance import balance_of
from atwood.simulation.initialization.start import Start
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.run.run import run
from atwood.theory.linear.operating_point import OperatingPoint

__all__ = ["mode_motion"]


def mode_motion(
    point: OperatingPoint, shape: ComplexArray, angular_frequency: float, amplitude: float, frames: int
) -> Result:
    """Return one period of an oscillation about an operating point.

    Parameters
    ----------
    point
        The operating point.
    shape
        Complex amplitude of each displacement.
    angular_frequency
        rad/s; where it is zero a period takes one second.
    amplitude
        Of the largest displacement, relative to the scene's sizes.
    frames
        Number of times.
    """
    linear, balance = point.scene, balance_of(point.assembly, "reduced")
    period = 2.0 * np.pi / angular_frequency if angular_frequency else 1.0
    times = point.t + np.linspace(0.0, period, frames)
    size = float(np.max(np.abs(shape) / linear.displacement_sizes, initial=0.0)) or 1.0
    rows = []
    still = np.zeros(len(linear.sizes))
    for time in times:
        turned = shape * np.exp(2j * np.pi * (time - point.t) / period)
        q = linear.tangents.moved(point.q, turned.real * (amplitude / size))
        rows.append(balance.project(point.t, q, still, linear.sizes)[0])
    coordinates = np.array(rows).T
    start = Start(point.t, point.q, point.u, linear.length, (), (), (), point.q)
    options = RunOptions(t_end=point.t + 1e-6 * period, outputs=2, samples=1)
    begun = run(point.assembly, start, options, point.assembly.other_mode)
    first = begun.segments[0]
    segment = replace(
        first,
        time=times,
        coordinates=coordinates,
        speeds=np.gradient(coordinates, times, axis=1) if linear.equations.rates == linear.equations.speeds
        else np.zeros((len(still), frames)),
        shown=np.ones(frames, dtype=bool),
        held=np.zeros((2, frames)),
    )  # fmt: skip
    return Result(replace(begun, segments=(segment,)))
