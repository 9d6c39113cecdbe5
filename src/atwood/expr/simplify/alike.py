"""Expressions of one shape, as those of equal bodies in a row, rewritten once.

Two groups of expressions have one shape if their nodes, in the order of the graph, are the same operations of nodes at
the same places, with the same numbers. Rewriting sees nothing else of them, so what it makes of one group, with the
nodes of the other in place of its own, serves the other.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence

from atwood.expr.core.analysis import live, substitute
from atwood.expr.core.graph import Expression
from atwood.expr.simplify.collect import collect
from atwood.expr.simplify.polynomial import Effort
from atwood.lazy_dataclasses import dataclass


@dataclass(frozen=True)
class _Rewritten:
    """A group of expressions: its nodes, what became of it, and what that cost."""

    nodes: Sequence[Expression]
    values: list[Expression]
    spent: int


class Alike:
    """Rewrites groups of expressions of one graph as `collect` does.

    Parameters
    ----------
    effort
        What may be spent on all of them; a group of a known shape takes off what its first one did.
    """

    def __init__(self, effort: Effort) -> None:
        self._effort = effort
        self._known: dict[Hashable, _Rewritten] = {}

    def collect(
        self, values: Sequence[Expression], nodes: Sequence[Expression], angles: Sequence[Expression]
    ) -> list[Expression]:
        """Return a group rewritten.

        Parameters
        ----------
        values, nodes
            The expressions, and every node that they need, as `live` gives them.
        angles
            Those of the nodes whose sines and cosines are to be combined.
        """
        shape = _shape(values, nodes, angles)
        known = self._known.get(shape)
        if known is not None and known.spent <= self._effort.left:
            self._effort.left -= known.spent
            return substitute(known.values, dict(zip(known.nodes, nodes, strict=True)))
        before = self._effort.left
        parameters = [node for node in nodes if node.is_symbol and node.is_parametric]
        found = collect(values, angles, parameters, effort=self._effort)
        own = {node.index for node in nodes}
        if self._effort.left >= 0 and all(one.index in own for one in live(found) if one.is_symbol):
            self._known[shape] = _Rewritten(nodes, found, before - self._effort.left)
        return found


def _shape(values: Sequence[Expression], nodes: Sequence[Expression], angles: Sequence[Expression]) -> Hashable:
    place = {node.index: i for i, node in enumerate(nodes)}
    told = [
        (
            node.operation,
            tuple([place[argument.index] for argument in node.arguments]),
            None if node.operation == "symbol" else node.payload,
            node.is_parametric,
        )
        for node in nodes
    ]
    return tuple(told), tuple([place[value.index] for value in values]), tuple([place[one.index] for one in angles])
