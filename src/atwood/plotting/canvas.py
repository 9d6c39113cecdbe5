"""Figures: how they look, and how they reach a file."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from atwood.arrays import FloatArray
from atwood.errors import UsageError
from atwood.files import check_target, write_atomically

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes
    from matplotlib.figure import Figure as Figure
    from matplotlib.text import Text
else:  # matplotlib is imported where a picture is drawn; what a signature says needs none of it
    Axes = Figure = Any

COLOURS = ("#2a6fbb", "#d1495b", "#2e9e6b", "#c98a1b", "#7b5ea7", "#3aa6b9", "#8a6d5a", "#d46ba3")
"""Told apart by most readers, and in print."""

INK, GREY = "#22303c", "#8d99a6"

STEEL, SHADE, PALE, ROPE = "#c8d3de", "#b4c2cf", "#e7ecf1", "#a8642a"
"""Bodies and their marked faces, wheels, ropes."""

SUFFIXES = (".png", ".svg", ".pdf")

ANIMATED = (".gif", ".webp", ".mp4")


def check_picture(file: str | os.PathLike[str], suffixes: tuple[str, ...] = SUFFIXES) -> None:
    """Refuse a picture that could not be made, before the work is done."""
    need_matplotlib()
    check_target(Path(file), suffixes)


def need_matplotlib() -> None:
    """Refuse a picture where matplotlib is missing."""
    try:
        found = importlib.util.find_spec("matplotlib") is not None
    except ValueError:  # it stands in the table of modules as missing
        found = False
    if not found:
        raise UsageError("pictures need matplotlib, which is not installed", advice="pip install 'atwood[plot]'")


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure that belongs to no window, and that notebooks show."""
    need_matplotlib()
    from atwood.plotting.figure import ShownFigure

    return ShownFigure(figsize=(width, height), layout="constrained", facecolor="white")


def polish(axes: Axes, x_label: str = "", y_label: str = "") -> None:
    """Give axes a quiet frame and their labels."""
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(GREY)
    axes.tick_params(colors=INK, labelsize=9, length=3, color=GREY)
    axes.grid(True, color="#e6eaee", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.set_xlabel(x_label, color=INK, fontsize=10)
    axes.set_ylabel(y_label, color=INK, fontsize=10)


def bare(axes: Axes, lows: FloatArray, highs: FloatArray) -> None:
    """Give axes the bounds of a picture, and nothing else."""
    axes.set_xlim(float(lows[0]), float(highs[0]))
    axes.set_ylim(float(lows[1]), float(highs[1]))
    axes.set_aspect("equal")
    axes.set_axis_off()


def panels_of(figure: Figure, rows: int, columns: int, count: int) -> list[Axes]:
    """Return the first so many axes of a grid in a figure; the others are hidden."""
    panels = list(figure.subplots(rows, columns, squeeze=False).flat)
    for axes in panels[count:]:
        axes.set_visible(False)
    return panels[:count]


def headed(axes: Axes, text: str) -> None:
    """Put a heading over axes, at their left end."""
    axes.set_title(text, loc="left", fontsize=11, fontweight="bold", color=INK)


def legend(axes: Axes, *entries: Any, beside: float | None = None, **style: Any) -> None:
    """Put a legend where there is room in axes, or to their right, with its top at a height in units of theirs."""
    if beside is not None:
        style |= {"loc": "upper left", "bbox_to_anchor": (1.0, beside), "handlelength": 1.2}
    axes.legend(*entries, **{"frameon": False, "fontsize": 9, "labelcolor": INK, **style})


def with_unit(label: str, unit: str) -> str:
    """Return a label with its unit; without one where it is a plain number, or may be anything."""
    return label if unit in ("", "1", "any") else f"{label}, {unit}"


def titled(figure: Figure, text: str, **style: Any) -> Text:
    """Put a title over a figure, which is made as wide as the title is, and return it."""
    made = figure.suptitle(text, x=0.01, ha="left", fontsize=11, color=INK, **style)
    needed = made.get_window_extent().width / figure.dpi + 0.02 * figure.get_figwidth() + 0.1
    if needed > figure.get_figwidth():
        figure.set_figwidth(needed)
    return made


def save_figure(figure: Figure, file: str | os.PathLike[str]) -> Path:
    """Save a figure; the suffix says how."""
    check_picture(file)
    target = Path(file)
    # Without a date in it, the same picture is the same file.
    metadata: dict[str, Any] = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}.get(target.suffix.lower(), {})
    write_atomically(target, lambda part: figure.savefig(part, dpi=160, metadata=metadata))
    return target


def finished(figure: Figure, file: str | os.PathLike[str] | None) -> Figure:
    """Save a figure, if a file is given, and return it."""
    if file is not None:
        save_figure(figure, file)
    return figure
