"""Rows of the table of contacts, each in one of its views and in one form; `python -m tests.contact_table` has all."""

from __future__ import annotations

import pytest

from .rows import ROWS
from .views import VIEWS


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("row", ROWS)
def test_a_scene_with_contacts_has_the_answer_that_is_known(row: str, view: str, form: str) -> None:
    for what, found, known in ROWS[row].check(VIEWS[view], form):
        assert found == pytest.approx(known, rel=0.0, abs=ROWS[row].off), what
