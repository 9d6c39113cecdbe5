"""Pictures of the mechanism itself, at a few times, moving, or displaced along a mode of oscillation."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from atwood.arguments import ANYTHING, FILE, TEXT, each, instance, number, optional, takes, whole
from atwood.arrays import FloatArray
from atwood.errors import UsageError
from atwood.files import write_atomically
from atwood.plotting.camera import View, as_camera, check_view
from atwood.plotting.canvas import COLOURS, INK, Axes, Figure, bare, finished, need_matplotlib, new_figure, titled
from atwood.plotting.moving import check_moving, film
from atwood.plotting.planar.geometry import Picture, find_connectors, make_picture
from atwood.plotting.planar.strokes import Pen, draw_trace
from atwood.plotting.scene3d.drawing import draw_space, space_panels
from atwood.plotting.scene3d.picture import SpacePicture, make_space_picture
from atwood.plotting.sheet import Sheet
from atwood.result.result import Result
from atwood.theory.linear.normal_modes import NormalModes

if TYPE_CHECKING:
    from atwood.plotting.figure import Animation


RESULT = instance("a Result, as simulate returns it", Result)
TRACE = each(TEXT, "the paths of connectors, such as 'rod2.b'")
TIMES = optional(each(number(), "a list of times, s", 1))


@takes(result=RESULT, file=optional(FILE), times=TIMES, view=ANYTHING, trace=TRACE)
def plot_mechanism(
    result: Result,
    file: str | os.PathLike[str] | None = None,
    times: Sequence[float] | None = None,
    *,
    view: View | None = None,
    trace: str | Sequence[str] = (),
) -> Figure:
    """Draw the mechanism at a few times, with the paths of its masses.

    In the plane all times are drawn in one picture, earlier ones fainter; on a line and in space they stand side by
    side. In space a rigid body is drawn as the uniform box, or the uniform cylinder where two of its principal moments
    are equal, that has its mass and its inertia; what joins it is drawn from what its joints let move. The path of
    its axis is drawn where the body turns about a point.

    Parameters
    ----------
    result
        The run.
    file
        Where to save the picture (``.png``, ``.svg`` or ``.pdf``).
    times
        Times, s; four of the run when not given. The output times nearest to them are drawn.
    view
        In space, from where it is seen: azimuth and elevation of the eye, degrees. At (0, 0) it looks along y, with x
        to the right and z upwards, as in the plane; a positive azimuth takes it to the right, a positive elevation up.
        (30, 20) when not given.
    trace
        Connectors such as ``"rod2.b"`` whose paths are drawn too; the path of a part that has one connector will do.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    UsageError
        If matplotlib is missing, a time lies outside the run, there is no such view, there is no such connector, or the
        picture cannot be saved.
    """
    traced = find_connectors(result, trace)
    moments = _moments(result, times)
    if check_view(result.assembly.mechanism.space.name, view):
        figure = _draw_space(result, make_space_picture(result, as_camera(view), traced), moments)
    else:
        picture = make_picture(result, traced.values())
        drawn = _draw_apart if picture.direction else _draw_together
        figure = drawn(result, picture, moments, list(traced.values()))
    return finished(figure, file)


def _moments(result: Result, times: Sequence[float] | None) -> list[int]:
    """Return the numbers of the output times that are drawn."""
    if times is None:
        return sorted({round(share * (len(result.time) - 1)) for share in (0.0, 0.3, 0.65, 1.0)})
    first, last = float(result.time[0]), float(result.time[-1])
    slack = 1e-9 * (last - first)
    for time in times:
        if not first - slack <= time <= last + slack:
            raise UsageError(
                f"t = {time:g} s lies outside the run, {first:g} to {last:g} s", advice="Give a time of it."
            )
    return sorted({int(np.argmin(np.abs(result.time - time))) for time in times})


def _draw_space(result: Result, picture: SpacePicture, moments: Sequence[int]) -> Figure:
    """Draw times in panels of their own, each with the paths until then."""
    titles, name = [f"t = {result.time[moment]:.3g} s" for moment in moments], _name(result)
    alone = len(moments) == 1
    figure, panels = space_panels(picture, [f"{name}, {titles[0]}"] if alone else titles, "" if alone else name)
    for axes, moment in zip(panels, moments, strict=True):
        bare(axes, *picture.bounds_at(moment))
        draw_space(Sheet(axes), picture, moment)
    return figure


def _draw_together(result: Result, picture: Picture, moments: Sequence[int], traced: Sequence[int]) -> Figure:
    """Draw all times in one picture, with traces."""
    shown = slice(0, moments[-1] + 1)
    figure, axes, pen = _page(picture, shown)
    sheet = Sheet(axes)
    _draw_traces(sheet, picture, pen, shown, traced)
    for rank, moment in enumerate(moments):
        share = 1.0 if len(moments) == 1 else rank / (len(moments) - 1)
        pen.draw(sheet, moment, alpha=0.16 + 0.84 * share**1.5, depth=3 + rank)
    times = ", ".join(f"{result.time[i]:.3g}" for i in moments)
    titled(figure, f"{_name(result)}, t = {times} s")
    return figure


def _draw_traces(sheet: Sheet, picture: Picture, pen: Pen, shown: slice, traced: Sequence[int]) -> None:
    """Draw the paths of all masses and of chosen nodes, older parts fainter."""
    free = [s for s in pen.heavy if s.nodes[0] not in pen.sliding]
    moving = [s for s in free if np.max(np.ptp(picture.points[s.nodes[0]], axis=0)) > 1e-3 * picture.extent]
    chosen = moving if len(moving) <= _TRACES else moving[-1:]
    for shape in chosen:
        draw_trace(sheet, picture.points[shape.nodes[0]][shown], pen.colour(shape))
    for rank, node in enumerate(traced):
        draw_trace(sheet, picture.points[node][shown], COLOURS[(4 + rank) % len(COLOURS)])


_TRACES = 4
"""With more moving masses than this, only the last one's path is drawn."""


def _draw_apart(result: Result, picture: Picture, moments: Sequence[int], traced: Sequence[int]) -> Figure:
    """Draw times side by side, or one below the other for a line that goes across; paths would cover the line."""
    lows, highs = _bounds(picture)
    width, height = highs - lows
    count = len(moments)
    if picture.direction == "up":
        size = 5.2
        figure = new_figure(max(2.6, count * size * width / height), size)
        panels = figure.subplots(1, count, squeeze=False, sharey=True)[0]
    else:
        size = 8.0
        figure = new_figure(size, count * (size * height / width + 0.35))
        panels = figure.subplots(count, 1, squeeze=False, sharex=True)[:, 0]
    pen = Pen(picture)
    for axes, moment in zip(panels, moments, strict=True):
        bare(axes, lows, highs)
        pen.draw(Sheet(axes), moment, alpha=1.0, depth=3)
        axes.set_title(f"t = {result.time[moment]:.3g} s", fontsize=10, color=INK)
    titled(figure, _name(result))
    return figure


_LONGEST, _MOST = 3600.0, 240
"""Seconds, and frames in a second, of an animated picture."""


@takes(
    result=RESULT,
    file=optional(FILE),
    seconds=optional(number("a number of seconds, above 0 and at most an hour", above=0.0, most=_LONGEST)),
    frames_per_second=whole(f"a whole number of frames, 1 to {_MOST}", 1, _MOST),
    view=ANYTHING,
    trace=TRACE,
)
def animate(
    result: Result,
    file: str | os.PathLike[str] | None = None,
    seconds: float | None = None,
    frames_per_second: int = 25,
    *,
    view: View | None = None,
    trace: str | Sequence[str] = (),
) -> Animation:
    """Make an animated picture of the motion; a notebook plays it.

    Parameters
    ----------
    result
        The run.
    file
        Where to save it (``.gif``, ``.webp`` or, with ``pip install 'atwood[video]'``, ``.mp4``).
    seconds
        How long it plays; as long as the run took in its own time when not given, but two to twenty seconds.
    frames_per_second
        Frames in a second, at most; a run of fewer states than frames shows each state once.
    view, trace
        See `plot_mechanism`.

    Returns
    -------
    atwood.plotting.figure.Animation
        The picture; it can be opened like the path of its file.

    Raises
    ------
    UsageError
        If matplotlib is missing, there is no such view or connector, or the file cannot be saved.
    """
    kind = "gif" if file is None else check_moving(file)
    need_matplotlib()
    from atwood.plotting.figure import Animation

    span = float(result.time[-1] - result.time[0])
    lasting = min(max(span, 2.0), 20.0) if seconds is None else seconds
    digits = int(np.clip(2.0 - np.floor(np.log10(span or 1.0)), 2, 9))
    # A run of fewer states than frames is shown once each, for longer.
    count = max(2, min(round(lasting * frames_per_second), len(result.time)))
    wanted = np.linspace(result.time[0], result.time[-1], count)
    moments = [int(np.argmin(np.abs(result.time - time))) for time in wanted]
    figure, draw = _stage(result, view, find_connectors(result, trace))
    titles = [f"{_name(result)}, t = {time:.{digits}f} s" for time in wanted]
    content = film(figure, draw, moments, titles, min(frames_per_second, count / lasting), kind)
    if file is None:
        return Animation(content, kind)
    target = Path(file)
    write_atomically(target, lambda part: part.write_bytes(content))
    return Animation(content, kind, target)


def _stage(result: Result, view: View | None, traced: Mapping[str, int]) -> tuple[Figure, Callable[[int], None]]:
    """Return a figure, and what draws an output time on it in the place of the one before."""
    if check_view(result.assembly.mechanism.space.name, view):
        seen = make_space_picture(result, as_camera(view), traced)
        figure, (axes,) = space_panels(seen, [""])
        axes.set_position((0.02, 0.02, 0.96, 0.9))
        sheet = Sheet(axes)

        def draw_seen(moment: int) -> None:
            sheet.again()
            bare(axes, *seen.bounds_at(moment))
            draw_space(sheet, seen, moment)

        return figure, draw_seen
    picture = make_picture(result, traced.values())
    figure, axes, pen = _page(picture, None)
    sheet = Sheet(axes)

    def draw(moment: int) -> None:
        sheet.again()
        if not picture.direction:
            _draw_traces(sheet, picture, pen, slice(0, moment + 1), list(traced.values()))
        pen.draw(sheet, moment, alpha=1.0, depth=3)

    return figure, draw


def _name(result: Result) -> str:
    return result.assembly.flat.name


def _page(picture: Picture, shown: slice | None) -> tuple[Figure, Axes, Pen]:
    """Return an empty page that what is shown of the motion fits on."""
    lows, highs = _bounds(picture, shown)
    width, height = highs - lows
    scale = 7.0 / max(width, height)
    figure = new_figure(max(3.6, scale * width), max(2.4, scale * height + 0.4))
    axes = figure.subplots()
    bare(axes, lows, highs)
    return figure, axes, Pen(picture)


def _bounds(picture: Picture, shown: slice | None = None) -> tuple[FloatArray, FloatArray]:
    """Return the corners of a page that holds all places of the run, or of a part of it."""
    everything = picture.everything() if shown is None else picture.everything(shown)
    margin = 0.09 * picture.extent
    side = max(picture.radii.values(), default=0.0)
    lows, highs = np.min(everything, axis=0) - margin, np.max(everything, axis=0) + margin
    lows[0], highs[0] = lows[0] - 0.3 * side, highs[0] + 0.3 * side
    highs[1] += side
    return lows, highs


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
