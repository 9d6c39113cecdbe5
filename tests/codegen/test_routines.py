"""The language of routines: what it says is what machine code does."""

from __future__ import annotations

import ctypes
import inspect
import math
from collections.abc import Callable
from ctypes import c_double, c_int, c_int64, c_void_p
from typing import Any

import numpy as np
import pytest

from atwood.codegen.llvm.engine import compile_text, load_code
from atwood.codegen.llvm.linear_systems import write_elimination
from atwood.codegen.llvm.printer import print_routines
from atwood.codegen.routines import ADDRESS, BOOLEAN, CODE, INTEGER, NUMBER, Kind, Lanes, Record, Routine, Value

C_TYPES = {NUMBER: c_double, INTEGER: c_int64, CODE: c_int, ADDRESS: c_void_p}
INTRINSICS = (
    "\ndeclare double @llvm.sqrt.f64(double)\ndeclare double @llvm.fabs.f64(double)\n"
    "declare double @llvm.floor.f64(double)\nattributes #0 = { nounwind }\n"
)


def compiled(*routines: Routine) -> Callable[..., Any]:
    """Return the last of some routines as a function of numbers, integers and arrays."""
    last = routines[-1]
    last.exported = True
    text = print_routines(routines) + INTRINSICS
    loaded = load_code(compile_text(text, 1, has_variables=True), [last.name], {})
    kinds = [C_TYPES[one.kind] for one in last.arguments]
    function = ctypes.CFUNCTYPE(None if last.result is None else C_TYPES[last.result], *kinds)(
        loaded.addresses[last.name]
    )

    def call(*arguments: Any, _: Any = loaded) -> Any:
        return function(*[one.ctypes.data if isinstance(one, np.ndarray) else one for one in arguments])

    return call


def number_of(*names: str) -> Routine:
    return Routine("tried", dict.fromkeys(names, NUMBER), NUMBER)


@pytest.mark.parametrize(
    ("write", "expected"),
    [
        (lambda r, a, b: a + b * 2.0 - 1.0 / b, lambda a, b: a + b * 2.0 - 1.0 / b),
        (lambda r, a, b: 3.0 - a / b, lambda a, b: 3.0 - a / b),
        (lambda r, a, b: r.least(a, b) - 10.0 * r.most(a, b), lambda a, b: min(a, b) - 10.0 * max(a, b)),
        (lambda r, a, b: r.sqrt(r.size(a)) + r.floor(b), lambda a, b: math.sqrt(abs(a)) + math.floor(b)),
        (lambda r, a, b: r.choose((a > b) & ~(a == 2.0), a, b), lambda a, b: a if a > b and a != 2.0 else b),
        (lambda r, a, b: r.choose((a <= b) | (b != b), 1.0, 0.0), lambda a, b: float(a <= b or b != b)),
        (lambda r, a, b: (r.truncated(a) * 3 + 1).number(), lambda a, b: float(int(a) * 3 + 1)),
        (lambda r, a, b: (a < b).integer().number(), lambda a, b: float(a < b)),
        (lambda r, a, b: ((a.bits() >> 63) << 1).number(), lambda a, b: 2.0 * (math.copysign(1.0, a) < 0.0)),
        (lambda r, a, b: a.bits().number_of_bits(), lambda a, b: a),
        (lambda r, a, b: r.choose(r.is_finite(a) & r.is_finite(b), 1.0, 2.0), lambda a, b: 1.0),
    ],
)
def test_values(write: Callable[..., Value], expected: Callable[[float, float], float]) -> None:
    r = number_of("a", "b")
    r.give(write(r, *r.arguments))
    call = compiled(r)
    for a, b in ((1.5, 2.25), (-7.75, 0.5), (2.0, -3.0), (-0.0, 1e-300)):
        assert call(a, b) == expected(a, b)


def test_what_is_no_number_is_not_finite() -> None:
    r = Routine("tried", {"a": NUMBER})
    r.give((~r.is_finite(*r.arguments)).code())
    call = compiled(r)
    assert [call(one) for one in (1.0, math.inf, -math.inf, math.nan)] == [0, 1, 1, 1]


def test_loops_in_loops_with_variables() -> None:
    r = Routine("tried", {"n": INTEGER, "a": ADDRESS, "b": ADDRESS}, NUMBER)
    n, a, b = r.arguments
    total, power = r.variable(0.0), r.variable(1.0)
    with r.count(n) as outer:
        with r.count(n, outer) as inner:
            value = a[inner]
            with r.when(value < 0.0):
                b[inner] = 7.0
            total.now = total.now + value
        power.now = power.now * 2.0
    r.give(total.now + power.now)
    call = compiled(r)
    numbers, marks = np.array([1.0, -2.0, 3.0, 5.0]), np.zeros(4)
    assert call(4, numbers, marks) == sum(np.sum(numbers[i:]) for i in range(4)) + 2.0**4
    assert marks.tolist() == [0.0, 7.0, 0.0, 0.0]
    assert call(0, numbers, marks) == 1.0


def test_loops_are_left_and_repeated() -> None:
    r = Routine("tried", {"n": INTEGER}, INTEGER)
    i, odd = r.variable(0, INTEGER), r.variable(0, INTEGER)
    with r.forever() as loop:
        with r.when(i.now >= r.arguments[0]):
            r.leave(loop)
        i.now = i.now + 1
        with r.when((i.now & 1) == 0):
            r.repeat(loop)
        odd.now = odd.now + i.now
    r.give(odd.now)
    call = compiled(r)
    assert [call(n) for n in (0, 1, 6, 7)] == [0, 1, 9, 16]


def test_branches_return_and_go_on() -> None:
    r = Routine("tried", {"a": NUMBER})
    [a] = r.arguments
    code = r.variable(0, CODE)
    with r.when(a > 0.0):
        with r.when(a > 10.0):
            r.give(3)
        code.now = r.value(1, CODE)
    with r.otherwise():
        code.now = r.value(-2, CODE)
    r.give(code.now)
    call = compiled(r)
    assert [call(one) for one in (20.0, 5.0, -1.0, math.nan)] == [3, 1, -2, -2]


def test_arrays_records_and_short_integers() -> None:
    fields = {"total": NUMBER, "count": INTEGER, "place": ADDRESS}
    r = Routine("tried", {"own": ADDRESS, "list": ADDRESS}, None)
    given, listed = r.arguments
    own, room = Record(given, fields), r.array(3)
    r.clear(room, room.at(3))
    with r.count(own.count) as k:
        at = listed.read(k, CODE).integer()
        room[at] = room[at] + own.place[k]
    own.total = room[0] + 10.0 * room[1] + 100.0 * room[2]
    own.count = own.count - 1
    r.copy(own.place, room, 3)
    r.copy(listed.at(1, CODE), listed, 1, CODE)
    listed.write(0, own.count.code())
    values, places = np.array([1.0, 2.0, 3.0, 4.0]), np.array([2, 0, 2, 1], dtype=np.int32)
    record = np.zeros(3)
    record.view(np.int64)[1:] = 4, values.ctypes.data
    compiled(r)(record, places)
    assert record[0] == 2.0 + 40.0 + 400.0
    assert record.view(np.int64)[1] == 3
    assert values.tolist() == [2.0, 4.0, 4.0, 4.0]
    assert places.tolist() == [3, 2, 2, 1]


def test_routines_and_addresses_are_called() -> None:
    inner = Routine("inner", {"a": NUMBER, "n": INTEGER}, NUMBER)
    inner.give(inner.arguments[0] * inner.arguments[1].number())
    r = Routine("tried", {"a": NUMBER, "other": ADDRESS}, NUMBER)
    a, other = r.arguments
    with r.when(r.is_null(other)):
        r.give(-1.0)
    r.give(
        r.call(inner, a, 3) + r.call(other, a, result=NUMBER) + r.call("inner", a, r.value(1, INTEGER), result=NUMBER)
    )
    squared = ctypes.CFUNCTYPE(c_double, c_double)(lambda x: x * x)
    call = compiled(inner, r)
    assert call(5.0, ctypes.cast(squared, c_void_p).value) == 15.0 + 25.0 + 5.0
    assert call(5.0, None) == -1.0


def test_lanes_work_together() -> None:
    lanes = Lanes(4)
    r = Routine("tried", {"a": ADDRESS, "factor": NUMBER}, NUMBER)
    a, factor = r.arguments
    several = a.read(0, lanes) * factor + 1.0
    a.write(0, several)
    most = r.largest_lane(r.choose(several > 5.0, several, 0.0))
    found = r.choose(r.any_lane(several < 0.0), most * -1.0, most)
    r.give(found + 1000.0 * r.sum_of_lanes(a.read(0, lanes)))
    call, numbers = compiled(r), np.array([1.0, 2.0, 3.0, 4.0])
    assert call(numbers, 2.0) == 9.0 + 1000.0 * 24.0
    assert numbers.tolist() == [3.0, 5.0, 7.0, 9.0]
    assert call(numbers, -1.0) == -0.0 + 1000.0 * -20.0


@pytest.mark.parametrize("size", [1, 2, 4, 5, 9])
def test_elimination_solves(size: int) -> None:
    rng = np.random.default_rng(size)
    matrix, right = rng.normal(size=(size, size)), rng.normal(size=size)
    r = Routine("tried", {"n": INTEGER, "a": ADDRESS, "pivots": ADDRESS, "x": ADDRESS}, None)
    n, a, pivots, x = r.arguments
    r.call("factorise", n, a, pivots, result=None)
    r.call("substitute", n, a, pivots, x, result=None)
    call, found = compiled(*write_elimination(), r), right.copy()
    call(size, matrix.copy(), np.zeros(size), found)
    np.testing.assert_allclose(matrix @ found, right, atol=1e-12)
    call(size, np.zeros((size, size)), np.zeros(size), found)
    assert np.all(np.isnan(found))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda r, a, n, p: a + n, "number is needed in tried, not integer"),
        (lambda r, a, n, p: n + 0.5, "integer is needed in tried, not 0.5"),
        (lambda r, a, n, p: (a < 1.0) & n, "condition is needed in tried, not integer"),
        (lambda r, a, n, p: a.at(0), "address is needed in tried, not number"),
        (lambda r, a, n, p: p.at(a), "integer is needed in tried, not number"),
        (lambda r, a, n, p: r.choose(a < 1.0, a, n), "number is needed in tried, not integer"),
        (lambda r, a, n, p: r.give(a), "code is needed in tried, not number"),
        (lambda r, a, n, p: r.call(r, n, n, p), "number is needed in tried, not integer"),
        (lambda r, a, n, p: p.read(0, Lanes(2)) + n, "2 lanes of numbers is needed in tried, not integer"),
        (lambda r, a, n, p: bool(a < 1.0), "use `when` or `choose`"),
    ],
)
def test_a_wrong_kind_is_refused_in_the_line_that_has_it(wrong: Callable[..., Any], message: str) -> None:
    r = Routine("tried", {"a": NUMBER, "n": INTEGER, "p": ADDRESS})
    with pytest.raises(TypeError, match=message) as caught:
        wrong(r, *r.arguments)
    lines = [(str(one.path), one.lineno + 1) for one in caught.traceback]
    assert (__file__, inspect.getsourcelines(wrong)[1]) in lines


def test_a_variable_keeps_its_kind() -> None:
    r = Routine("tried", {"n": INTEGER})
    kinds: list[Kind] = [NUMBER, BOOLEAN]
    for kind in kinds:
        one = r.variable(0, kind)
        with pytest.raises(TypeError, match="is needed in tried, not integer"):
            one.now = r.arguments[0]
