"""A still picture of a stage as SVG, for where a page cannot move."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from typing import NamedTuple

import numpy as np

from atwood.arrays import FloatArray
from atwood.plotting.camera import DEFAULT_VIEW, Camera
from atwood.plotting.canvas import INK
from atwood.plotting.pages.stage import FLAT, Item, Stage
from atwood.plotting.scene3d.painter import to_rgb

_WIDTH = 640.0
"""Of the picture, in its own units."""

_LIGHT = np.array([0.25, -0.6, 0.76])

_TIES = {"rod": 2.0, "link": 6.0, "rope": 1.6, "spring": 1.3, "damper": 1.3, "rail": 1.2}
"""Widths of what goes between frames."""


class _Mark(NamedTuple):
    """An element of the picture: how near it is to the eye, and what it is."""

    depth: float
    text: str


def still_picture(stage: Stage, name: str) -> str:
    """Return the scene where the run begins, as an SVG element."""
    camera = Camera(0.0, 0.0) if stage.stride == FLAT else Camera(*DEFAULT_VIEW)
    corners = np.array([[x, y, z] for x in stage.box[:, 0] for y in stage.box[:, 1] for z in stage.box[:, 2]])
    page = camera.project(corners)
    low, high = page.min(axis=0) - 4.0 * stage.unit, page.max(axis=0) + 4.0 * stage.unit
    scale = _WIDTH / float(high[0] - low[0])

    def seen(points: FloatArray) -> FloatArray:
        flat = camera.project(points)
        return np.asarray(np.column_stack([(flat[:, 0] - low[0]) * scale, (high[1] - flat[:, 1]) * scale]))

    marks = [mark for item in stage.items for mark in _marks(stage, item, camera, seen, scale)]
    if stage.stride != FLAT:
        marks.sort(key=lambda mark: mark.depth)
    height = float(high[1] - low[1]) * scale
    body = "".join(mark.text for mark in marks)
    head = f'<svg xmlns="http://www.w3.org/2000/svg" role="img" viewBox="0 0 {_WIDTH:.0f} {height:.0f}">'
    return f"{head}<title>{escape(name)}</title>{body}</svg>"


def _placed(stage: Stage, frame: int, points: FloatArray) -> FloatArray:
    """Return points of a frame in the world where the run begins."""
    if frame < 0:
        return points
    pose = stage.poses[0, frame]
    if stage.stride == FLAT:
        c, s = np.cos(pose[2]), np.sin(pose[2])
        turn, origin = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]]), np.array([pose[0], 0.0, pose[1]])
    else:
        turn, origin = pose[3:].reshape(3, 3), pose[:3]
    return np.asarray(origin + points @ turn.T)


def _marks(stage: Stage, item: Item, camera: Camera, seen: object, scale: float) -> Iterator[_Mark]:
    assert callable(seen)
    kind = item["kind"]
    if kind in _TIES:
        ends = [_placed(stage, end["frame"], np.atleast_2d(end.get("point", np.zeros(3))))[0] for end in item["ends"]]
        line = np.array(ends)
        yield _Mark(float(camera.depth(line).mean()), _polyline(seen(line), INK, _TIES[kind]))
        return
    if kind in ("ball", "disc"):
        middle = _placed(stage, item["frame"], np.atleast_2d(item.get("point", np.zeros(3))))
        (x, y), edge = seen(middle)[0], item.get("edge", INK)
        size = item["size"] * scale
        text = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{size:.1f}" fill="{item["colour"]}" stroke="{edge}"/>'
        yield _Mark(float(camera.depth(middle)[0]) + item["size"], text)
        return
    if kind == "mesh":
        yield from _faces(stage, item, camera, seen)
        return
    points = _placed(stage, item["frame"], item["points"])
    for line in points.reshape(-1, 2, 3) if kind == "edges" else [points]:
        yield _Mark(float(camera.depth(line).mean()), _polyline(seen(line), item["colour"], item["width"]))


def _faces(stage: Stage, item: Item, camera: Camera, seen: object) -> Iterator[_Mark]:
    """Return the faces that look to the eye, in the tone of the light on them."""
    assert callable(seen)
    points = _placed(stage, item["frame"], item["vertices"])
    corners, page = points[item["faces"]], np.round(seen(points)[item["faces"]])
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.linalg.norm(normals, axis=1)
    sides = np.diff(page, axis=1)
    is_seen = (sizes > 0.0) & (sides[:, 0, 0] * sides[:, 1, 1] != sides[:, 0, 1] * sides[:, 1, 0])
    colour = np.array(to_rgb(item["colour"])) * (0.8 if item.get("marked") else 1.0)
    for k in np.flatnonzero(is_seen):
        normal = normals[k] / sizes[k]
        if stage.stride != FLAT and normal @ camera.towards <= 0.0:
            continue
        tone = 1.0 if stage.stride == FLAT else 0.62 + 0.38 * max(0.0, float(normal @ _LIGHT))
        rgb = "#" + "".join(f"{round(255 * min(1.0, tone * part)):02x}" for part in colour)
        (x, y), (a, b), (c, d) = page[k, 0], sides[k, 0], sides[k, 1]
        path = f"M{x:.0f} {y:.0f}l{a:.0f} {b:.0f} {c:.0f} {d:.0f}z"
        yield _Mark(float(camera.depth(corners[k]).mean()), f'<path d="{path}" fill="{rgb}" stroke="{rgb}"/>')


def _polyline(points: FloatArray, colour: str, width: float) -> str:
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="{1.3 * width:.1f}"/>'
