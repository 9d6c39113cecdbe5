"""Figures that notebooks show by themselves, and animations that play there."""

from __future__ import annotations

import base64
import io
from pathlib import Path

from matplotlib.figure import Figure

from atwood.lazy_dataclasses import dataclass


class ShownFigure(Figure):
    """A figure that belongs to no window, and that a notebook shows as what a cell returns, without any setting."""

    def _repr_png_(self) -> bytes:
        stream = io.BytesIO()
        self.savefig(stream, format="png", dpi=110)
        return stream.getvalue()


@dataclass(frozen=True, eq=False)
class Animation:
    """A motion as a moving picture; a notebook plays it.

    Attributes
    ----------
    content
        What a file of it holds.
    kind
        ``"gif"``, ``"webp"`` or ``"mp4"``.
    file
        Where it was saved; None if it was not.
    """

    content: bytes
    kind: str = "gif"
    file: Path | None = None

    def __fspath__(self) -> str:
        if self.file is None:
            raise TypeError("this animation was not saved: give animate a file")
        return str(self.file)

    def __repr__(self) -> str:
        return f"<Animation of {len(self.content) / 1000.0:.0f} kB{f', {self.file}' if self.file else ''}>"

    def _repr_html_(self) -> str:
        data = base64.b64encode(self.content).decode()
        if self.kind == "mp4":
            return f'<video autoplay loop muted controls src="data:video/mp4;base64,{data}"></video>'
        return f'<img alt="animation" src="data:image/{self.kind};base64,{data}">'
