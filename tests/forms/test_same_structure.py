"""A scene of a structure that was run before uses its equations again, and gives what it would give by itself."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import pytest
from numpy.testing import assert_array_equal

from atwood import Model, Result, Scalar, Scene, potential, simulate
from atwood.forms.reassembly import STRUCTURES
from atwood_library import Ground, PointMass, Spring
from atwood_library.scenes import SCENES, Chain, DoublePendulum, FourBar, StewartPlatform

SPAN = 0.05


def run(scene: Model, **given: Any) -> Result:
    return simulate(scene, t_end=SPAN, outputs=6, **given)


def alone(scene: Model, **given: Any) -> Result:
    """Run a scene as in a process that has seen no other."""
    STRUCTURES.clear()
    return run(scene, **given)


def same(one: Result, other: Result) -> None:
    assert list(one.table()) == list(other.table())
    for path, values in one.table().items():
        assert_array_equal(values, other.table()[path])


@pytest.mark.parametrize(
    "name", ["double-pendulum", "atwood", "four-bar", "cart-pole", "chaplygin-sleigh", "bouncing-ball"]
)
@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_the_same_scene_again(name: str, form: str) -> None:
    """Nothing is derived, and all is the same to the bit."""
    first = alone(SCENES[name](), form=form)
    again = run(SCENES[name](), form=form)
    same(first, again)
    assert again.assembly is not first.assembly
    assert again.assembly.shared.family is first.assembly.shared.family
    assert "mechanism" not in again.timings


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (DoublePendulum(), DoublePendulum(mass2=3.0, length1=0.4)),
        (FourBar(), FourBar(coupler_length=2.6)),
        (Chain(links=3), Chain(links=4)),
        (StewartPlatform(), StewartPlatform(platform_mass=2.0)),
    ],
)
def test_other_values_and_other_structures(one: Model, other: Model) -> None:
    """The second scene gives what it gives alone, whichever came before."""
    expected = alone(other)
    alone(one)
    same(run(other), expected)


def test_another_start_is_found_anew() -> None:
    one, other = DoublePendulum(), DoublePendulum()
    other.start["rod1.angle"] = 0.3
    alone(one)
    found = run(other)
    assert found["rod1.angle"][0] == pytest.approx(0.3)


class Pull(Spring):
    """A spring that keeps something of itself beside its parameters."""


def hanging(share: float | None, kind: type[Spring] = Pull) -> Scene:
    scene = Scene(space="line")
    ground, mass = scene.add("ground", Ground()), scene.add("mass", PointMass(mass=1.0))
    spring = scene.add("spring", kind(stiffness=10.0))
    if share is not None:
        object.__setattr__(spring, "share", share)
    scene.connect(ground.frame, spring.a)
    scene.connect(spring.b, mass.point)
    scene.start["spring.length"] = 0.5
    return scene


def test_parts_that_keep_something_of_themselves_are_read_anew() -> None:
    """Their laws may depend on it."""
    first, again, own = alone(hanging(None)), run(hanging(None)), run(hanging(0.5))
    assert again.assembly.shared is first.assembly.shared
    assert own.assembly.shared is not first.assembly.shared


RATE = 10.0
TABLE = {"rates": [10.0]}
STATES = {10.0}


def rate_of_table() -> float:
    return TABLE["rates"][0]


class ByName(Spring):
    """A spring whose law reads a number of its module."""

    @potential
    def elastic_energy(self) -> Scalar:
        return 0.5 * RATE * self.length() ** 2


class ByTable(Spring):
    """A spring whose law calls a function that reads a table."""

    @potential
    def elastic_energy(self) -> Scalar:
        return 0.5 * rate_of_table() * self.length() ** 2


class BySet(Spring):
    """A spring whose law reads what nobody can compare."""

    @potential
    def elastic_energy(self) -> Scalar:
        return 0.5 * max(STATES) * self.length() ** 2


SETTINGS = ModuleType("settings")
SETTINGS.rate = 10.0  # type: ignore[attr-defined]


class ByModule(Spring):
    """A spring whose law reads a number of another module."""

    @potential
    def elastic_energy(self) -> Scalar:
        return 0.5 * SETTINGS.rate * self.length() ** 2


class ByClass(Spring):
    """A spring whose law reads a number of its class."""

    rate = 10.0

    @potential
    def elastic_energy(self) -> Scalar:
        return 0.5 * self.rate * self.length() ** 2


@pytest.mark.parametrize("kind", [ByName, ByTable, BySet, ByModule, ByClass])
def test_what_laws_read_by_name_may_change(kind: type[Spring], monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a notebook, where a cell changes a number that a law has read."""
    before = alone(hanging(None, kind))
    monkeypatch.setitem(globals(), "RATE", 20.0)
    monkeypatch.setitem(TABLE, "rates", [20.0])
    monkeypatch.setitem(globals(), "STATES", {20.0})
    monkeypatch.setattr(SETTINGS, "rate", 20.0)
    monkeypatch.setattr(ByClass, "rate", 20.0)
    after = run(hanging(None, kind))
    assert after["mass.acceleration.x"][0] - before["mass.acceleration.x"][0] == pytest.approx(-10.0 * 0.5)
    assert after.assembly.shared is not before.assembly.shared


def test_a_law_may_be_changed_in_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """As tools do that load modules again."""
    before = alone(hanging(None, ByName))
    monkeypatch.setattr(ByName.elastic_energy, "__code__", (lambda self: 40.0 * self.length() ** 2).__code__)
    after = run(hanging(None, ByName))
    assert after["mass.acceleration.x"][0] < before["mass.acceleration.x"][0] - 10.0


def test_few_structures_are_remembered() -> None:
    for name in ("double-pendulum", "pendulum-on-cart", "atwood", "four-bar", "kepler"):
        run(SCENES[name]())
    assert [key[0] for key in STRUCTURES] == ["PendulumOnCart", "Atwood", "FourBar", "Kepler"]
