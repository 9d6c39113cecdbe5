"""What constraints leave free is told by more than rounding."""

from __future__ import annotations

from atwood import assemble, cos, sin
from atwood.expr import Expression, jacobian
from atwood.mechanics.constraints.pfaffian import Places
from atwood.mechanics.constraints.rolling import _depends_on_one
from atwood_library.scenes import DoublePendulum


def test_a_value_that_is_constant_but_for_rounding_depends_on_nothing() -> None:
    """The product of two directions that turn together: as what a guide and a pin between the same two bodies say."""
    assembly = assemble(DoublePendulum())
    equations, mechanism = assembly.reduced, assembly.mechanism
    places, (q, _) = Places(equations, equations.time), equations.coordinates
    length = next(iter(mechanism.table.values))

    def turned(x: float, y: float) -> tuple[Expression, Expression]:
        return cos(q) * x - sin(q) * (y * length), sin(q) * x + cos(q) * (y * length)

    (a, b), (c, d) = turned(0.3, 0.7), turned(1.1, -0.2)
    product = a * c + b * d
    slopes = jacobian([product], [q])
    assert slopes.columns  # no rule of the graph sees that it is zero
    assert not places.certain(mechanism, slopes.entries).any()
    assert _depends_on_one(places, product, mechanism) is None
    assert _depends_on_one(places, product + 1e-6 * sin(q), mechanism) == 0
