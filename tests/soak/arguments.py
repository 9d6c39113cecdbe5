"""Bad arguments of every public function: the error names the argument and says what would do."""

from __future__ import annotations

import contextlib
import inspect
import math
import random
import tempfile
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from atwood import AtwoodError

from .call import Call
from .calls import calls
from .trial import Finding, Trial


class Odd:
    """An object whose every use fails."""

    def _fail(self, *_: object) -> Any:
        raise RuntimeError("this object cannot be used")

    __float__ = __int__ = __index__ = __iter__ = __len__ = __bool__ = __repr__ = __str__ = __eq__ = _fail
    __hash__ = None  # type: ignore[assignment]
    __fspath__ = __getitem__ = __call__ = __add__ = __radd__ = __mul__ = __rmul__ = __neg__ = _fail


NOTHING_SOUND: list[Any] = [b"x", 1j, object(), {"x": 1}, {1, 2}, Odd(), Odd, range(0), [[1.0], [2.0, 3.0]]]
"""What none of the kinds below is."""

NO_NUMBER = [*NOTHING_SOUND, "x", "", "5 zz", [1.0], [], None, True, math.nan, math.inf, -math.inf, 10**400]
NOT_POSITIVE = [*NO_NUMBER, 0, -1, -1e-300]

BAD: dict[str, list[Any]] = {
    "number": NO_NUMBER,
    "formula": [*(one for one in NO_NUMBER if not isinstance(one, str)), "wrod", "x y +"],
    "optional number": [one for one in NO_NUMBER if one is not None],
    "scalar": [one for one in NO_NUMBER if not isinstance(one, (float, bool, int, list))],
    "condition": ["x", b"x", object(), Odd(), None, [], {}],
    "array": [b"x", 1j, object(), {"x": 1}, Odd(), "x", [[1.0], [2.0, 3.0]], [math.nan], [None], True],
    "stop condition": ["x", b"x", object(), 3, 2.5, 1j, ["x"]],
    "direction": [*NO_NUMBER, 2, 0.5],
    "words": [3, 2.5, b"x", 1j, object(), Odd(), [3], [None], True, None],
    "positive": NOT_POSITIVE,
    "size": [*NO_NUMBER, -1.0],
    "optional positive": [one for one in NOT_POSITIVE if one is not None],
    "share": [*NOT_POSITIVE, 1.0, 2],
    "whole": [*NOT_POSITIVE, 2.5, 1e-300, 10**30],
    "optional whole": [*(one for one in NOT_POSITIVE if one is not None), 2.5],
    "time": [*(one for one in NO_NUMBER if one is not None), -1.0, 0.0, 1e-300, 1e300, "2 kg", "-3 s"],
    "times": [*NO_NUMBER, 1, 2.5, [1.0, 0.5], [0.1, math.nan], [0.0, 1e9], [None], ["x"], np.zeros((2, 2)), 10**30],
    "optional times": [*(one for one in NO_NUMBER if one is not None), 1, 2.5, [1.0, 0.5], [0.0, 1e9], [None], 10**30],
    "text": [*NOTHING_SOUND, 3, 2.5, [], [1.0], True, math.nan],
    "needed text": [*NOTHING_SOUND, 3, 2.5, [], [1.0], True, None],
    "word": [*NOTHING_SOUND, "wrod", "", 3, None, [], True],
    "optional word": [*NOTHING_SOUND, "wrod", "", 3, [], True],
    "optional error": [*(one for one in NOT_POSITIVE if one is not None), 0.5, 1.0, 1e-16],
    "optional order": [*NOTHING_SOUND, "x", 3, 7, 2.5, -2, 0, [], True, math.nan],
    "texts": [3, 2.5, b"x", 1j, object(), Odd(), [3], [None], {"x": 1}, ["no.such.thing"], True],
    "some objects": [one for one in [*NOTHING_SOUND, 3, "x", math.nan, True] if not isinstance(one, range)],
    "some texts": [3, 2.5, b"x", 1j, object(), Odd(), [3], [None], {"x": 1}, ["no.such"], True, None, "no.such"],
    "optional size": [*(one for one in NO_NUMBER if one is not None), -1.0],
    "numbers": [*NOTHING_SOUND, "x", None, [], ["x"], [1j], [0.1, 0.2, 0.3, 0.4, 0.5], [[0.1]] * 3, True],
    "some numbers": [*NOTHING_SOUND, "x", [], ["x"], [0.1] * 5, True],
    "array out": [*NOTHING_SOUND, 3, "x", [0.0], np.zeros(7), np.zeros(1, dtype=int), np.zeros((1, 1, 1))],
    "expression": [b"x", object(), {1, 2}, Odd(), Odd, [1.0], None, "(", "x y z +", math.nan],
    "file": [*NOTHING_SOUND, 3, "", " ", "a\0b.npz", None, "no/such/directory/x.npz", "."],
    "optional folder": [*NOTHING_SOUND, 3, "", "a\0b"],
    "picture": [b"x", 1j, object(), Odd(), 3, "", "a\0b.png", "no/such/directory/x.png", ".", "x.unknown"],
    "callback": [3, "x", 2.5, [], {}, 1j, b"x"],
    "flag": [*NOTHING_SOUND, "yes", 2, None, 0.5, []],
    "mapping": [3, "x", 2.5, [1.0], 1j, b"x", object(), Odd()],
    "object": [*NOTHING_SOUND, 3, "x", None, [], math.nan, True],
    "optional object": [*NOTHING_SOUND, 3, "x", [], math.nan],
    "vector": [
        *NOTHING_SOUND,
        3,
        "x",
        None,
        [1.0],
        [1.0, 2.0],
        [1.0, "x", 2.0],
        [1.0, 2.0, 3.0, 4.0],
        "abc",
        [None] * 3,
    ],
    "axis": [*NOTHING_SOUND, 3, "w", None, [1.0], [1.0, 2.0], [1.0, "x", 2.0], [1.0] * 4, "abc", [0.0] * 3],
    "unit": [*NOTHING_SOUND, 3, None, "parsec", "m^", "m//s", "kg*", "(m", "m)"],
    "index": [*NOTHING_SOUND, "x", None, 2.5, 10**6, -(10**6), math.nan],
}
"""For each kind of argument, values that are not of it."""


@dataclass(frozen=True)
class Attempt:
    """One bad call.

    Attributes
    ----------
    call
        The call, with what is sound.
    argument
        The argument that is not; one that there is not, if it is not among those of the call.
    value
        What is given for it.
    """

    call: Call
    argument: str
    value: Any

    @property
    def label(self) -> str:
        """The call in a few words."""
        return f"{self.call.name}({self.argument}=...)"


def attempts() -> Iterator[Attempt]:
    """Yield every bad value for every argument of every public function."""
    for call in calls():
        for argument, kind in call.kinds.items():
            yield from (Attempt(call, argument, value) for value in (*BAD[kind], *call.also.get(argument, ())))
        if call.has_names and len(call.kinds) > 1:
            yield Attempt(call, "argumnet", 1.0)


def check(seed: int) -> Trial:
    """Make a few bad calls, one of them with two bad arguments."""
    chance = random.Random(seed)
    every = list(attempts())
    tried, findings = [], []
    for attempt in chance.sample(every, 10):
        outcome, finding = make(attempt)
        tried.append(outcome)
        if finding is not None:
            findings.append(finding)
    return Trial(tuple(tried), tuple(findings))


def make(attempt: Attempt) -> tuple[str, Finding | None]:
    """Make a bad call, and say what came of it."""
    said = f"{attempt.label} with {_shown(attempt.value)}"
    with tempfile.TemporaryDirectory() as directory, contextlib.chdir(directory), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            attempt.call.make(Path(directory), **{attempt.argument: attempt.value})
        except AtwoodError as error:
            return "refused", _without_help(attempt, said, error)
        except Exception as error:
            what = f"{attempt.label}: {type(error).__name__}"
            return "raised", Finding("crash", what, f"{said}: {type(error).__name__}: {error}")
    return "accepted", Finding("wrong", f"{attempt.label}: accepted", said)


def _without_help(attempt: Attempt, said: str, error: AtwoodError) -> Finding | None:
    try:
        text = str(error)
    except Exception as problem:
        return Finding("crash", f"{attempt.label}: the error has no text", repr(problem))
    names = {attempt.argument, attempt.argument.replace("_", " "), *attempt.call.said_as.get(attempt.argument, ())}
    if not any(name in text for name in names):
        return Finding("message", f"{attempt.label}: the argument is not named", f"{said}: {text}")
    if not error.advice and "must" not in text:
        return Finding("message", f"{attempt.label}: what would do is not said", f"{said}: {text}")
    if len(text) > 700 or "\n" in text:
        return Finding("message", f"{attempt.label}: the error is too long", f"{said}: {text[:300]}")
    return None


def _shown(value: Any) -> str:
    try:
        return repr(value)[:60]
    except Exception:
        return f"a {type(value).__name__}"


def parameters_of(function: Callable[..., Any]) -> list[str]:
    """Return the names of the arguments of a function."""
    return [one for one in inspect.signature(function).parameters if one not in ("self", "cls")]
