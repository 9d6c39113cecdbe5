"""Elementary functions: right to a unit in the last place, and the same bits however they are computed."""

from __future__ import annotations

import ctypes
import itertools
import math
import random
import struct
from typing import Any

import numpy as np
import pytest

from atwood.codegen.functions import write_routines
from atwood.codegen.javascript.printer import BITS, print_routines as print_javascript
from atwood.codegen.llvm.engine import compile_text, load_code
from atwood.codegen.llvm.own import own_functions
from atwood.codegen.llvm.printer import print_routines
from atwood.expr.core.elementary import FLOATS, FUNCTIONS, ON_ARRAYS, ON_FLOATS, sin_cos

from ..helpers.node import run_node
from ..soak.functions import ARGUMENTS, drawn, units_off
from .test_routines import INTRINSICS

SIMPLE = (0.0, -0.0, 1.0, -1.0, 0.5, -2.5, 3.0, 5e-324, -1e-310, 2.0**-1022, -7e300, 1e17, 1e6, 2.0**53 - 1.0)
CORNERS = (*SIMPLE, math.pi, math.nextafter(1.0, 2.0), 709.9, -745.2, math.inf, -math.inf, math.nan)


def bits(value: float) -> str:
    return "nan" if value != value else struct.pack(">d", value).hex()


def reference(name: str, *given: float) -> float:
    """Return what Python gives, without machine code."""
    found: float = FUNCTIONS[name](FLOATS, *given)[0]
    return found


def arguments_of(name: str, count: int = 12) -> list[tuple[float, ...]]:
    width = len(drawn(name, random.Random(1), 1)[0])
    return [*itertools.product(CORNERS, repeat=width), *drawn(name, random.Random(name), count)]


@pytest.mark.parametrize("name", ARGUMENTS)
def test_a_function_is_right_to_a_unit_in_the_last_place(name: str) -> None:
    arguments = drawn(name, random.Random(5), 160)
    values = ON_ARRAYS[name](*map(np.array, zip(*arguments, strict=True))).tolist()
    assert max(units_off(name, arguments, values)) <= 1.0


def test_the_angle_nearest_to_quarter_turns() -> None:
    for x in (6381956970095103 * 2.0**797, 5.319372648326541416e255, 1.7976931348623157e308, 356207.0, 1e22):
        for name in ("sin", "cos", "tan"):
            assert units_off(name, [(x,)], [ON_FLOATS[name](x)])[0] <= 1.0


@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_corners_are_those_of_ieee_754(name: str) -> None:
    library = getattr(math, name)
    for given in arguments_of(name, 0):
        found = ON_FLOATS[name](*given)
        try:
            expected = library(*given)
        except ValueError:  # Python's way to say what has no value
            assert found != found or math.isinf(found), given
            continue
        except OverflowError:
            assert math.isinf(found), given
            continue
        assert bits(found) == bits(expected) or abs(found - expected) <= math.ulp(expected), (given, found, expected)
        assert found != 0.0 or math.copysign(1.0, found) == math.copysign(1.0, expected), given


def test_what_has_no_value() -> None:
    log, power = ON_FLOATS["log"], ON_FLOATS["pow"]
    assert log(0.0) == log(-0.0) == -math.inf
    assert power(0.0, -3.0) == power(-0.0, -2.0) == math.inf
    assert power(-0.0, -3.0) == -math.inf
    for name in ("sin", "cos", "tan"):
        assert math.isnan(ON_FLOATS[name](math.inf))
    assert all(map(math.isnan, (log(-1.0), power(-2.0, 0.5), ON_FLOATS["asin"](1.5), ON_FLOATS["acos"](-1e300))))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_machine_code_and_python_have_the_same_bits(name: str) -> None:
    arguments = arguments_of(name)
    found = ON_ARRAYS[name](*map(np.array, zip(*arguments, strict=True)))
    for given, value in zip(arguments, found.tolist(), strict=True):
        assert bits(value) == bits(reference(name, *given)) == bits(ON_FLOATS[name](*given)), given


def test_sine_and_cosine_together_are_those_alone() -> None:
    kinds = [ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p]
    call = ctypes.CFUNCTYPE(None, *kinds)(own_functions().addresses["own_sin_cos"])
    found = np.empty(2)
    for [x] in arguments_of("sin"):
        call(x, found.ctypes.data, found.ctypes.data + 8)
        alone = [reference("sin", x), reference("cos", x)]
        assert [*map(bits, found.tolist())] == [*map(bits, alone)] == [*map(bits, sin_cos(FLOATS, x))]


@pytest.mark.parametrize("lanes", [2, 4, 8])
def test_lanes_have_the_bits_of_a_number_alone(lanes: int) -> None:
    names = (*FUNCTIONS, "sin_cos")
    alone, wide = write_routines(names, each=False), write_routines(names, lanes, each=False)
    loaded = load_code(
        compile_text(print_routines([*alone, *wide]) + INTRINSICS, 2, has_variables=True),
        [one.name for one in wide],
        {},
    )
    for name in FUNCTIONS:
        arguments = arguments_of(name, 8)
        arguments += arguments[: -len(arguments) % lanes]
        random.Random(lanes).shuffle(arguments)
        columns = [np.array(one) for one in zip(*arguments, strict=True)]
        call = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * (len(columns) + 1))(loaded.addresses[f"own_{name}_{lanes}"])
        found = np.empty(len(arguments))
        for k in range(0, len(arguments), lanes):
            call(*(one[k:].ctypes.data for one in (*columns, found)))
        assert [*map(bits, found.tolist())] == [*map(bits, ON_ARRAYS[name](*columns).tolist())], name


def test_javascript_has_the_same_bits() -> None:
    given: dict[str, Any] = {name: [[*map(bits, one)] for one in arguments_of(name)] for name in FUNCTIONS}
    code = f"const M = new Float64Array(1000); M[0] = 1;\n{BITS}{print_javascript(write_routines(tuple(FUNCTIONS)))}"
    calls = ", ".join(f"{name}: own_{name}" for name in FUNCTIONS)
    code += f"const own = {{{calls}}}, number = x => x === 'nan' ? NaN : ofBits(x);"
    code += (
        "print(Object.fromEntries(Object.entries(given).map(([name, all]) =>"
        "[name, all.map(one => asBits(own[name](...one.map(number))))])));"
    )
    for name, values in run_node(code, given).items():
        for one, value in zip(arguments_of(name), values, strict=True):
            number = struct.unpack(">d", bytes.fromhex(value))[0]
            assert bits(number) == bits(reference(name, *one)), (name, one)
