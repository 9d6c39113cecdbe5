"""Mode shapes: the mechanism displaced along a mode."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from atwood.arguments import FILE, instance, optional, takes, whole
from atwood.plotting.canvas import finished, titled
from atwood.plotting.drawing import plot_mechanism
from atwood.theory.linear import NormalModes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["plot_mode"]


@takes(
    modes=instance("NormalModes, as normal_modes returns them", NormalModes),
    mode=whole("the number of a mode", 0),
    file=optional(FILE),
)
def plot_mode(modes: NormalModes, mode: int = 0, file: str | os.PathLike[str] | None = None) -> Figure:
    """Draw the mechanism at both ends of a mode's swing and in the middle.

    Parameters
    ----------
    modes
        What `atwood.normal_modes` gave.
    mode
        Number of the mode.
    file
        Where to save the picture; `NormalModes.motion` gives what `atwood.animate` moves.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.
    """
    motion = modes.motion(mode)
    last = float(motion.time[-1] - motion.time[0])
    times = [float(motion.time[0]) + share * last for share in (0.5, 0.25, 0.0)]
    figure = plot_mechanism(motion, times=sorted(times))
    omega, growth = modes.angular_frequencies[mode], modes.growth_rates[mode]
    said = f"{modes.scene}, mode {mode}: {omega:.5g} rad/s" + (f", growth {growth:.4g} 1/s" if growth else "")
    titled(figure, said, fontweight="bold")
    return finished(figure, file)
