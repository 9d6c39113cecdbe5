"""Where pictures are drawn: what is drawn again is moved, and not made anew."""

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

    The first picture makes artists. After `again` each of them takes what comes in its turn, as long as it is of the
    same kind and style; from the first that is not, artists are made anew, so that they lie over one another in the
    order in which they were drawn.

    Parameters
    ----------
    axes
        The axes.
    """

    def __init__(self, axes: Axes) -> None:
        self.axes = axes
        self._made: list[tuple[type[Artist], dict[str, Any], dict[str, Any], Artist]] = []
        self._next = 0

    def again(self) -> None:
        """Begin another picture in the place of this one."""
        self._drop()
        self._next = 0

    def line(self, points: FloatArray, **style: Any) -> None:
        """Draw a line."""
        from matplotlib.lines import Line2D

        self._put(Line2D, ([], []), {"data": points.T}, style)

    def circle(self, center: FloatArray, radius: float, **style: Any) -> None:
        """Draw a disc."""
        from matplotlib.patches import Circle

        self._put(Circle, ((0.0, 0.0),), {"center": center, "radius": radius}, style)

    def polygon(self, corners: FloatArray, **style: Any) -> None:
        """Draw a surface with straight borders."""
        from matplotlib.patches import Polygon

        self._put(Polygon, ([(0.0, 0.0)],), {"xy": corners}, style)

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
            self._put(PolyCollection, ([],), {"verts": shapes, **mine}, style)
            start = one.stop

    def lines(self, points: FloatArray, colors: Any, linewidths: Any, **style: Any) -> None:
        """Draw many lines of as many points each, shape (lines, points, 2)."""
        from matplotlib.collections import LineCollection

        moved = {"segments": points, "colors": colors, "linewidths": linewidths}
        self._put(LineCollection, ([],), moved, style)

    def text(self, place: FloatArray, text: str, **style: Any) -> None:
        """Write a text about a place."""
        from matplotlib.text import Text

        self._put(Text, (), {"position": place, "text": text}, {**style, "clip_on": False})

    def _put(self, kind: type[Artist], blank: tuple[Any, ...], data: dict[str, Any], style: dict[str, Any]) -> None:
        if self._next < len(self._made):
            known, look, before, artist = self._made[self._next]
            if known is kind and look == style:
                changed = {key: one for key, one in data.items() if not np.array_equal(one, before[key])}
                if changed:
                    artist.set(**changed)
                self._made[self._next] = (kind, style, data, artist)
                self._next += 1
                return
            self._drop()
        artist = kind(*blank, **style)
        artist.set(**data)
        self.axes.add_artist(artist)
        self._made.append((kind, style, data, artist))
        self._next += 1

    def _drop(self) -> None:
        """Take away what this picture has not drawn."""
        for *_, artist in self._made[self._next :]:
            artist.remove()
        del self._made[self._next :]
