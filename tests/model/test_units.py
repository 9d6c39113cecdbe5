import math

import pytest
from hypothesis import given, strategies as st

from atwood import DeclarationError, ParameterError
from atwood.model.values.units import parse_quantity, parse_si_unit, parse_unit, split_quantity, unit_of

EXPONENTS = st.tuples(*[st.integers(-4, 4)] * 4)


@pytest.mark.parametrize(
    ("text", "factor", "exponents"),
    [
        ("1", 1.0, (0, 0, 0, 0)),
        ("N", 1.0, (1, 1, -2, 0)),
        ("kg*m^2", 1.0, (1, 2, 0, 0)),
        ("N/m", 1.0, (1, 0, -2, 0)),
        ("N m s/rad", 1.0, (1, 2, -1, 0)),
        ("km/h", 1000.0 / 3600.0, (0, 1, -1, 0)),
        ("m/s**2", 1.0, (0, 1, -2, 0)),
        ("1/s", 1.0, (0, 0, -1, 0)),
        ("mm^2", 1e-6, (0, 2, 0, 0)),
        ("s^-1", 1.0, (0, 0, -1, 0)),
        ("V/A", 1.0, (1, 2, -3, -2)),
        ("kg · m", 1.0, (1, 1, 0, 0)),
        ("rpm", 2.0 * math.pi / 60.0, (0, 0, -1, 0)),
    ],
)
def test_units_are_read(text, factor, exponents):
    unit = parse_unit(text)
    assert math.isclose(unit.factor, factor)
    assert unit.exponents == exponents


@pytest.mark.parametrize("text", ["m/", "m//s", "kg*", "furlong", "m^", "m^1.5", "3 m", "m)"])
def test_what_is_no_unit_is_refused(text):
    with pytest.raises(DeclarationError):
        parse_unit(text)


def test_a_misspelled_unit_gets_a_hint():
    with pytest.raises(DeclarationError, match="Did you mean"):
        parse_unit("kgg")


@given(EXPONENTS)
def test_the_text_of_a_unit_reads_back(exponents):
    unit = unit_of(exponents)
    assert parse_unit(unit.text).exponents == exponents
    assert parse_si_unit(unit.text).factor == 1.0


@pytest.mark.parametrize("text", ["mm", "deg", "km/h", "kN"])
def test_multiples_are_for_values_not_for_declarations(text):
    with pytest.raises(DeclarationError, match="SI unit"):
        parse_si_unit(text)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_in_text_come_back_exactly(number):
    assert parse_quantity(repr(number), parse_unit("m"), "x") == number
    assert parse_quantity(f"{number!r} m", parse_unit("m"), "x") == number


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [("30 cm", "m", 0.3), ("180deg", "rad", math.pi), ("1e3 g", "kg", 1.0), (" -2 ", "N", -2.0), (".5 kN", "N", 500.0)],
)
def test_quantities(text, unit, value):
    assert math.isclose(parse_quantity(text, parse_unit(unit), "x"), value)


@given(st.integers(-10000, 10000))
def test_decimal_multiples_are_rounded_once(number):
    for text, parts in (("cm", 100), ("mm", 1000)):
        assert parse_quantity(f"{number} {text}", parse_unit("m"), "x") == number / parts


@pytest.mark.parametrize("text", ["", "m", "three m", "nan", "inf", "1 2", "1,5 m", "3 kg", "3 lightyears", "--3"])
def test_other_texts_are_refused_with_the_place(text):
    with pytest.raises(ParameterError, match=r"^rod\.length"):
        parse_quantity(text, parse_unit("m"), "rod.length")


def test_a_text_without_a_number_has_no_quantity():
    assert split_quantity("m") is None
    assert split_quantity("3e2 m/s") == (300.0, "m/s")


def test_hertz_do_not_say_whether_they_count_turns():
    with pytest.raises(ParameterError, match=r"turns or radians.*rpm"):
        parse_quantity("50 Hz", parse_unit("rad/s"), "body.spin.z")
    assert parse_quantity("50 Hz", parse_unit("1/s"), "x") == 50.0
    assert math.isclose(parse_quantity("50 rev/s", parse_unit("rad/s"), "x"), 100.0 * math.pi)


@pytest.mark.parametrize(
    ("text", "exponents"),
    [
        ("kg/(m s^2)", (1, -1, -2, 0)),
        ("Wb", (1, 2, -2, -1)),
        ("(m/s)^2", (0, 2, -2, 0)),
        ("kg m/(s^2 (m/s))", (1, 0, -1, 0)),
        ("1/(m s)", (0, -1, -1, 0)),
    ],
)
def test_units_may_have_brackets(text, exponents):
    assert parse_unit(text).exponents == exponents


@pytest.mark.parametrize("text", ["(m", "m)", "()", "m (", "((m)", "m s)^2", "(m)^", "m1", "m//s", "^2", "m^2^2"])
def test_units_that_cannot_be_read(text):
    with pytest.raises(DeclarationError, match="cannot read the unit"):
        parse_unit(text)


@pytest.mark.parametrize(
    ("written", "plain"),
    [("m²", "m^2"), ("s⁻¹", "1/s"), ("kg·m²", "kg*m^2"), ("H", "Wb/A"), ("F", "C/V"), ("S", "A/V"), ("ohm", "V/A")],
)
def test_raised_digits_and_electric_units(written: str, plain: str) -> None:
    one, other = parse_unit(written), parse_unit(plain)
    assert (one.factor, one.exponents) == (other.factor, other.exponents)


@pytest.mark.parametrize(("unit", "asked"), [("1", "without a unit"), ("m", "in m")])
@pytest.mark.parametrize("text", ["four", "4 kg"])
def test_a_number_is_asked_for_in_a_sentence(unit, asked, text):
    with pytest.raises(ParameterError) as caught:
        parse_quantity(text, parse_unit(unit), "part.corners")
    assert caught.value.advice.endswith(f" {asked}.")
