"""The rank of the constraints of large scenes."""

from typing import Any

import numpy as np
import pytest

from atwood.simulation.dynamics import redundancy
from atwood_library.scenes import Chain

from ...helpers.runs import prepare


def test_nothing_of_the_size_of_a_tree_is_decomposed(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes: list[int] = []
    svd = np.linalg.svd

    def seen(matrix: Any, *arguments: Any, **options: Any) -> Any:
        sizes.append(max(np.shape(matrix)))
        return svd(matrix, *arguments, **options)

    monkeypatch.setattr(np.linalg, "svd", seen)
    links = 150
    prepared = prepare(Chain(links=links), "dae")
    finding = redundancy.find_rank(prepared.plan.balance, 0.0, prepared.q, prepared.plan.sizes)
    assert finding.kept == tuple(range(links))
    assert not finding.redundant
    assert finding.rank == finding.rank_at_start == links
    assert max(sizes) <= 4
