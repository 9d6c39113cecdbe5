"""Every hard case meets what is asked of it, in every form; those that take long are asked by the command."""

import dataclasses

import pytest

from .case import KINDS, Case, solve
from .cases import CASES

WAYS = [pytest.param(case, way, id=f"{case.name}, {way}") for case in CASES if case.quick for way in case.ways]


@pytest.mark.sample(12)
@pytest.mark.parametrize(("case", "way"), WAYS)
def test_it_meets_what_is_asked(case: Case, way: str) -> None:
    reached = solve(case, way)
    assert reached.status in ("finished", "stopped") or case.refused, reached.status
    assert reached.error <= case.limit(way)


def test_cases_have_names_and_kinds_of_their_own() -> None:
    assert len({case.name for case in CASES}) == len(CASES)
    assert {case.kind for case in CASES} == set(KINDS)


def test_what_should_be_refused_and_is_not_fails() -> None:
    runs = next(case for case in CASES if case.quick and not case.refused)

    assert solve(dataclasses.replace(runs, refused="nothing"), next(iter(runs.ways))).error == float("inf")
