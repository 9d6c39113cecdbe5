"""Groups that hang together, against networkx."""

from __future__ import annotations

from itertools import pairwise

import networkx as nx
from hypothesis import given, strategies as st

from atwood.topology.graph import connected_groups

pairs = st.lists(st.tuples(st.integers(0, 30), st.integers(0, 30)), max_size=40)


@given(st.permutations(range(31)), pairs)
def test_groups_are_the_connected_components(members: list[int], joined: list[tuple[int, int]]) -> None:
    graph: nx.Graph[int] = nx.Graph()
    graph.add_nodes_from(members)
    graph.add_edges_from(joined)
    found = connected_groups(members, joined)
    assert [set(group) for group in found] == list(nx.connected_components(graph))
    place = {member: i for i, member in enumerate(members)}
    assert all(group == sorted(group, key=place.__getitem__) for group in found)


def test_a_long_chain_is_one_group() -> None:
    numbers = range(100_000)
    assert len(connected_groups(numbers, pairwise(numbers))) == 1
    assert len(connected_groups(numbers, pairwise(reversed(numbers)))) == 1
    assert connected_groups([], []) == []
