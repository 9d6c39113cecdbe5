"""Parts and connections of a scene as a diagram: what holds what, and which joints close loops."""

from __future__ import annotations

import os
from html import escape
from pathlib import Path

import numpy as np

from atwood.arguments import FILE, instance, optional, takes
from atwood.arrays import FloatArray, IndexArray
from atwood.files import check_target, write_atomically
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import Model
from atwood.pipeline import assemble

_LOOP, _FOREST, _OTHER = "#b23a48", "#1f5fa8", "#55626e"
"""Colours of joints that close loops, of those that bodies hang on, and of all other parts."""

_STEP = 75.0
"""Mean distance of what is connected, in the units of the picture."""

_EVENLY = np.array([0.7548776662466927, 0.5698402909980532])
"""Multiples of these, without whole numbers, fill a square evenly (Roberts 2018)."""

_PAIRS = 3e7
"""So many pairs are looked at to place what is drawn."""


@dataclass(frozen=True)
class Diagram:
    """A diagram of parts and connections; notebooks show it.

    Attributes
    ----------
    svg
        The picture, as an SVG element.
    file
        Where it was saved; None if it was not.
    """

    svg: str
    file: Path | None = None

    def _repr_svg_(self) -> str:
        return self.svg


@takes(scene=instance("a scene or an assembly", Model, Assembly), file=optional(FILE))
def diagram(scene: Model | Assembly, file: str | os.PathLike[str] | None = None) -> Diagram:
    """Draw which parts of a scene are connected where, which joints bodies hang on, and which close loops.

    Each box is a part, each dot a connection; parts that hold their ends rigidly together are grey. Of the reduced
    form, joints of the spanning forest are blue and those that close loops red (Featherstone, Rigid Body Dynamics
    Algorithms, section 4.1).

    Parameters
    ----------
    scene
        The scene.
    file
        Where to save it (``.svg``).

    Returns
    -------
    Diagram
        The picture.

    Raises
    ------
    UsageError
        If the picture cannot be saved.
    """
    target = None if file is None else Path(file)
    if target is not None:
        check_target(target, [".svg"])
    assembly = scene if isinstance(scene, Assembly) else assemble(scene)
    svg = draw_diagram(assembly)
    if target is not None:
        write_atomically(target, lambda part: part.write_text(svg, encoding="utf-8"))
    return Diagram(svg, target)


def draw_diagram(assembly: Assembly) -> str:
    """Return the diagram of a scene as an SVG element."""
    mechanism = assembly.mechanism
    edges = dict.fromkeys((("part", part), ("node", node)) for (part, _), node in mechanism.graph.node_of.items())
    edges |= dict.fromkeys((("part", one.part), ("node", 0)) for one in mechanism.graph.joints if 0 in (one.a, one.b))
    names = list(
        dict.fromkeys([*(name for edge in edges for name in edge), *(("part", path) for path in assembly.flat.parts)])
    )
    number = {name: k for k, name in enumerate(names)}
    ends = np.array([[number[a], number[b]] for a, b in edges], dtype=int).reshape(-1, 2)
    at = _placed(len(names), ends)
    lengths = np.linalg.norm(at[ends[:, 0]] - at[ends[:, 1]], axis=1)
    at = (at - at.min(axis=0, initial=np.inf)) * (_STEP / (float(np.mean(lengths)) if len(lengths) else 1.0)) + [
        80.0,
        40.0,
    ]
    where = dict(zip(names, at, strict=True))
    width, height = (at.max(axis=0) + np.array([80.0, 40.0])).tolist()
    lines = [_line(where[a], where[b]) for a, b in edges]
    colours = _colours(assembly)
    marks = [_mark(name, where[name], mechanism.graph.nodes, colours) for name in names]
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" viewBox="0 0 {width:.0f} {height:.0f}" width="{width:.0f}"'
    )
    title = f"<title>Parts and connections of {escape(assembly.flat.name)}</title>"
    return f'{head} font-family="system-ui, sans-serif" font-size="12">{title}{"".join((*lines, *marks))}</svg>'


def _placed(count: int, ends: IndexArray) -> FloatArray:
    """Return places where what is joined attracts, and all else repels (Fruchterman and Reingold 1991)."""
    near = 1.2 / max(1.0, float(count)) ** 0.5
    joined = np.zeros((count, count))
    joined[ends[:, 0], ends[:, 1]] = joined[ends[:, 1], ends[:, 0]] = 1.0
    at: FloatArray = np.arange(1, count + 1)[:, None] * _EVENLY % 1.0
    rounds = int(np.clip(_PAIRS / max(count, 1) ** 2, 20, 300))
    for share in np.linspace(1.0, 0.0, rounds, endpoint=False):
        apart = at[:, None] - at[None]
        distance = np.maximum(np.linalg.norm(apart, axis=-1), 0.01)
        push = np.einsum("ijk,ij->ik", apart, near**2 / distance**2 - joined * distance / near)
        step = 0.1 * share * push / np.maximum(np.linalg.norm(push, axis=-1), 0.01)[:, None]
        at += step
        if np.linalg.norm(step) < 1e-4 * count:
            break
    return at


def _colours(assembly: Assembly) -> dict[str, str]:
    """Return the colour of each part that is a joint."""
    forest = assembly.reduced.forest
    found = {one.joint.part: _FOREST for one in forest.attachments if one.joint is not None}
    return found | {joint.part: _LOOP for joint in forest.loop_joints}


def _line(a: FloatArray, b: FloatArray) -> str:
    return f'<line x1="{a[0]:.1f}" y1="{a[1]:.1f}" x2="{b[0]:.1f}" y2="{b[1]:.1f}" stroke="#9aa7b3"/>'


def _mark(name: tuple[str, object], place: FloatArray, nodes: object, colours: dict[str, str]) -> str:
    """Return a box with a part's path, or the dot of a connection with what is connected there."""
    x, y = place.tolist()
    if name[0] == "node":
        told = escape(str(nodes[name[1]].name))  # type: ignore[index]
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="#22303c"><title>{told}</title></circle>'
    text, colour = escape(str(name[1])), colours.get(str(name[1]), _OTHER)
    half = 4.0 + 3.6 * len(str(name[1]))
    box = f'<rect x="{x - half:.1f}" y="{y - 11:.1f}" width="{2 * half:.1f}" height="22" rx="4"'
    label = f'<text x="{x:.1f}" y="{y + 4:.1f}" text-anchor="middle" fill="{colour}">{text}</text>'
    return f'{box} fill="#ffffff" stroke="{colour}" stroke-width="1.6"/>{label}'
