"""Moving pictures: frames of a figure, and how they become a file."""

from __future__ import annotations

import importlib.util
import io
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from atwood.errors import UsageError
from atwood.plotting.canvas import ANIMATED, Figure, check_picture, titled

Frame: TypeAlias = NDArray[np.uint32]
"""Pixels as they lie in memory: red, green, blue, and 255."""

_DOTS = 80
"""Dots per inch."""


def check_moving(file: str | os.PathLike[str]) -> str:
    """Return the kind of a moving picture, or refuse one that could not be made, before the work is done."""
    check_picture(file, ANIMATED)
    kind = Path(file).suffix.lower()[1:]
    if kind == "mp4" and importlib.util.find_spec("imageio_ffmpeg") is None:
        raise UsageError(
            "films need imageio-ffmpeg, which is not installed",
            where=str(file),
            advice="pip install 'atwood[video]', or use .gif or .webp.",
        )
    return kind


def film(
    figure: Figure,
    draw: Callable[[int], None],
    moments: Sequence[int],
    titles: Sequence[str],
    rate: float,
    kind: str,
) -> bytes:
    """Return the content of a moving picture, as many frames in a second as `rate`."""
    return _KINDS[kind](_frames(figure, draw, moments, titles), rate)


def _frames(
    figure: Figure, draw: Callable[[int], None], moments: Sequence[int], titles: Sequence[str]
) -> Iterator[Frame]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure.set_layout_engine("none")
    title = titled(figure, max(titles, key=len))
    canvas = FigureCanvasAgg(figure)
    figure.dpi = _DOTS
    for moment, text in zip(moments, titles, strict=True):
        draw(moment)
        title.set_text(text)
        canvas.draw()  # type: ignore[no-untyped-call]
        pixels = canvas.buffer_rgba()  # type: ignore[no-untyped-call]
        yield np.array(pixels).view(np.uint32)[..., 0]


def _shown_until(rate: float, parts: int) -> Iterator[int]:
    """Return for how many parts of a second each frame is shown, whole ones that add up."""
    number, before = 0, 0
    while True:
        number += 1
        until = round(number * parts / rate)
        yield until - before
        before = until


def _images(frames: Iterator[Frame]) -> list[Any]:
    """Return frames as images of Pillow, without their alpha."""
    from PIL import Image

    return [Image.fromarray(frame.view(np.uint8).reshape(*frame.shape, 4)[..., :3].copy()) for frame in frames]


def _saved(images: list[Any], rate: float, kind: str, parts: int, **options: Any) -> bytes:
    """Return images as a file that is played again and again, with times in so many parts of a second."""
    shown = [1000 // parts * one for _, one in zip(images, _shown_until(rate, parts), strict=False)]
    stream = io.BytesIO()
    images[0].save(stream, kind, save_all=True, append_images=images[1:], duration=shown, loop=0, **options)
    return stream.getvalue()


def _gif(frames: Iterator[Frame], rate: float) -> bytes:
    """Return a GIF; each frame has the 255 colours that are nearest to its own."""
    from PIL.Image import Dither, Quantize

    made = [one.quantize(255, Quantize.MAXCOVERAGE, dither=Dither.NONE) for one in _images(frames)]
    return _saved(made, rate, "GIF", 100)


def _webp(frames: Iterator[Frame], rate: float) -> bytes:
    """Return a WebP, without loss."""
    return _saved(_images(frames), rate, "WEBP", 1000, lossless=True, quality=0, method=0)


def _mp4(frames: Iterator[Frame], rate: float) -> bytes:
    """Return a film in H.264, whose sides are even."""
    import imageio_ffmpeg

    with TemporaryDirectory() as folder:
        target, writer = Path(folder, "film.mp4"), None
        for frame in frames:
            even = np.pad(frame, [(0, side % 2) for side in frame.shape], mode="edge")
            if writer is None:
                style: dict[str, Any] = {"pix_fmt_in": "rgba", "quality": 8, "macro_block_size": 2}
                writer = imageio_ffmpeg.write_frames(str(target), even.shape[::-1], fps=rate, **style)
                writer.send(None)
            writer.send(np.ascontiguousarray(even))
        assert writer is not None
        writer.close()
        return target.read_bytes()


_KINDS: dict[str, Callable[[Iterator[Frame], float], bytes]] = {"gif": _gif, "webp": _webp, "mp4": _mp4}
