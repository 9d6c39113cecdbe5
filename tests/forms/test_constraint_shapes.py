"""Whether constraints may be sums of waves in their unknowns, seen from numbers."""

from __future__ import annotations

import pytest

from atwood.expr import Graph, cos, sin
from atwood.forms.loops.closed_form import Place
from atwood.forms.loops.roots import ConstraintShapes


@pytest.fixture
def shapes():
    """Constraints of two angles x and y, a length s and an angle z that is known."""
    graph = Graph()
    x, y, s, z = (graph.symbol(name) for name in "xysz")
    size = graph.parameter("size")
    values = [
        size * cos(x) + 0.3 * sin(z + y) - 2.0,  # two links
        size * cos(x + y) + 0.3 * sin(z + y) - 2.0,  # the angle of the first is counted from the second
        cos(x) * cos(y) + 0.2 * sin(x),  # a product is left
        size * sin(x - z) + s * cos(z),  # a link and a slide
        s * s + cos(x),
        cos(2.0 * x),
        1e9 * (size * cos(x) + 0.3 * sin(z + y)),
    ]
    here = {x: 0.3, y: 0.8, s: 0.02, z: -1.3}
    return ConstraintShapes(values, (x, y, s, z), Place({size: 0.05}, here, 0.05), here)


@pytest.mark.parametrize(
    ("constraints", "unknowns", "nested", "may_be"),
    [
        ((0,), {0: True, 1: True}, 0.0, True),
        ((6,), {0: True, 1: True}, 0.0, True),
        ((1,), {0: True, 1: True}, 1.0, True),
        ((1,), {0: True, 1: True}, 0.0, False),
        ((1,), {0: True, 1: True}, -1.0, False),
        ((2,), {0: True, 1: True}, 0.0, False),
        ((0, 2), {0: True, 1: True}, 0.0, False),
        ((3,), {0: True, 2: False}, 0.0, True),
        ((4,), {0: True, 2: False}, 0.0, False),
        ((5,), {0: True}, 0.0, False),
        ((0,), {0: True}, 0.0, True),
        ((3,), {2: False}, 0.0, True),
    ],
)
def test_forms_are_told_from_values(shapes, constraints, unknowns, nested, may_be):
    assert shapes.may_be(constraints, unknowns, nested) is may_be
