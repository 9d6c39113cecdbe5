"""A picture of a scene as it is in an environment now."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from numpy.typing import NDArray

from atwood.exchange.environments.plant import Motions
from atwood.plotting.drawing import plot_mechanism
from atwood.result.result import Result
from atwood.simulation.initialization.start import Start
from atwood.simulation.problem.options import RunOptions
from atwood.simulation.run.run import run

_SHARE = 1e-3
"""A picture is that of the beginning of a run, which takes so small a share of a period."""


def picture_of(motions: Motions, which: int) -> NDArray[np.uint8]:
    """Return a picture of a motion, shape (height, width, 3)."""
    assembly, t = motions.assembly(which), float(motions.time[which])
    q, u = motions.coordinates(which)
    start = Start(t, q, u, 1.0, (), (), (), q)
    result = Result(run(assembly, start, RunOptions(t + _SHARE * motions.period, outputs=2), assembly.other_mode))
    canvas: Any = FigureCanvasAgg(plot_mechanism(result, times=[t]))
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()
