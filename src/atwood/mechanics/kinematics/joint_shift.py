"""How far apart a joint holds its two nodes, where that depends on how the bodies are turned.

A joint that leaves every rotation free may say its displacement in terms of the axes of its frames: the centre of a
disc that rolls is the higher, the more upright the disc is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from atwood.expr import Expression, Graph, depends_on, jvp, substitute
from atwood.model.local.parts import LocalJoint
from atwood.model.values.rotation import Axes
from atwood.model.values.vector import Vector, cross

__all__ = ["Turned", "displaced", "reads_axes"]

Turned = tuple[Axes, Vector, Vector]
"""Axes of a frame, its angular velocity and its angular acceleration, all in world axes."""


def reads_axes(joint: LocalJoint) -> bool:
    """Return whether a joint's displacement depends on how its frames are turned."""
    symbols = [component for axes in joint.axes for axis in axes for component in axis]
    shift = [s for s in joint.placement.displacement if isinstance(s, Expression)]
    return bool(symbols) and any(depends_on(s, symbols) for s in shift)


def displaced(
    graph: Graph,
    joint: LocalJoint,
    ends: Sequence[Turned],
    moves: Mapping[Expression, tuple[Expression, Expression, Expression]],
) -> tuple[Vector, Vector, Vector]:
    """Return the displacement of a joint and its first two time derivatives, in the axes that it is given in.

    Parameters
    ----------
    graph
        Where expressions live.
    joint
        The joint, on local symbols.
    ends
        How frames a and b are turned.
    moves
        Each of its coordinates with its derivatives.
    """
    first: dict[Expression, Expression | float] = {}
    more: dict[Expression, Expression | float] = {}
    known: dict[Expression, Expression] = {}
    for symbol, (value, rate, second) in moves.items():
        going, changing = graph.symbol(f"{symbol.name}'"), graph.symbol(f"{symbol.name}''")
        first[symbol], more[going] = going, changing
        known.update({symbol: value, going: rate, changing: second})
    for end, (axes, (turned, spin, spin_rate)) in enumerate(zip(joint.axes, ends, strict=True)):
        w, alpha = (Vector(*(graph.symbol(f"{joint.law.name} {kind}{end}.{c}") for c in "xyz")) for kind in "wa")
        more.update(zip(w, alpha, strict=True))
        for local, actual in zip(axes, turned, strict=True):
            first.update(zip(local, cross(w, local), strict=True))
            known.update(zip(local, (graph.convert(c) for c in actual), strict=True))
        known.update(zip((*w, *alpha), (graph.convert(c) for c in (*spin, *spin_rate)), strict=True))
    shift = [graph.convert(value) for value in joint.placement.displacement]
    rates = jvp(shift, first)
    seconds = jvp(rates, {**first, **more})
    placed = substitute([*shift, *rates, *seconds], known)
    return Vector(*placed[0:3]), Vector(*placed[3:6]), Vector(*placed[6:9])
