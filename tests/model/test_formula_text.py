"""Text that may be a formula or a quantity: which of them it is, whatever letters units have."""

import math
from typing import Any

import pytest

from atwood import DeclarationError, ParameterError, Scene, StartError, load_scene, save_scene, simulate, sweep
from atwood.model.values.units import parse_unit
from atwood_library import Drive, Force, Ground, Link, PointMass, Potential, TimeFunction

T = 3.0


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2*t", 2.0 * T), ("-0.1*t", -0.1 * T), ("0.5*t*t", 0.5 * T * T), ("t*2", 2.0 * T), ("1+2*t", 1.0 + 2.0 * T),
        ("2 *t", 2.0 * T), ("2* t", 2.0 * T), ("2·t", 2.0 * T), ("2^t", 2.0**T), ("2/t", 2.0 / T), ("1-t", 1.0 - T),
        ("1e3*t^2", 1e3 * T * T), ("2*sin(t)", 2.0 * math.sin(T)), ("2*min(t,1)", 2.0), ("3*max(t, 5)", 15.0),
        ("pi/2", 0.5 * math.pi), ("7", 7.0), ("-.5e1", -5.0), ("007", 7.0),
        ("30cm", 0.3), ("30 cm", 0.3), ("5J", 5.0), ("2 m/s", 2.0), ("2 min", 120.0), ("3 h", 10800.0), ("1 g", 1e-3),
        ("2 kg.m2", 2.0), ("2 N.m/rad", 2.0), ("2 m.s-2", 2.0), ("2 N*m", 2.0),
    ],
)  # fmt: skip
def test_text_is_a_formula_or_a_quantity(text: str, value: float) -> None:
    assert TimeFunction(function=text).function(T) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "advice"),
    [
        ("2 t", r"'2\*t' for a formula, '2000 kg' for a quantity"),
        ("2t", r"'2\*t' for a formula, '2000 kg' for a quantity"),
        ("2 t^2", r"'2\*t\^2' for a formula"),
        ("5*s", r"'5\*t' for a formula, '5 s' for a quantity"),
        ("5*h", r"'5\*t' for a formula, '5 h' for a quantity"),
        ("2/s", r"'2\*t' for a formula, '2 1/s' for a quantity"),
        ("2*N m", "'2 N m' for a quantity"),
        ("2 sin(t)", r"'2\*sin\(t\)' for a formula"),
        ("3 m + 2*t", "for a formula"),
        ("1,5*t", "1.5, with a point"),
        ("1,5 m", r"a comma before its decimals.*'1\.5 m'"),
        ("1.5.5", "no formula|cannot read"),
    ],
)
def test_what_could_be_both_is_told_with_both_spellings(text: str, advice: str) -> None:
    with pytest.raises(ParameterError, match=advice):
        TimeFunction(function=text)


UNITS = ("t", "h", "g", "m", "s", "min", "J", "N", "F", "T", "A", "C", "H", "S", "V", "W")


@pytest.mark.parametrize("unit", UNITS)
def test_no_unit_is_multiplied_where_a_formula_may_stand(unit: str) -> None:
    size = parse_unit(unit).factor
    if unit == "t":
        assert TimeFunction(function=f"2*{unit}").function(T) == 2.0 * T
        return
    assert TimeFunction(function=f"2 {unit}").function(T) == pytest.approx(2.0 * size, rel=1e-15)
    with pytest.raises(ParameterError, match=f"'2 {unit}' for a quantity"):
        TimeFunction(function=f"2*{unit}")


def test_arguments_that_are_units_are_arguments() -> None:
    assert Potential(energy_function="2*t*x").energy_function(1.5, 0.0, 0.0, T) == 9.0
    with pytest.raises(ParameterError, match=r"'2\*t' for a formula"):
        Potential(energy_function="2 t")


@pytest.mark.parametrize("motion", ["2*t", "-0.1*t", "0.5*t*t", "0.3*sin(2*t)"])
@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_an_input_takes_a_formula(motion: str, form: str, tmp_path: Any) -> None:
    scene = Scene(t_end=1.0)
    ground, drive, mass = scene.add("ground", Ground()), scene.add("drive", Drive()), scene.add("mass", PointMass())
    scene.connect(ground.frame, drive.a)
    scene.connect(drive.b, mass.point)
    scene.set("drive.motion", motion)
    save_scene(scene, tmp_path / "scene.json")
    for one in (scene, load_scene(tmp_path / "scene.json")):
        result = simulate(one, form=form, outputs=11)
        expected = [eval(motion, {"t": t, "sin": math.sin}) for t in result.time]
        assert result["mass.position.x"] == pytest.approx(expected, abs=1e-12)


def test_an_input_without_time_in_it_is_a_number_that_can_be_varied() -> None:
    scene = Scene(gravity=0.0)
    force, mass = scene.add("force", Force(value="3*2")), scene.add("mass", PointMass())
    scene.connect(force.point, mass.point)
    assert scene["force"].value == 6.0
    found = sweep(scene, {"force.value": [1.0, 2.0]}, quantities=["mass.velocity.x"], t_end=1.0)
    assert [row[-1] for row in found["mass.velocity.x"]] == pytest.approx([1.0, 2.0])
    with pytest.raises(ParameterError, match=r"Force.value: '2 t' is no formula.*'2\*t' for a formula, '2 N'"):
        Force(value="2 t")


def test_elsewhere_a_quantity_may_be_written_without_a_space() -> None:
    assert Link(length="30cm").length == Link(length="30*cm").length == 0.3
    with pytest.raises(ParameterError, match=r"a comma before its decimals.*'1\.5 m'"):
        Link(length="1,5 m")
    with pytest.raises(StartError, match="a comma before its decimals"):
        Scene().start["m.position.x"] = "1,5 m"


@pytest.mark.parametrize(
    ("written", "plain"),
    [("kg.m2", "kg*m^2"), ("N.m/rad", "N*m/rad"), ("m/s2", "m/s^2"), ("J/(kg.K)", ""), ("m.s-2", "m/s^2")],
)
def test_units_as_modelica_writes_them(written: str, plain: str) -> None:
    if not plain:
        with pytest.raises(DeclarationError, match="'K' is not a unit"):
            parse_unit(written)
        return
    one, other = parse_unit(written), parse_unit(plain)
    assert (one.factor, one.exponents) == (other.factor, other.exponents)
