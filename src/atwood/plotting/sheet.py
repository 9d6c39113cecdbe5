"""Where pictures are drawn, one in the place of another."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from atwood.arrays import FloatArray

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes


class Sheet:
    """Axes to draw on.

    Parameters
    ----------
    axes
        The axes.
    """

    def __init__(self, axes: Axes) -> None:
        self.axes = axes
        self._made: list[Artist] = []

    def again(self) -> None:
        """Begin another picture in the place of this one."""
        for one in self._made:
            one.remove()
        self._made.clear()

    def line(self, points: FloatArray, **style: Any) -> None:
        """Draw a line."""
        from matplotlib.lines import Line2D

        self._add(Line2D(*points.T, **style))

    def circle(self, center: FloatArray, radius: float, **style: Any) -> None:
        """Draw a disc."""
        from matplotlib.patches import Circle

        self._add(Circle((center[0], center[1]), radius, **style))

    def polygon(self, corners: FloatArray, **style: Any) -> None:
        """Draw a surface with straight borders."""
        from matplotlib.patches import Polygon

        self._add(Polygon(corners, **style))

    def polygons(self, corners: Sequence[FloatArray], facecolors: Any, edgecolors: Any, **style: Any) -> None:
        """Draw many surfaces, the first one at the back; colours are one of each, or one of all."""
        from matplotlib.collections import PolyCollection

        start = 0
        for _, run in groupby(corners, len):  # as arrays, which is much faster
            shapes = np.array(list(run))
            one = slice(start, start + len(shapes))
            tones = {"facecolors": facecolors, "edgecolors": edgecolors}
            mine = {key: tone[one] if len(tone) == len(corners) else tone for key, tone in tones.items()}
            if len(shapes) == 1:  # one path of one colour would be drawn as a marker, moved to whole pixels
                mine = {key: [*tone, *tone] for key, tone in mine.items()}
            self._add(PolyCollection(list(shapes), **mine, **style))
            start = one.stop

    def lines(self, points: FloatArray, colors: Any, linewidths: Any, **style: Any) -> None:
        """Draw many lines of as many points each, shape (lines, points, 2)."""
        from matplotlib.collections import LineCollection

        self._add(LineCollection(list(points), colors=colors, linewidths=linewidths, **style))

    def text(self, place: FloatArray, text: str, **style: Any) -> None:
        """Write a text about a place."""
        from matplotlib.text import Text

        self._add(Text(place[0], place[1], text, **style, clip_on=False))

    def _add(self, artist: Artist) -> None:
        self.axes.add_artist(artist)
        self._made.append(artist)
