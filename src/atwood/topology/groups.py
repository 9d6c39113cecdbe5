"""What hangs together."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from typing import TypeVar

__all__ = ["connected_groups"]

T = TypeVar("T", bound=Hashable)


def connected_groups(members: Iterable[T], pairs: Iterable[tuple[T, T]]) -> list[list[T]]:
    """Return groups whose members are connected by pairs, directly or through others.

    Parameters
    ----------
    members
        Everything that belongs to a group, on its own if no pair names it.
    pairs
        Pairs of members.

    Returns
    -------
    list of list
        The groups in the order of their first members, each in the order of the members.
    """
    above: dict[T, T] = {member: member for member in members}

    def root(member: T) -> T:
        top = member
        while above[top] != top:
            top = above[top]
        while above[member] != top:  # so that the way is short next time
            above[member], member = top, above[member]
        return top

    size = dict.fromkeys(above, 1)
    for a, b in pairs:
        low, high = sorted((root(a), root(b)), key=size.__getitem__)
        if low != high:
            above[low] = high
            size[high] += size[low]
    groups: dict[T, list[T]] = {}
    for member in above:
        groups.setdefault(root(member), []).append(member)
    return list(groups.values())
