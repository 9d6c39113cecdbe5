"""A scene of a structure that was run before uses its equations again, and gives what it would give by itself."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from types import ModuleType
from typing import Any

import pytest
from numpy.testing import assert_array_equal

from atwood import Model, Result, Scalar, Scene, cos, potential, simulate, sin
from atwood.forms.reassembly import STRUCTURES
from atwood_library import Force, Ground, PointMass, Spring
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


LEFT, MIDDLE, RIGHT, SHAPE = 1.0, 2.0, 1.0, sin


class ByPlace(Spring):
    """A spring whose law reads several numbers, two of which are one object, and a function."""

    @potential
    def elastic_energy(self) -> Scalar:
        return 0.5 * (LEFT + 10.0 * MIDDLE + 20.0 * RIGHT) * SHAPE(self.length()) ** 2


@pytest.mark.parametrize("changed", [{"LEFT": MIDDLE}, {"SHAPE": cos}])
def test_what_laws_read_is_compared_place_by_place(changed: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    alone(hanging(None, ByPlace))
    for name, value in changed.items():
        monkeypatch.setitem(globals(), name, value)
    after = run(hanging(None, ByPlace))
    same(after, alone(hanging(None, ByPlace)))


class Setting:
    """An object that a function reads."""

    rate = 1.0

    def pull(self, t: float) -> float:
        return self.rate * t


SETTING = Setting()


def pull_by_global() -> Callable[[float], float]:
    return lambda t: LEFT * t


NUMBERS = {"rate": 10.0}


def pull_by_table() -> Callable[[float], float]:
    values = NUMBERS
    return lambda t: values["rate"] * t


def pull_by_places() -> Callable[[float], float]:
    left, middle, right = LEFT, MIDDLE, RIGHT
    return lambda t: left * t + middle * t**2 + right * t**3


def pull_by_wrapper() -> Callable[[float], float]:
    rate = LEFT
    inner = functools.wraps(math.sin)(lambda t: rate * t)
    return lambda t: inner(t)


def pull_by_scene() -> Callable[[float], float]:
    other = Scene()
    other.gravity = LEFT
    return lambda t: other.gravity * t


def pull_by_attribute() -> Callable[[float], float]:
    return lambda t: SETTING.rate * t


def pull_by_sign() -> Callable[[float], float]:
    zero = math.copysign(0.0, 1.5 - LEFT)
    return lambda t: math.copysign(1.0, zero) * t


PULLS = [pull_by_global, pull_by_table, pull_by_places, pull_by_wrapper, pull_by_scene, pull_by_attribute, pull_by_sign]


GIVEN = [pull_by_global(), pull_by_table()]


@pytest.mark.parametrize("make", [*PULLS, lambda: GIVEN[0], lambda: GIVEN[1], lambda: SETTING.pull])
def test_functions_of_time_are_compared_by_what_they_give(
    make: Callable[[], Callable[[float], float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever they read may change where nobody sees it; what they give is written down as a scene is taken apart."""

    def pulled() -> Scene:
        scene = hanging(None, Spring)
        force = scene.add("force", Force(direction="x", value=make()))
        scene.connect(force.point, scene["mass"].point)
        return scene

    before = alone(pulled())
    again = run(pulled())
    assert again.assembly.shared.family is before.assembly.shared.family
    monkeypatch.setitem(globals(), "LEFT", MIDDLE)
    monkeypatch.setitem(NUMBERS, "rate", 30.0)
    monkeypatch.setattr(SETTING, "rate", 3.0)
    after = run(pulled())
    same(after, alone(pulled()))
    assert after["mass.acceleration.x"][-1] != before["mass.acceleration.x"][-1]


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
