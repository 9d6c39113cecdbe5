"""Axes in general directions cost hardly more than axes along coordinates, to assemble and to evaluate."""

from __future__ import annotations

import numpy as np
import pytest

from atwood import Scene, assemble
from atwood.expr import evaluate
from atwood.expr.simplify import polynomial
from atwood.expr.simplify.collect import cost
from atwood.forms.accelerations import acceleration_program
from atwood_library import Force, Ground, Link, Pivot, PointMass, RigidBody, Rod, Universal, Weld

SIMPLE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
GENERAL = (2.0 / 3.0, 2.0 / 3.0, 1.0 / 3.0), (-2.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0)


def link_on_a_cross(axes: tuple[tuple[float, ...], tuple[float, ...]], askew: bool) -> Scene:
    scene = Scene(space="space")
    ground, cross = scene.add("ground", Ground()), scene.add("cross", Universal(axis_a=axes[0], axis_b=axes[1]))
    mount = Weld(displacement=(0.1, 0.2, -0.3), angle=0.7, axis=(0.3, 0.5, 0.8)) if askew else Weld()
    weld, link = scene.add("weld", mount), scene.add("link", Link(length=0.8, mass=1.3, axial_moment=0.01))
    scene.connect(ground.frame, cross.a)
    scene.connect(cross.b, weld.a)
    scene.connect(weld.b, link.a)
    return scene


@pytest.mark.parametrize("askew", [False, True])
def test_rows_in_general_axes_are_rewritten_within_a_budget(askew: bool) -> None:
    simple, general = (assemble(link_on_a_cross(axes, askew)) for axes in (SIMPLE, GENERAL))
    prices = [cost(one.rows, one.parameters) for one in (simple, general)]
    assert prices[1] <= 2 * prices[0]
    assert prices[1] < 0.5 * cost(general.reduced.rows, general.parameters)
    assert len(general.reduced.graph) < 6000  # a hundred thousand without a budget

    equations = general.reduced
    known = dict(general.mechanism.table.values) | {equations.time: 0.3}
    symbols = (*equations.coordinates, *equations.speeds, *equations.accelerations)
    known |= dict(zip(symbols, np.linspace(-1.1, 1.7, len(symbols)).tolist(), strict=True))
    np.testing.assert_allclose(evaluate(general.rows, known), evaluate(equations.rows, known), rtol=1e-11)


@pytest.mark.parametrize(("part", "output"), [("pivot", "force.x"), ("rod", "tension")])
def test_accelerations_with_forces_that_read_reactions_are_rewritten_within_a_budget(
    part: str, output: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two million products of terms, and half a minute, were spent on rewriting what gets no shorter."""
    scene = Scene()
    ground, pivot, link = scene.add("ground", Ground()), scene.add("pivot", Pivot()), scene.add("link", Link())
    body, rod = scene.add("body", RigidBody(moments=(0.1, 0.1, 0.1))), scene.add("rod", Rod())
    bob, force = scene.add("bob", PointMass()), scene.add("force", Force(direction=(1.0, 0.0, 0.0)))
    joined = ((ground.frame, pivot.a), (pivot.b, link.a), (link.b, body.frame), (link.b, rod.a), (rod.b, bob.point))
    for a, b in (*joined, (force.point, bob.point)):
        scene.connect(a, b)
    scene.connect(scene[part].output(output), force.input("value"))
    monkeypatch.setenv("ATWOOD_CACHE", "off")
    products = counting_products(monkeypatch)
    assert acceleration_program(assemble(scene)) is not None
    assert 0 < sum(products) < 100_000


def counting_products(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return a list that grows by one with each product of two terms."""
    done: list[int] = []
    before = polynomial.multiply_monomials

    def counted(a: polynomial.Monomial, b: polynomial.Monomial) -> polynomial.Monomial:
        done.append(1)
        return before(a, b)

    monkeypatch.setattr(polynomial, "multiply_monomials", counted)
    return done
