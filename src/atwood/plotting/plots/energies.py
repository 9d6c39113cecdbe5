"""The energies of components above each other, and by how much each fails to balance."""

from __future__ import annotations

import os

import numpy as np

from atwood.arguments import FILE, instance, optional, takes
from atwood.arrays import FloatArray
from atwood.plotting.canvas import COLOURS, GREY, INK, Axes, Figure, finished, headed, legend, new_figure, polish
from atwood.result.part_energy import PartEnergies, PartEnergy
from atwood.result.result import Result

_SHOWN = 7
"""So many components have a colour each; the rest share the last."""

_WIDTH = 0.005
"""Of the height of the picture: what never is thicker gets no colour of its own."""


@takes(
    result=instance("a result, as simulate returns it, or its energy.parts", Result, PartEnergies),
    file=optional(FILE),
)
def plot_energies(result: Result | PartEnergies, file: str | os.PathLike[str] | None = None) -> Figure:
    """Draw the energies of the components of a run above each other.

    Potential energies count from their least value along the run. On top is what was dissipated and lost in impacts; so
    the whole stack is as high as the line, which is the energy at the start and what came in since.

    Parameters
    ----------
    result
        The run, or its ``energy.parts``.
    file
        Where to save the picture (``.png``, ``.svg`` or ``.pdf``).

    Returns
    -------
    matplotlib.figure.Figure
        The figure: the stack, and below it by how much components fail to balance.

    Raises
    ------
    UsageError
        If matplotlib is missing, or the picture cannot be saved.
    """
    parts = result.energy.parts if isinstance(result, Result) else result
    figure = new_figure(8.0, 6.0)
    stack, errors = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 1.0))
    layers = _layers(parts)
    _draw_stack(stack, parts, layers)
    _draw_errors(errors, parts, {label.rpartition(",")[0]: colour for label, colour, _, _ in layers})
    errors.set_xlabel("time, s", color=INK, fontsize=10)
    title = result.assembly.flat.name if isinstance(result, Result) else "Energy by component"
    headed(stack, title)
    figure.align_ylabels([stack, errors])
    return finished(figure, file)


Layer = tuple[str, str, float, FloatArray]
"""Label, colour, opacity and height."""


def _layers(parts: PartEnergies) -> list[Layer]:
    """Return the layers of the stack, from below."""
    heights = [(path, one.kinetic, one.potential - np.min(one.potential)) for path, one in parts.items()]
    gone = sum((one.dissipated - np.minimum(one.impacts, 0.0) for one in parts.values()), np.zeros_like(parts.time))
    whole = float(np.max(sum((k + v for _, k, v in heights), gone), initial=0.0))
    seen = [one for one in heights if np.max(one[1] + one[2], initial=0.0) > _WIDTH * whole]
    chosen = sorted(seen, key=lambda one: -float(np.max(one[1] + one[2])))[:_SHOWN]
    named = {one[0] for one in (seen if len(seen) <= _SHOWN + 1 else chosen)}
    found = []
    own = [one for one in heights if one[0] in named]
    for (path, kinetic, potential), colour in zip(own, COLOURS, strict=False):
        found += [(f"{path}, kinetic", colour, 0.85, kinetic), (f"{path}, potential", colour, 0.4, potential)]
    rest = sum((k + v for path, k, v in heights if path not in named), np.zeros_like(parts.time))
    found.append(("all others", GREY, 0.7, rest))
    found.append(("dissipated, lost in impacts", "#c4c9ce", 0.6, gone))
    return [one for one in found if np.max(np.abs(one[3]), initial=0.0) > _WIDTH * whole]


def _draw_stack(axes: Axes, parts: PartEnergies, layers: list[Layer]) -> None:
    below = np.zeros_like(parts.time)
    for label, colour, opacity, height in layers:
        axes.fill_between(parts.time, below, below + height, color=colour, alpha=opacity, linewidth=0, label=label)
        below = below + height
    axes.plot(
        parts.time, _given(list(parts.values())), color=INK, linewidth=1.3, label="at the start, and what came in"
    )
    polish(axes, y_label="energy, J")
    axes.margins(x=0.0)
    axes.set_ylim(bottom=0.0)
    handles, labels = axes.get_legend_handles_labels()
    legend(axes, handles[::-1], labels[::-1], beside=1.03)


def _given(parts: list[PartEnergy]) -> FloatArray:
    """Return the energy at the start, as the stack counts it, and what came in since."""
    total: FloatArray = np.zeros_like(parts[0].kinetic)
    for one in parts:
        at_start = one.total[0] - one.gained[0] - np.min(one.potential)
        total = total + at_start + one.supplied + one.constraints + np.maximum(one.impacts, 0.0)
    return total


def _draw_errors(axes: Axes, parts: PartEnergies, colours: dict[str, str]) -> None:
    sizes = {path: float(np.max(np.abs(one.error), initial=0.0)) for path, one in parts.items()}
    polish(axes, y_label="error / exchanged")
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    largest = sorted((path for path in sizes if sizes[path] > 0.0), key=lambda path: -sizes[path])[:3]
    others = iter([colour for colour in COLOURS if colour not in colours.values()] + [INK, GREY, "#000000"])
    for path in largest:
        colour = colours[path] if path in colours else next(others)
        axes.plot(parts.time, parts[path].error / (parts.exchanged or 1.0), color=colour, linewidth=1.2, label=path)
    axes.ticklabel_format(axis="y", style="sci", scilimits=(-2, 2), useMathText=True)
    axes.yaxis.get_offset_text().set_fontsize(8)
    if largest:
        legend(axes, beside=1.1, title="largest", title_fontsize=8)
