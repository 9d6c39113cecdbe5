"""Independence of the rows of a sparse matrix, group by group."""

from __future__ import annotations

from collections import defaultdict, deque
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.numerics.rank import is_clear


def independent_by_groups(matrix: Any, groups: NDArray[np.intp]) -> bool:
    """Return whether groups of rows can be taken away, one after another, that are independent of all that is left.

    Such a group has columns in which no other row has entries, and its rows are independent in these. Where loops are
    left the answer is no, whatever their rows are.
    """
    rows_of: dict[int, list[int]] = defaultdict(list)
    for row, group in enumerate(groups.tolist()):
        rows_of[group].append(row)
    starts, indices, entries = matrix.indptr.tolist(), matrix.indices.tolist(), matrix.data.tolist()
    columns_of = {
        group: {column for row in rows for column in indices[starts[row] : starts[row + 1]]}
        for group, rows in rows_of.items()
    }
    users: dict[int, set[int]] = defaultdict(set)
    for group, columns in columns_of.items():
        for column in columns:
            users[column].add(group)
    waiting, gone = deque(rows_of), set[int]()
    while waiting:
        group = waiting.popleft()
        if group in gone:
            continue
        alone = {column: k for k, column in enumerate(c for c in columns_of[group] if len(users[c]) == 1)}
        block = np.zeros((len(rows_of[group]), len(alone)))
        if block.shape[0] > block.shape[1]:
            continue
        for i, row in enumerate(rows_of[group]):
            for k in range(starts[row], starts[row + 1]):
                if indices[k] in alone:
                    block[i, alone[indices[k]]] = entries[k]
        if not is_clear(block):
            continue
        gone.add(group)
        for column in columns_of[group]:
            users[column].discard(group)
            if len(users[column]) == 1:
                waiting.extend(users[column])
    return len(gone) == len(rows_of)
