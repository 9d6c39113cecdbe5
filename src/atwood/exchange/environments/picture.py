"""A picture of a scene as it is in an environment now."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from numpy.typing import NDArray

from atwood.exchange.environments.plant import Motions
from atwood.exchange.environments.walks import Walks
from atwood.plotting.drawing import plot_mechanism


def picture_of(motions: Motions | Walks, which: int) -> NDArray[np.uint8]:
    """Return a picture of a motion, shape (height, width, 3)."""
    result, t = motions.picture_run(which), float(motions.time[which])
    canvas: Any = FigureCanvasAgg(plot_mechanism(result, times=[t]))
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()
