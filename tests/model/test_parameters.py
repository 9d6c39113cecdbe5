import math
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
import sympy
from hypothesis import given, strategies as st

import atwood as aw
from atwood.expr.core.graph import Graph

from .things import Bar, Bob, HeavyBob, Pendulum, Push, Row

BAD_NUMBERS = [
    math.nan,
    math.inf,
    -math.inf,
    True,
    False,
    np.bool_(True),
    None,
    "",
    "one",
    "nan",
    b"3",
    1j,
    [1.0],
    np.array([1.0]),
    {},
    object(),
    10**400,
    Graph().symbol("x"),
    sympy.Symbol("x"),
    Bob,
]


@pytest.mark.parametrize(
    "bad", BAD_NUMBERS, ids=lambda bad: f"{type(bad).__name__}-{str(bad)[:8]}" if type(bad) is not object else "object"
)
def test_what_is_no_finite_number_is_refused_everywhere(bad):
    with pytest.raises(aw.ParameterError, match=r"^Bar\.length: "):
        Bar(length=bad)
    scene = aw.Scene()
    bar = scene.add("bar", Bar(length=1.0))
    with pytest.raises(aw.ParameterError, match=r"^bar\.length: "):
        bar.length = bad
    with pytest.raises(aw.ParameterError, match=r"^bar\.length: "):
        scene.set("bar.length", bad)
    assert bar.length == 1.0
    assert bar.parameters()["length"] == 1.0


@pytest.mark.parametrize(
    "good",
    [
        2,
        2.0,
        np.float64(2),
        np.float32(2),
        np.int64(2),
        np.array(2.0),
        Fraction(2),
        Decimal(2),
        sympy.Integer(2),
        "2 m",
    ],
    ids=repr,
)
def test_every_kind_of_number_becomes_a_float(good):
    length = Bar(length=good).length
    assert type(length) is float
    assert length == 2.0


@given(st.floats(min_value=1e-99, max_value=1e99))
def test_numbers_are_kept_exactly(number):
    assert Bar(length=number).length == number
    assert Bar(length=str(number)).length == number


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"length": 0.0}, "More than 0 m"),
        ({"length": -1}, "too small"),
        ({"count": -1}, "At least 0"),
        ({"count": 51}, "At most 50"),
        ({"count": 1.5}, "whole number"),
        ({"count": "2 m"}, "does not measure"),
        ({"kind": "weak"}, "hard, soft"),
        ({"kind": 3}, "hard, soft"),
        ({"kind": ["hard"]}, "hard, soft"),
        ({"kind": None}, "hard, soft"),
        ({"direction": (1.0, 0.0)}, "3 numbers"),
        ({"direction": 1.0}, "3 numbers"),
        ({"direction": (1.0, math.nan, 0.0)}, "finite"),
        ({"direction": (1.0, True, 0.0)}, "number"),
        ({"direction": {1.0, 2.0, 3.0}}, "3 numbers"),
        ({"limit": "x"}, "not a number"),
        ({"length": "3 kg"}, "Give it in m"),
    ],
)
def test_values_out_of_bounds_or_of_a_wrong_kind(values, words):
    with pytest.raises(aw.ParameterError, match=words) as caught:
        Bar(**{"length": 1.0, **values})
    assert caught.value.where == f"Bar.{next(iter(values))}"


@pytest.mark.parametrize(
    "direction", [(0, 0, 1), [0, 0, 1], "0, 0, 1", "(0,0,1)", np.array([0, 0, 1]), aw.Vector(0, 0, 1)]
)
def test_vectors(direction):
    assert Bar(length=1.0, direction=direction).direction == (0.0, 0.0, 1.0)


def test_counts_words_and_optional_values():
    bar = Bar(length=1.0, count="3", kind="soft", limit=None)
    assert (bar.count, bar.kind, bar.limit) == (3, "soft", None)
    assert type(bar.count) is int
    assert len(bar.hooks) == 3
    assert list(bar.connectors()) == ["a", "b", "hooks[0]", "hooks[1]", "hooks[2]"]


def test_a_parameter_without_default_is_required():
    with pytest.raises(aw.ParameterError, match="must be given") as caught:
        Bar()
    assert "Length." in caught.value.advice


def test_an_unknown_name_gets_a_near_match_however_it_is_given():
    with pytest.raises(aw.ParameterError, match="Did you mean 'length'"):
        Bar(lenght=1.0)
    with pytest.raises(aw.ParameterError, match="Did you mean 'mass'"):
        Bob(Mass=1.0)
    bob = Bob()
    with pytest.raises(aw.ParameterError, match="Did you mean 'mass'"):
        bob.mas = 1.0
    scene = aw.Scene()
    scene.add("pendulum", Pendulum())
    with pytest.raises(aw.ParameterError, match=r"^pendulum\.bar: .*Did you mean 'length'"):
        scene.set("pendulum.bar.lengthh", 1.0)
    with pytest.raises(aw.UsageError, match="Did you mean 'pendulum'"):
        scene.set("pendulun.bar.length", 1.0)
    with pytest.raises(aw.ParameterError, match="Use replace"):
        scene.pendulum = Pendulum()
    with pytest.raises(aw.ParameterError, match="Did you mean 'gravity'"):
        scene.set("gravit", 1.0)
    with pytest.raises(aw.UsageError):
        del bob.mass


def test_a_changed_default_is_inherited_and_checked():
    assert HeavyBob().mass == 5.0
    assert Bob().mass == 1.0
    assert HeavyBob(mass=2).mass == 2.0
    with pytest.raises(aw.ParameterError, match=r"^Wrong\.mass"):

        class Wrong(Bob):
            mass = -1.0


def test_defaults_are_checked_when_the_class_is_made():
    for default in (-1.0, math.nan, True, "3 kg"):
        with pytest.raises(aw.ParameterError, match=r"^Wrong\.length"):

            class Wrong(aw.Component):
                length: float = aw.parameter(default, unit="m", minimum=0.0, doc="Length.")


def test_a_default_can_depend_on_other_parameters():
    class Ring(aw.Component):
        radius: float = aw.parameter(2.0, unit="m", doc="Radius.")
        width: float = aw.parameter(radius / 4, unit="m", above=0.0, doc="Width.")

    class Thin(Ring):
        width = Ring.radius / 100

    assert Ring().width == 0.5
    assert Ring(radius=8.0).width == 2.0
    assert Ring(width=3.0).width == 3.0
    assert Thin(radius=5.0).width == 0.05
    ring = Ring(radius=-1.0)
    with pytest.raises(aw.ParameterError, match=r"^Ring\.width"):
        _ = ring.width


def test_declarations_that_cannot_mean_anything():
    with pytest.raises(aw.DeclarationError, match="meaning"):
        aw.parameter(1.0, doc=" ")
    with pytest.raises(aw.DeclarationError, match="meaning"):
        aw.signal(doc="")
    with pytest.raises(aw.DeclarationError, match="doc cannot be"):
        aw.connector(aw.Point, "")
    with pytest.raises(aw.DeclarationError, match="SI unit"):
        aw.parameter(1.0, unit="mm", doc="x")
    with pytest.raises(aw.DeclarationError, match="not a unit"):
        aw.observable(unit="newton", doc="x")
    with pytest.raises(aw.DeclarationError, match="second name"):

        class Twice(aw.Component):
            a: float = aw.parameter(1.0, doc="A.")
            b: float = a

    with pytest.raises(aw.DeclarationError, match="every Component"):

        class Reserved(aw.Component):
            time: float = aw.parameter(1.0, doc="Time.")

    with pytest.raises(aw.DeclarationError, match="every Model"):

        class ReservedPart(aw.Model):
            add: Bob = Bob()


def test_all_bases_count():
    class Sized(aw.Component):
        size: float = aw.parameter(1.0, unit="m", doc="Size.")

    class Weighted(aw.Component):
        weight: float = aw.parameter(2.0, unit="N", doc="Weight.")
        point: aw.Point = aw.connector(aw.Point, "Somewhere.")

    class Both(Sized, Weighted):
        size = 3.0

    both = Both(weight=4.0)
    assert both.parameters() == {"weight": 4.0, "size": 3.0}
    assert list(both.connectors()) == ["point"]


# -- values that are worked out later ---------------------------------------------------------------------------------

LENGTH, MASS, COUNT = Pendulum.length, Pendulum.mass, Row.n
NUMBERS = st.floats(min_value=0.1, max_value=10.0)


@given(length=NUMBERS, factor=NUMBERS)
def test_deferred_arithmetic_gives_what_floats_give(length, factor):
    made = [
        (LENGTH * factor, length * factor),
        (factor * LENGTH, factor * length),
        (LENGTH / factor, length / factor),
        (factor / LENGTH, factor / length),
        (LENGTH + factor, length + factor),
        (factor - LENGTH, factor - length),
        (LENGTH - factor, length - factor),
        (LENGTH**2, length**2),
        (-LENGTH, -length),
        ((LENGTH + 1) * 2 - LENGTH / 3, (length + 1) * 2 - length / 3),
    ]
    model = Pendulum(length=length)
    for deferred, value in made:
        assert deferred.value_in(model) == value


@pytest.mark.parametrize(
    ("deferred", "unit"),
    [
        (LENGTH * 2, "m"),
        (-LENGTH, "m"),
        (LENGTH + 1, "m"),
        (1 / LENGTH, "1/m"),
        (LENGTH * LENGTH, "m^2"),
        (LENGTH**3, "m^3"),
        ((LENGTH * LENGTH) ** 0.5, "m"),
        (MASS * LENGTH**2, "kg*m^2"),
        (LENGTH / LENGTH, "1"),
        (COUNT * LENGTH, "m"),
        (2.0**COUNT, "1"),
    ],
)
def test_deferred_arithmetic_knows_its_unit(deferred, unit):
    assert deferred.unit.text == unit


def test_deferred_values_in_wrong_units_are_refused():
    with pytest.raises(aw.ParameterError, match=r"Bar\.length: .*'?mass'?.* in kg"):
        Bar(length=MASS)
    with pytest.raises(aw.ParameterError, match="in m\\^2"):
        Bar(length=LENGTH * LENGTH)
    with pytest.raises(aw.DeclarationError, match="Only values in one unit"):
        LENGTH + MASS
    with pytest.raises(aw.ParameterError, match="in m"):
        Push(value=LENGTH)
    Bar(length=LENGTH**0.5)  # a unit that cannot be told is not judged


@pytest.mark.parametrize(
    "attempt",
    [
        lambda: LENGTH + "3 cm",
        lambda: LENGTH * True,
        lambda: LENGTH * math.nan,
        lambda: LENGTH * Bob(),
        lambda: Bar.direction * 2,
        lambda: Bar.kind + 1,
        lambda: aw.sqrt(LENGTH),
        lambda: LENGTH**MASS,
    ],
)
def test_arithmetic_that_means_nothing_is_refused(attempt):
    with pytest.raises(aw.DeclarationError):
        attempt()


def test_a_bound_value_is_checked_when_the_model_has_its_own():
    class Inverse(aw.Model):
        size: float = aw.parameter(1.0, unit="m", doc="Size.")
        bar: Bar = Bar(length=1.0 / size * size * size)

    assert Inverse(size=2.0).bar.length == 2.0
    model = Inverse(size=-2.0)
    with pytest.raises(aw.ParameterError, match=r"bar\.length: .*too small"):
        _ = model.bar.length
    model = Inverse(size=0.0)
    with pytest.raises(aw.ParameterError, match=r"bar\.length: .*worked out"):
        _ = model.bar.length


def test_a_value_bound_to_a_parameter_that_is_not_there():
    scene = aw.Scene()
    bar = scene.add("bar", Bar(length=LENGTH))
    with pytest.raises(aw.ParameterError, match=r"bound to 'length', which the Scene around it does not have"):
        _ = bar.length


# -- inputs -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "function",
    [
        lambda t: math.sin(t),
        lambda t: np.sin(t) if t > 1 else 0.0,
        lambda: 3.0,
        lambda t: None,
        lambda t: "three",
        lambda t: t.nonsense,
        lambda t: [t, t],
        Bob,
        print,
    ],
)
def test_a_function_of_time_that_cannot_be_compiled_is_refused_at_once(function):
    with pytest.raises(aw.ParameterError, match=r"^Push\.value: .*atwood\.sin") as caught:
        Push(value=function)
    assert "expression" in caught.value.message


def test_inputs_take_numbers_text_and_functions():
    assert Push(value=3).value == 3.0
    assert Push(value="2 kN").value == 2000.0
    assert Push().value == 0.0
    assert Push(value=lambda t: 2 * aw.sin(t)).value(0.0) == 0.0
    with pytest.raises(aw.ParameterError):
        Push(value=math.nan)
    with pytest.raises(aw.ParameterError):
        Push(value="3 m")


def test_a_subclass_can_change_what_drives_an_input():
    class Shake(Push):
        value = lambda t: aw.cos(t)  # noqa: E731

    assert Shake().value(0.0) == 1.0


def test_reading_outside_a_law_says_so():
    bar = Bar(length=1.0)
    for attempt in (lambda: bar.time, lambda: bar.a.position, lambda: bar.angle(), lambda: bar.reaction("tension")):
        with pytest.raises(aw.UsageError, match="only inside a law"):
            attempt()


@pytest.mark.parametrize(("make", "name"), [(lambda: Bob(1), "Bob"), (lambda: Pendulum(3.0), "Pendulum")])
def test_parameters_are_given_by_name(make, name):
    with pytest.raises(aw.errors.ParameterError, match=rf"{name}: its parameters are given by name\. Write {name}\("):
        make()
