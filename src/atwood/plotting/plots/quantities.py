"""Quantities over time."""

from __future__ import annotations

import os
from collections.abc import Iterable

from atwood.arguments import FILE, instance, optional, takes
from atwood.arrays import FloatArray
from atwood.errors import ResultError
from atwood.model.declare.connectors import PATH, PATHS
from atwood.plotting.canvas import (
    COLOURS,
    GREY,
    INK,
    Axes,
    Figure,
    finished,
    headed,
    legend,
    new_figure,
    polish,
    with_unit,
)
from atwood.result.files import SavedResult
from atwood.result.result import Result

_PANELS = 4
_CURVES = 8
"""So many curves can be told apart in one panel."""

_QUANTITIES = {
    "m": "position",
    "rad": "angle",
    "m/s": "velocity",
    "rad/s": "angular velocity",
    "N": "force",
    "N*m": "torque",
    "J": "energy",
    "m/s^2": "acceleration",
    "W": "power",
}


@takes(
    result=instance("a result, as simulate or load_result returns it", Result, SavedResult),
    paths=PATHS,
    file=optional(FILE),
    x=optional(PATH),
)
def plot(
    result: Result | SavedResult,
    paths: Iterable[str] | None = None,
    file: str | os.PathLike[str] | None = None,
    x: str | None = None,
) -> Figure:
    """Plot quantities over time, or over another quantity, one panel for each unit.

    Parameters
    ----------
    result
        A run, or one that was read from a file.
    paths
        Which quantities, such as ``["rod1.angle", "rod1.tension"]``; a path of a component stands for all below it.
        The coordinates, the tensions and the energy balance when not given.
    file
        Where to save the picture (``.png``, ``.svg`` or ``.pdf``).
    x
        The quantity that they are plotted over, such as ``"rod1.angle"``; time when not given.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    UsageError
        If matplotlib is missing, or the picture cannot be saved.
    ResultError
        If there is no such quantity, or the quantities have more units than there is room for.
    """
    chosen = _default(result) if paths is None else _expand(result, paths)
    groups: dict[str, list[str]] = {}
    for path in chosen:
        groups.setdefault(result.unit(path), []).append(path)
    shows_energy = paths is None and isinstance(result, Result) and x is None
    across, label = (result.time, "time, s") if x is None else (result.array(x), with_unit(x, result.unit(x)))
    room = _PANELS - 1 if shows_energy else _PANELS
    if len(groups) > room and paths is not None:
        raise ResultError(
            f"the quantities have {len(groups)} different units and there is room for {room}",
            advice="Plot fewer at a time.",
        )
    units = list(groups)[:room]
    count = len(units) + shows_energy
    figure = new_figure(8.0, 1.0 + 2.1 * max(count, 1))
    panels = figure.subplots(max(count, 1), 1, sharex=True, squeeze=False)[:, 0]
    for axes, unit in zip(panels, units, strict=False):
        _draw(axes, result, groups[unit], unit, across)
        if x is None:
            _mark(axes, result)
    if shows_energy and isinstance(result, Result):
        _draw_energy(panels[count - 1], result)
    panels[-1].set_xlabel(label, color=INK, fontsize=10)
    headed(panels[0], _title(result))
    figure.align_ylabels(list(panels))
    return finished(figure, file)


def _title(result: Result | SavedResult) -> str:
    if isinstance(result, Result):
        name, kind = result.assembly.flat.name, result.method
    else:
        name, kind = (str(result.metadata.get(key, "")) for key in ("scene", "method"))
    return ", ".join(text for text in (name, kind) if text)


def _default(result: Result | SavedResult) -> list[str]:
    """Return what says most at first glance: coordinates and tensions."""
    if isinstance(result, Result):
        names = [one.name for one in result.assembly.reduced.names if one.name in result]
    else:
        names = [path for path in result.paths if path.endswith((".angle", ".displacement"))]
    if not names:
        names = [path for path in result.paths if ".position." in path]
    tensions = [path for path in result.paths if path.endswith(".tension")]
    return [*names, *tensions]


def _expand(result: Result | SavedResult, paths: Iterable[str]) -> list[str]:
    """Return paths with those of components replaced by all below them."""
    found: list[str] = []
    for path in paths:
        found += [path] if path in result else [f"{path}.{name}" for name in result.group(path)]
    return list(dict.fromkeys(found))


def _draw(axes: Axes, result: Result | SavedResult, paths: list[str], unit: str, across: FloatArray) -> None:
    """Draw the quantities of one unit, with their names at the side."""
    kinds = {path.rpartition(".")[2] for path in paths}
    label = kinds.pop().replace("_", " ") if len(kinds) == 1 else _QUANTITIES.get(unit, "")
    label = label if len(label) > 1 else _QUANTITIES.get(unit, "")
    polish(axes, y_label=with_unit(label, unit))
    picked = paths if len(paths) <= _CURVES else [paths[i] for i in _spread(len(paths), _CURVES)]
    for colour, path in zip(COLOURS, picked, strict=False):
        axes.plot(across, result.array(path), color=colour, linewidth=1.6, label=_without_ending(path, paths))
    title = f"{len(picked)} of {len(paths)}" if len(picked) < len(paths) else None
    legend(axes, beside=1.03, title=title, title_fontsize=8)


def _without_ending(path: str, paths: list[str]) -> str:
    """Return a path without its last step where that is the same in all, since the axis says it."""
    ending = path.rpartition(".")[2]
    shared = len({one.rpartition(".")[2] for one in paths}) == 1 and len(ending) > 1
    return path[: -len(ending) - 1] if shared else path


def _spread(count: int, wanted: int) -> list[int]:
    return [round(i * (count - 1) / (wanted - 1)) for i in range(wanted)]


def _draw_energy(axes: Axes, result: Result) -> None:
    """Draw by how much energy and work fail to balance."""
    ledger = result.energy
    balance = ledger.total - ledger.work
    drift = (balance - balance[0]) / (ledger.exchanged or 1.0)
    polish(axes, y_label="energy drift / exchanged")
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    axes.plot(result.time, drift, color=INK, linewidth=1.2)
    axes.ticklabel_format(axis="y", style="sci", scilimits=(-2, 2), useMathText=True)
    axes.yaxis.get_offset_text().set_fontsize(8)
    _mark(axes, result)


def _mark(axes: Axes, result: Result | SavedResult) -> None:
    """Mark the times at which something happened."""
    if isinstance(result, Result):
        for one in result.events:
            axes.axvline(one.time, color=GREY, linewidth=0.8, linestyle=(0, (4, 3)))
