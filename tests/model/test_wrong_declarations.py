"""Class bodies of components that mean nothing are refused when they are read, with a name and a remedy."""

from __future__ import annotations

import math
from typing import Any

import pytest

import atwood as aw
from atwood_library import PointMass


def energy(self: Any) -> Any:
    """Return an energy."""
    return self.a.position.x


def body(**more: Any) -> dict[str, Any]:
    """Return a class body with a connector, a parameter, and more."""
    a, k = aw.connector(aw.Point, "Where it acts."), aw.parameter(1.0, unit="N", doc="A force.")
    return {"__annotations__": {"a": aw.Point, "k": float}, "a": a, "k": k, **more}


def fresh(function: Any) -> Any:
    """Return a function that nobody has marked."""
    return lambda self: function(self)


def held(reaction: Any) -> Any:
    """Return a constraint with a reaction of a name."""
    return _named(aw.constraint(reaction=reaction, unit="N", doc="A force."), fresh(energy), "hold")


def told() -> Any:
    """Return an observable."""
    return aw.observable(unit="J", doc="An energy.")(fresh(energy))


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: aw.constraint(fresh(energy)), r"constraint: its arguments have no order. Give them by name"),  # type: ignore[call-arg, misc]
        (lambda: aw.observable(fresh(energy)), r"observable: its arguments have no order. Give them by name"),  # type: ignore[call-arg, misc]
        (lambda: aw.event(fresh(energy)), r"event: its arguments have no order. Give them by name"),  # type: ignore[call-arg, misc]
        (lambda: aw.potential(aw.dissipation(fresh(energy))), "marked as dissipation and as potential"),
        (lambda: held("lambda"), "reaction cannot be 'lambda'. Give a name"),
        (lambda: held("two words"), "reaction cannot be 'two words'. Give a name"),
        (lambda: body(hold=held("k")), "Wrong.hold: its reaction 'k' has the name of something else"),
        (lambda: body(hold=held("a.x")), "Wrong.hold: its reaction 'a.x' has the name of something else"),
        (lambda: body(hold=aw.potential(fresh(energy)), potential_energy=told()), "the potential energy is a quantity"),
        (lambda: body(law=property(aw.potential(fresh(energy)))), "Wrong.law: a property is no law"),
        (lambda: body(spaces=3), "Wrong: spaces cannot be 3. Give a tuple"),
        (lambda: body(spaces=()), r"Wrong: spaces cannot be \(\). Give a tuple"),
        (lambda: body(spaces=("plain",)), "Did you mean 'plane'"),
        (lambda: body(modes=3), "Wrong: modes cannot be 3. Give a tuple of names"),
    ],
)
def test_a_class_body_that_means_nothing_is_refused(make: Any, said: str) -> None:
    with pytest.raises(aw.AtwoodError, match=said):
        type(aw.Component)("Wrong", (aw.Component,), make())


def run(more: dict[str, Any]) -> aw.Result:
    """Run a scene with a part of a class with more in its body."""
    scene = aw.Scene(t_end=0.1)
    part = scene.add("part", type(aw.Component)("Mine", (aw.Component,), body(**more))())
    scene.connect(scene.add("mass", PointMass()).point, part.a)
    return aw.simulate(scene, outputs=3)


@pytest.mark.parametrize("value", [math.nan, math.inf])
@pytest.mark.parametrize("mark", [aw.potential, aw.dissipation, aw.event(target="stop", message="It stops.")])
def test_a_law_that_is_never_finite_is_refused(mark: Any, value: float) -> None:
    """An event that returns nan would never happen, and nobody would know."""

    def never(self: Any) -> float:
        return value

    with pytest.raises(aw.DeclarationError, match=r"part\.law: it returns"):
        run({"law": _named(mark, never)})


def _named(mark: Any, function: Any, name: str = "law") -> Any:
    function.__name__ = name
    return mark(function)


def test_a_quantity_that_reads_a_misspelt_name_is_no_missing_quantity() -> None:
    def misspelt(self: Any) -> Any:
        return self.a.position.x + self.offest

    with pytest.raises(aw.DeclarationError, match=r"part\.law: the law cannot be evaluated .*offest"):
        _ = run({"law": _named(aw.observable(unit="m", doc="A length."), misspelt)})["part.law"]


def test_an_init_that_forgets_its_base_is_told() -> None:
    def forgetful(self: Any) -> None:
        return None

    wrong = type(aw.Component)("Mine", (aw.Component,), body(__init__=forgetful))
    with pytest.raises(aw.AtwoodError, match=r"Mine: its __init__ does not call"):
        aw.Scene().add("part", wrong())
    with pytest.raises(aw.UsageError, match="Mine cannot be made"):
        aw.check(wrong)
