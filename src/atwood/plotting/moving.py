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

_DOTS, _EXACT = 80, 96
"""Dots per inch, and how many of the commonest colours of a GIF's frame with more than 255 stay what they are."""


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


def _shown_until(rate: float, parts: float) -> Iterator[int]:
    """Return for how many parts of a second each frame is shown, whole ones that add up."""
    number, before = 0, 0
    while True:
        number += 1
        until = round(number * parts / rate)
        yield until - before
        before = until


def _gif(frames: Iterator[Frame], rate: float) -> bytes:
    """Return a GIF; of each frame but the first it holds what has changed."""
    from PIL import GifImagePlugin, Image

    made: list[bytes] = []
    place_of = np.zeros(1 << 24, dtype=np.uint8)  # of a colour in the palette
    before: Frame | None = None
    for frame, hundredths in zip(frames, _shown_until(rate, 100.0), strict=False):
        if before is None:
            height, width = frame.shape
            size = width.to_bytes(2, "little") + height.to_bytes(2, "little")
            made += [b"GIF89a", size, b"\0\0\0", b"!\xff\x0bNETSCAPE2.0\x03\x01\0\0\0"]  # played again and again
        changed = np.ones(frame.shape, dtype=bool) if before is None else frame != before
        rows, columns = (np.flatnonzero(changed.any(axis=axis)) for axis in (1, 0))
        top, left = (int(one[0]) if one.size else 0 for one in (rows, columns))
        box = np.s_[top : rows[-1] + 1 if rows.size else 1, left : columns[-1] + 1 if columns.size else 1]
        colours = frame[box][changed[box]].astype("<u4") & 0xFFFFFF
        palette = _choose_palette(colours, place_of)
        index = np.full(changed[box].shape, len(palette), dtype=np.uint8)  # after the last colour: as it was
        index[changed[box]] = place_of[colours]
        image = Image.fromarray(index)
        image.putpalette(np.concatenate([palette, np.zeros((1, 3), np.uint8)]).tobytes())
        style: dict[str, Any] = {"transparency": len(palette), "disposal": 1, "include_color_table": True}
        made += GifImagePlugin.getdata(image, (left, top), duration=10 * hundredths, **style)
        before = frame
    return b"".join([*made, b";"])


def _choose_palette(colours: Frame, place_of: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return at most 255 colours for those of a picture, and put down which of them stands for each."""
    seen, counts = np.unique(colours, return_counts=True)
    plain = np.stack([seen & 255, seen >> 8 & 255, seen >> 16], axis=1).astype(np.uint8)
    if len(seen) <= 255:
        place_of[seen] = np.arange(len(seen))
        return plain
    # The commonest ones, such as the ground, are met exactly; the many shades of borders are put together in cells.
    order = np.argsort(-counts, kind="stable")
    common, rest = order[:_EXACT], order[_EXACT:]
    for size in (2, 4, 8, 16, 32, 64):
        cells, cell = np.unique(plain[rest] // size @ (1, 1 << 8, 1 << 16), return_inverse=True)
        if len(cells) <= 255 - _EXACT:
            break
    weights = counts[rest] / np.bincount(cell, counts[rest])[cell]
    means = [np.bincount(cell, weights * plain[rest, channel]) for channel in range(3)]
    place_of[seen[common]] = np.arange(_EXACT)
    place_of[seen[rest]] = _EXACT + cell
    return np.concatenate([plain[common], np.round(means).astype(np.uint8).T])


def _webp(frames: Iterator[Frame], rate: float) -> bytes:
    """Return a WebP, without loss."""
    from PIL import Image

    images = [Image.fromarray(frame.view(np.uint8).reshape(*frame.shape, 4)[..., :3].copy()) for frame in frames]
    shown = [milliseconds for _, milliseconds in zip(images, _shown_until(rate, 1000.0), strict=False)]
    stream = io.BytesIO()
    options: dict[str, Any] = {"save_all": True, "append_images": images[1:], "duration": shown, "loop": 0}
    images[0].save(stream, "WEBP", lossless=True, quality=0, method=0, **options)
    return stream.getvalue()


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
