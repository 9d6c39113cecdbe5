"""Side by side: where what hangs on ropes on a vertical line stands on the page."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence


def spread_columns(
    ropes: Sequence[tuple[int, ...]],
    others: Sequence[tuple[int, ...]],
    body_of: Mapping[int, int],
    radius: float,
) -> tuple[dict[int, float], dict[int, float], dict[int, float]]:
    """Return columns for bodies and fixed pulleys, and the radii of pulleys, so that ropes hang straight down.

    A rope's ends hang on both sides of its pulley; a pulley that hangs on another rope is half as large, so that what
    hangs on it stays apart.
    """
    columns: dict[int, float] = {0: 0.0}
    places: dict[int, float] = {}
    radii: dict[int, float] = {}
    depth: dict[int, int] = {0: 0}
    waiting, next_fixed = list(ropes), 0.0
    while True:
        ready = [rope for rope in waiting if len(rope) > 2 and any(body_of[node] in columns for node in rope[1:-1])]
        if ready:
            rope = ready[0]
            waiting.remove(rope)
            next_fixed = _hang(rope, body_of, radius, columns, places, radii, depth, next_fixed)
            continue
        if not _follow([*others, *(rope for rope in waiting if len(rope) == 2)], body_of, columns, depth):
            return columns, places, radii


def _hang(
    rope: tuple[int, ...],
    body_of: Mapping[int, int],
    radius: float,
    columns: dict[int, float],
    places: dict[int, float],
    radii: dict[int, float],
    depth: dict[int, int],
    next_fixed: float,
) -> float:
    """Put the ends of a rope on both sides of its pulleys; return where the next fixed pulley may stand."""
    grooves = rope[1:-1]
    known = next(node for node in grooves if body_of[node] in columns)
    level = depth[body_of[known]]
    size = radius / 2.0**level
    at = columns[body_of[known]] if body_of[known] != 0 else next_fixed
    first = at - 2.0 * size * grooves.index(known)
    for i, node in enumerate(grooves):
        radii[node] = size
        if body_of[node] == 0:
            places[node] = first + 2.0 * size * i
            continue
        columns.setdefault(body_of[node], first + 2.0 * size * i)
        depth.setdefault(body_of[node], level + 1)
    last = first + 2.0 * size * (len(grooves) - 1)
    for node, column in ((rope[0], first - size), (rope[-1], last + size)):
        if body_of[node] != 0:
            columns.setdefault(body_of[node], column)
            depth.setdefault(body_of[node], level + 1)
    return next_fixed + 4.0 * radius if body_of[known] == 0 else next_fixed


def _follow(
    parts: Sequence[tuple[int, ...]], body_of: Mapping[int, int], columns: dict[int, float], depth: dict[int, int]
) -> bool:
    """Put what is joined to something in a column below it; return whether anything was."""
    for nodes in parts:
        for one, other in itertools.pairwise(nodes):
            for a, b in ((one, other), (other, one)):
                if body_of[a] in columns and body_of[b] not in columns:
                    columns[body_of[b]] = columns[body_of[a]]
                    depth[body_of[b]] = depth[body_of[a]]
                    return True
    return False
