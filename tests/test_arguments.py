"""What arguments may be, and what is said of one that will not do."""

from __future__ import annotations

import math

import numpy as np
import pytest

from atwood import UsageError
from atwood.arguments import FILE, FLAG, TEXT, each, instance, number, one_of, optional, takes, whole


@takes(
    share=number("a share between 0 and 1", above=0.0, below=1.0),
    count=whole("a count from 1 to 9", 1, 9),
    word=one_of(("alpha", "beta")),
    names=each(TEXT, "a list of texts"),
    flag=FLAG,
    file=optional(FILE),
    parts=each(instance("a number", complex), "complex numbers"),
)
def function(share: float, count: int = 1, *, word: str = "", names=(), flag=False, file=None, parts=()):
    return share, count, word, names, flag, file, parts


def test_values_come_in_their_own_types() -> None:
    share, count, word, names, flag, file, parts = function(
        np.float32(0.5), 3.0, word="beta", names="one", flag=np.bool_(True), file="a.csv", parts=[1j]
    )
    assert type(share) is float
    assert (type(count), count) == (int, 3)
    assert (word, names, flag, str(file), parts) == ("beta", ("one",), True, "a.csv", (1j,))
    assert function(0.5) == (0.5, 1, "", (), False, None, ())


class Odd:
    def __float__(self):
        raise RuntimeError("no")

    __repr__ = __iter__ = __fspath__ = __bool__ = __float__


@pytest.mark.parametrize("name", ["share", "count", "word", "names", "flag", "file", "parts"])
@pytest.mark.parametrize("value", [Odd(), Odd, 1j, b"x", object(), math.nan, -1, {1: 2}])
def test_what_will_not_do_is_refused_with_name_and_remedy(name: str, value: object) -> None:
    with pytest.raises(UsageError, match=rf"function: {name} cannot be .*\. Give "):
        function(**{"share": 0.5, name: value})


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"word": "bet"}, "Did you mean 'beta'"),
        ({"wrod": "beta"}, "takes no 'wrod'. Did you mean 'word'"),
        ({"share": 1.0}, "a share between 0 and 1"),
        ({"share": True}, "share"),
        ({"share": "0.5"}, "share"),
        ({"share": np.array([0.5])}, "share"),
        ({"count": 2.5}, "count"),
        ({"count": 10**400}, "count"),
        ({"file": "a\0b"}, "file"),
        ({"file": " "}, "file"),
        ({"parts": [complex]}, "Give complex numbers"),
        ({"names": [1]}, "names"),
    ],
)
def test_what_would_do_is_said(given: dict[str, object], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        function(**{"share": 0.5, **given})


def test_a_value_is_shown_on_one_short_line() -> None:
    with pytest.raises(UsageError) as caught:
        function("line one\nline two" * 1000)
    assert len(str(caught.value)) < 200
    assert "\n" not in str(caught.value)


def test_an_argument_without_a_kind_is_found_where_it_is_declared() -> None:
    with pytest.raises(TypeError, match="share"):
        takes(share=FLAG)(lambda share, more: None)


def test_what_python_refuses_by_itself_stays_its_own() -> None:
    with pytest.raises(TypeError):
        function()
    with pytest.raises(TypeError):
        function(0.5, 1, "alpha")
