"""Broken scenes are refused by part and remedy: each way to break one, twice."""

from __future__ import annotations

import random

import pytest

from .broken import BREAKS, attempt


@pytest.mark.parametrize("how", BREAKS, ids=lambda one: one.__name__)
def test_a_broken_scene_is_refused_with_part_and_remedy(how) -> None:
    for seed in (11, 12):
        outcome, finding = attempt(random.Random(seed), how)
        assert finding is None, f"{outcome}: {finding}"
