"""The strokes of a mechanism: how each kind of part is drawn."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from atwood.arrays import FloatArray, IndexArray
from atwood.numerics.rank import decompose
from atwood.plotting.canvas import COLOURS, GREY, INK, PALE, ROPE, SHADE, STEEL
from atwood.plotting.planar.geometry import Picture, Shape, hanging
from atwood.plotting.shapes.meshes import Mesh
from atwood.plotting.sheet import Sheet

WHITE = "#ffffff"

TIES = ("rail", "rod", "link", "rope", "spring", "damper")
"""Kinds that go from one node to others."""


Item = dict[str, Any]
"""Something to draw: its `kind`, the `part` that it shows, its `frame`, places in the axes of that, and its colour."""

_BORDERS = {INK: 1.3, WHITE: 0.9}
"""Widths of borders by their colour, points."""

_FRONT = {"pivot": 0.3, "mass": 0.5}
"""By how many layers some kinds are in front of others."""


class Pen:
    """Draws a mechanism at one time.

    Parameters
    ----------
    picture
        Where everything is.
    """

    def __init__(self, picture: Picture) -> None:
        self.picture = picture
        self.share = 1.0
        self.unit = 0.01 * picture.extent
        self.heavy = [shape for shape in picture.shapes if shape.kind == "mass" and shape.size > 0.0]
        self.heaviest = max((shape.size for shape in self.heavy), default=1.0)
        self.rails = {shape.part: self._rail_ends(shape) for shape in picture.shapes if shape.kind == "rail"}
        self.middle = float(np.mean([points[:, 1].mean() for points in picture.points.values()]))
        self.sliding = {shape.nodes[1] for shape in picture.shapes if shape.kind == "rail"}

    def colour(self, shape: Shape) -> str:
        """Return the colour of a mass; of very many, all have the same."""
        if len(self.heavy) > len(COLOURS):
            return COLOURS[0]
        return COLOURS[self.heavy.index(shape)] if shape in self.heavy else INK

    def draw(self, sheet: Sheet, moment: int, alpha: float, depth: int) -> None:
        """Draw everything at one time."""
        for shape, marks in self.marks:
            points = np.array([self.picture.points[node][moment] for node in shape.nodes])
            self.share = 1.0 if shape.kind == "ground" else alpha
            layer = 2.0 if shape.kind == "ground" else depth + _FRONT.get(shape.kind, 0.0)
            turn = np.eye(2)
            if shape.kind in ("solid", "curve"):
                angle = float(self.picture.angles[shape.nodes[0]][moment])
                turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
            for mark in marks:
                self._draw_mark(sheet, mark, points[0] + mark["points"][..., [0, 2]] @ turn, layer)
            if shape.kind in TIES:
                getattr(self, f"_{shape.kind}")(sheet, shape, points, {"zorder": layer}, moment)

    def _draw_mark(self, sheet: Sheet, mark: Item, page: FloatArray, layer: float) -> None:
        kind, tone, size, edge = mark["kind"], self._tone(mark["colour"]), mark.get("size", 0.0), mark.get("edge", INK)
        width = 0.0 if edge == mark["colour"] else _BORDERS[edge]
        border: dict[str, Any] = {"facecolor": tone, "edgecolor": self._tone(edge), "linewidth": width}
        if kind == "line":
            sheet.line(page, color=tone, linewidth=mark["width"], solid_joinstyle="round", zorder=layer)
        elif kind == "edges":
            sheet.lines(page.reshape(-1, 2, 2), [tone], mark["width"], capstyle="round", zorder=layer)
        elif kind == "mesh" and "edge" not in mark:
            sheet.polygons(list(page[mark["faces"]]), [tone], [tone], linewidth=0.4, zorder=layer)
        elif kind == "mesh":
            sheet.polygon(page, **border, zorder=layer)
        elif mark.get("is_pin"):
            style: dict[str, Any] = {
                "markerfacecolor": tone,
                "markeredgecolor": border["edgecolor"],
                "markeredgewidth": 1.4,
            }
            sheet.line(page, marker="o", markersize=5.5, linestyle="none", zorder=layer, **style)
        else:
            sheet.circle(page[0], size, **border, zorder=layer)

    def _tone(self, colour: str) -> tuple[float, float, float]:
        """Return a colour as strongly as is being drawn."""
        from matplotlib.colors import to_rgb

        r, g, b = (self.share * part + 1.0 - self.share for part in to_rgb(colour))
        return r, g, b

    # -- what is fixed to a node ------------------------------------------------------------------------------------

    @cached_property
    def marks(self) -> list[tuple[Shape, list[Item]]]:
        """What is fixed to the first node of each shape, first what is behind."""
        return [(shape, self._marks_of(shape)) for shape in self.picture.shapes]

    def _marks_of(self, shape: Shape) -> list[Item]:
        here = {"kind": "disc", "points": np.zeros((1, 3))}
        if shape.kind == "ground":
            place = self.picture.points[shape.nodes[0]][0]
            return [line_of(line - place, width, INK) for line, width in self._ground_lines(shape, place)]
        if shape.surface is not None:
            page = shape.surface.vertices * [1.0, 0.0, 1.0]
            faces, borders = seen_from_front(shape.surface)
            solid = {"kind": "mesh", "points": page}
            found = [{**solid, "faces": seen, "colour": colour} for colour, seen in faces.items() if len(seen)]
            return [*found, {"kind": "edges", "points": page[borders].reshape(-1, 3), "width": 1.3, "colour": INK}]
        if shape.line is not None:
            return [line_of(shape.line, 1.6, GREY)]
        if shape.kind == "spiral":
            turn = np.linspace(0.0, 5.0 * np.pi, 80)
            out = self.unit * (0.6 + 2.2 * turn / turn[-1])
            return [line_of(np.column_stack([out * np.cos(turn), out * np.sin(turn)]), 1.1, INK)]
        if shape.kind == "pivot":
            return [{**here, "size": 0.8 * self.unit, "colour": WHITE, "edge": INK, "is_pin": True}]
        if shape.kind == "pulley":
            radius = self.picture.radii.get(shape.nodes[0], 2.2 * self.unit)
            sizes = {PALE: 0.97 * radius, INK: min(0.16 * radius, self.unit)}
            return [{**here, "size": size, "colour": colour, "edge": INK} for colour, size in sizes.items()]
        if shape.kind == "mass" and shape.size > 0.0:
            half, corners = self._mass_outline(shape)
            look = {"colour": self.colour(shape), "edge": WHITE}
            if corners is None:
                return [{**here, "size": half, **look}]
            return [{"kind": "mesh", "points": flat(corners), "faces": np.array([[0, 1, 2, 3]]), **look}]
        return []

    def _ground_lines(self, shape: Shape, place: FloatArray) -> list[tuple[FloatArray, float]]:
        """Return the lines that stand for what is fixed at a place, m, and their widths, points."""
        x, z = place
        u = self.unit
        direction = self.picture.direction
        if direction == "across":  # a wall
            middle = np.mean([p[:, 0].mean() for p in self.picture.points.values()])
            out = -1.0 if x <= middle else 1.0
            wall = [([(x, z - 5 * u), (x, z + 5 * u)], 1.6)]
            hatches = [[(x, z + k * u), (x + 1.8 * u * out, z + (k - 1.8) * u)] for k in np.linspace(-4, 5, 6)]
            return [(np.array(line), width) for line, width in (*wall, *((one, 0.9) for one in hatches))]
        radius = max((self.picture.radii.get(node, 0.0) for node in self._grooves_at(shape)), default=0.0)
        side = 1.0 if direction or z >= self.middle else -1.0  # the mechanism hangs below it or stands on it
        top = z + (1.35 * radius if radius else 0.0) + (0.0 if direction else 2.6 * u * side)
        lines = [([(x - 4 * u, top), (x + 4 * u, top)], 1.6)]
        for k in np.linspace(-4, 2.4, 5):
            lines.append(([(x + k * u, top), (x + (k + 1.6) * u, top + 1.6 * u * side)], 0.9))
        if radius:
            lines.append(([(x, z), (x, top)], 1.4))
        elif not direction:
            lines.append(([(x - 1.8 * u, top), (x, z), (x + 1.8 * u, top)], 1.2))
        return [(np.array(line), width) for line, width in lines]

    def _grooves_at(self, shape: Shape) -> list[int]:
        """Return the grooves of the pulleys that a ground carries."""
        return [s.nodes[0] for s in self.picture.shapes if s.kind == "pulley" and s.nodes[-1] in shape.nodes]

    def _mass_outline(self, shape: Shape) -> tuple[float, FloatArray | None]:
        """Return half the size of a mass as it is drawn, m, and its corners from its place where it is no disc, m."""
        half = 3.4 * self.unit * (shape.size / self.heaviest) ** (1.0 / 3.0)
        half = max(half, 1.1 * self.unit)
        half *= min(1.0, 8.0 / len(self.heavy))
        if self.picture.direction == "up":
            low, high = (-half, -2.0 * half), (half, 0.0)
        elif self.picture.direction or shape.nodes[0] in self.sliding:
            low, high = (-1.4 * half, -half), (1.4 * half, half)
        else:
            return half, None
        return half, np.array([low, (high[0], low[1]), high, (low[0], high[1])])

    # -- what goes between nodes ------------------------------------------------------------------------------------

    def _rail_ends(self, shape: Shape) -> FloatArray | None:
        """Return the ends of the straight line along which something slides in the world; None if the line moves."""
        base, rider = (self.picture.points[node] for node in shape.nodes)
        if np.max(np.ptp(base, axis=0)) > 1e-6 * self.picture.extent:
            return None
        middle = rider.mean(axis=0)
        axes = decompose(rider - middle, is_whole=False).right
        along, aside = ((rider - middle) @ axis for axis in axes)
        if np.ptp(along) < 1e-9 * self.picture.extent or np.ptp(aside) > 1e-3 * self.picture.extent:
            return None
        reach = np.array([along.min(), along.max()]) + np.array([-6.0, 6.0]) * self.unit
        if shape.size:  # it rolls on a line through the base
            below = base.mean(axis=0) - middle
            middle = middle + below - (below @ axes[0]) * axes[0]
            reach += np.array([-1.0, 1.0]) * shape.size
        return np.asarray(middle + reach[:, None] * axes[0])

    def _rail(self, sheet: Sheet, shape: Shape, points: FloatArray, look: dict[str, Any], moment: int) -> None:
        ends = self.rails[shape.part]
        if ends is None and not shape.size:  # a line that moves goes from the base to what slides on it
            sheet.line(points, color=self._tone(GREY), linewidth=1.2, **look)
        elif ends is not None:
            sheet.line(ends, color=GREY, linewidth=1.2, zorder=1.5, solid_capstyle="round")

    def _rod(self, sheet: Sheet, shape: Shape, points: FloatArray, look: dict[str, Any], moment: int) -> None:
        sheet.line(points, color=self._tone(INK), linewidth=2.0, solid_capstyle="round", **look)

    def _link(self, sheet: Sheet, shape: Shape, points: FloatArray, look: dict[str, Any], moment: int) -> None:
        front = look["zorder"]
        for colour, width in ((INK, 8.0), (STEEL, 5.6)):
            tone = self._tone(colour)
            sheet.line(points, color=tone, linewidth=width, solid_capstyle="round", zorder=front)

    def _spring(self, sheet: Sheet, shape: Shape, points: FloatArray, look: dict[str, Any], moment: int) -> None:
        line = _zigzag(points[0], points[1], 1.6 * self.unit)
        sheet.line(line, color=self._tone(INK), linewidth=1.3, solid_joinstyle="round", **look)

    def _damper(self, sheet: Sheet, shape: Shape, points: FloatArray, look: dict[str, Any], moment: int) -> None:
        a, b = points
        along, across, length = _directions(a, b)
        half, middle = 1.5 * self.unit, 0.5 * (a + b)
        size = min(4.0 * self.unit, 0.25 * length)
        cup = [middle + along * size + across * half, middle - along * size + across * half]
        cup += [middle - along * size - across * half, middle + along * size - across * half]
        piston = [middle + across * half * 0.8, middle - across * half * 0.8]
        for line in ([a, middle - along * size], cup, piston, [middle, b]):
            path = np.array(line)
            sheet.line(path, color=self._tone(INK), linewidth=1.3, **look)

    def _rope(self, sheet: Sheet, shape: Shape, points: FloatArray, look: dict[str, Any], moment: int) -> None:
        spare = self.picture.spare(shape, moment)
        if spare < -1e-6 * self.picture.extent:
            return  # it was let go, and its ends are farther apart than it is long
        if len(points) == 2 and spare > 0.0 and not self.picture.direction:
            points = hanging(points, spare)
            sheet.line(points, color=self._tone(ROPE), linewidth=1.6, **look)
            return
        line = _rope_line(points, [self.picture.radii.get(node, 0.0) for node in shape.nodes])
        sheet.line(line, color=self._tone(ROPE), linewidth=1.6, solid_joinstyle="round", **look)


def flat(points: FloatArray) -> FloatArray:
    """Return places on the page as places in space."""
    return np.asarray(np.insert(points, 1, 0.0, axis=1))


def line_of(points: FloatArray, width: float, colour: str) -> Item:
    """Return a line on the page."""
    return {"kind": "line", "points": flat(points), "width": width, "colour": colour}


def seen_from_front(mesh: Mesh) -> tuple[dict[str, IndexArray], IndexArray]:
    """Return by colour the faces of a surface that look towards the front, and the ends of the edges where they end."""
    front = mesh.normals[:, 1] < -1e-9  # the eye looks along y
    faces = {STEEL: mesh.faces[front & ~mesh.marked], SHADE: mesh.faces[front & mesh.marked]}
    return faces, mesh.border(front)


def draw_trace(sheet: Sheet, points: FloatArray, colour: str) -> None:
    """Draw the path of a point, older parts fainter."""
    from matplotlib.colors import to_rgb

    if len(points) < 2:
        return
    pieces = np.stack([points[:-1], points[1:]], axis=1)
    shares = np.linspace(0.15, 0.8, len(pieces))[:, None]
    colours = shares * np.array(to_rgb(colour)) + 1.0 - shares
    sheet.lines(pieces, colours, 1.3, zorder=1.8, capstyle="round")


def _directions(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return the unit vectors along and across a line, and its length."""
    span = b - a
    length = float(np.hypot(*span))
    along = span / length if length > 0.0 else np.array([1.0, 0.0])
    return along, np.array([-along[1], along[0]]), length


def _zigzag(a: FloatArray, b: FloatArray, half: float, turns: int = 7) -> FloatArray:
    """Return a spring: straight ends, and a zigzag of fixed width between."""
    along, across, length = _directions(a, b)
    shares = np.concatenate([[0.0, 0.12], np.linspace(0.12, 0.88, 2 * turns + 1)[1:-1], [0.88, 1.0]])
    sides = np.zeros(len(shares))
    sides[2:-2] = half * np.where(np.arange(len(shares) - 4) % 2 == 0, 1.0, -1.0)
    return np.asarray(a + along * (shares * length)[:, None] + across * sides[:, None])


def _rope_line(points: FloatArray, radii: list[float]) -> FloatArray:
    """Return a rope over pulleys that lie on vertical columns: straight down on both sides, half a turn between."""
    line = [points[0]]
    for i in range(1, len(points) - 1):
        center, radius = points[i], radii[i]
        if radius == 0.0:
            line.append(center)
            continue
        start = -1.0 if line[-1][0] <= center[0] else 1.0
        over = 1.0 if line[-1][1] <= center[1] else -1.0
        turn = np.linspace(0.0, np.pi, 25)
        arc = center + radius * np.stack([start * np.cos(turn), over * np.sin(turn)], axis=1)
        line += list(arc)
    return np.array([*line, points[-1]])
