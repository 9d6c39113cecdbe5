"""Relations of functions of time alone: with the values that they have, expressions are what they were written as."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from typing import Any

import pytest

from atwood import absolute, acos, asin, atan, atan2, cos, maximum, minimum, select, sign, sin, sqrt, tan
from atwood.errors import AtwoodError
from atwood.expr import Graph, evaluate
from atwood.expr.core.functions import floor
from atwood.expr.core.relations import TimeRelations, values_just_after


def formula(t: Any, depth: int, draw: random.Random) -> Any:
    """Return a function of time, drawn at random; the same for expressions and for numbers."""
    if not depth:
        return draw.choice([lambda: t, lambda: -1.5, lambda: 0.0, lambda: 2.0, lambda: 0.7 * t, lambda: 1.0 - t])()

    def part() -> Any:
        return formula(t, depth - 1, draw)

    ways: list[Callable[[], Any]] = [
        lambda: sin(3.0 * part()),
        lambda: part() + part(),
        lambda: part() * part(),
        lambda: minimum(part(), part()),
        lambda: maximum(part(), part()),
        lambda: select(part() < part(), part(), part()),
        lambda: absolute(part()),
        lambda: sign(part()),
        lambda: floor(part() + 0.123),
        lambda: atan2(part(), part()),
        lambda: asin(sin(part())),
        lambda: acos(cos(part())),
        lambda: atan(tan(part())),
        lambda: sqrt(absolute(part())),
    ]
    return draw.choice(ways)()


@pytest.mark.parametrize("seed", range(20))
def test_an_expression_has_the_value_of_its_formula(seed: int) -> None:
    draw = random.Random(seed)
    for _ in range(20):
        own, moment = draw.random(), draw.uniform(-3.0, 3.0)
        graph = Graph()
        time = graph.symbol("t")
        graph.relations = TimeRelations(time)
        with graph.relations.reading():
            expression = graph.convert(formula(time, 3, random.Random(own)))
        try:
            wanted = formula(moment, 3, random.Random(own))
        except AtwoodError:
            continue
        relations = graph.relations.found
        known = dict(zip(graph.relations.symbols, values_just_after(relations, {}, moment), strict=True))
        assert evaluate([expression], {time: moment, **known})[0] == pytest.approx(wanted, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize(("factor", "before"), [(1.0, 0.0), (-1.0, 1.0)])
def test_a_whole_number_is_left_to_the_side_that_comes_next(factor: float, before: float) -> None:
    """However slowly it is left: the rate of 1e-20 is far below the rounding of the number itself."""
    graph = Graph()
    time = graph.symbol("t")
    graph.relations = TimeRelations(time)
    with graph.relations.reading():
        floor(1.0 + factor * 1e-20 * time)
    assert values_just_after(graph.relations.found, {}, 0.0) == (1.0 - before,)


def test_an_angle_with_one_side_fixed_is_split_where_it_comes_round() -> None:
    graph = Graph()
    time = graph.symbol("t")
    graph.relations = TimeRelations(time)
    with graph.relations.reading():
        angle = atan2(time, -1.0)
    assert [one.difference for one in graph.relations.found] == [time]
    (is_below,) = graph.relations.symbols
    for value, moment, wanted in ((1.0, 0.0, -math.pi), (0.0, 0.0, math.pi), (0.0, 1.0, 0.75 * math.pi)):
        assert evaluate([angle], {time: moment, is_below: value})[0] == pytest.approx(wanted)
