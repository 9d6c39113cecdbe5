"""A pytest plugin that writes how near each comparison came to its bound: `-p tests.machines.margins --margins FILE`.

It records what a test that passes compares: `assert value < bound` (by pytest's hook for assertions that hold, so with
`-o enable_assertion_pass_hook=true`), `pytest.approx`, `np.allclose` and `np.testing.assert_allclose`. Tests need no
change. Assertions are rewritten when a module is first imported, so a run with the plugin needs a place of its own for
byte code (PYTHONPYCACHEPREFIX). The command `python -m tests.machines` sees to all of this.
"""

from __future__ import annotations

import json
import linecache
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

TESTS = Path(__file__).resolve().parent.parent
PROPERTY = "margins"

_DIGITS = r"-?\d+\.?\d*(?:e[-+]?\d+)?"
_NUMBER = rf"((?<![\w.]){_DIGITS}|np\.float64\({_DIGITS}\))"
_BELOW = re.compile(rf"{_NUMBER} <=? {_NUMBER}(?![\w.])")


def ratio_in(explanation: str) -> float | None:
    """Return the largest value / bound among the comparisons `value < bound` that an explanation shows, if any.

    Two whole numbers are a count and its bound: they do not round.
    """
    first_line = explanation.partition("\n")[0]
    found = (
        [float(side.removeprefix("np.float64(").rstrip(")")) for side in pair]
        for pair in _BELOW.findall(first_line)
        if not all(side.isdecimal() for side in pair)
    )
    return max((value / bound for value, bound in found if 0 <= value <= bound and bound > 0), default=None)


def ratio_of_arrays(actual: Any, desired: Any, rtol: float, atol: float) -> float | None:
    """Return the largest abs(actual - desired) / (atol + rtol abs(desired)); 0 where both are alike."""
    a, b = np.broadcast_arrays(np.asarray(actual), np.asarray(desired))
    if a.size == 0 or not (np.issubdtype(a.dtype, np.number) and np.issubdtype(b.dtype, np.number)):
        return None
    with np.errstate(all="ignore"):
        ratio = np.abs(a - b) / (atol + rtol * np.abs(b))
    known = ratio[np.isfinite(ratio)]
    return float(np.max(known, initial=0.0))


class Margins:
    """Keeps for each test and each line that compares the largest value / bound."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self.outcomes: dict[str, str] = {}
        self.margins: dict[str, dict[str, float]] = {}
        self.current: dict[str, float] = {}

    def record(self, text: str, ratio: float | None) -> None:
        if ratio is not None:
            self.current[text] = max(ratio, self.current.get(text, 0.0))

    def record_from(self, frame: FrameType | None, ratio: Callable[[], float | None]) -> None:
        """Record a ratio under the line of the tests that asked for it, if a test did."""
        while frame is not None and frame.f_code.co_filename == __file__:
            frame = frame.f_back
        if frame is not None and _is_test(frame):
            self.record(linecache.getline(frame.f_code.co_filename, frame.f_lineno).strip(), ratio())

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Iterator[None]:
        self.current = {}
        try:
            return (yield)
        finally:
            item.user_properties.append((PROPERTY, dict(self.current)))

    def pytest_assertion_pass(self, orig: str, expl: str) -> None:
        frame: FrameType | None = sys._getframe(1)
        while frame is not None and frame.f_globals.get("__name__", "").partition(".")[0] in ("pluggy", "_pytest"):
            frame = frame.f_back
        if frame is not None and _is_test(frame):  # and not a plugin of pytest, whose assertions are rewritten, too
            self.record(orig, ratio_in(expl))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Gather what a test recorded, in this process or in a worker of pytest-xdist."""
        if report.when == "call" or report.outcome != "passed":
            self.outcomes[report.nodeid] = report.outcome
        if report.when == "call":
            self.margins[report.nodeid] = dict(report.user_properties).get(PROPERTY, {})

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.failed:
            self.outcomes[report.nodeid] = "failed"

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        if not hasattr(session.config, "workerinput"):
            self.file.write_text(json.dumps({"outcomes": self.outcomes, "margins": self.margins}), encoding="utf-8")


def _is_test(frame: FrameType) -> bool:
    return Path(frame.f_code.co_filename).is_relative_to(TESTS)


def _watch_comparisons(margins: Margins, patch: pytest.MonkeyPatch) -> None:
    """Record what NumPy's comparisons and `pytest.approx` compare, before the tests import them."""
    close, assert_close, scalar = np.allclose, np.testing.assert_allclose, type(pytest.approx(1.0))
    is_equal = scalar.__eq__

    def allclose(a: Any, b: Any, rtol: float = 1e-5, atol: float = 1e-8, equal_nan: bool = False) -> bool:
        found = close(a, b, rtol=rtol, atol=atol, equal_nan=equal_nan)
        if found:  # "not allclose" is no bound
            margins.record_from(sys._getframe(), lambda: ratio_of_arrays(a, b, rtol, atol))
        return found

    def assert_allclose(actual: Any, desired: Any, rtol: float = 1e-7, atol: float = 0, **options: Any) -> None:
        assert_close(actual, desired, rtol=rtol, atol=atol, **options)
        margins.record_from(sys._getframe(), lambda: ratio_of_arrays(actual, desired, rtol, atol))

    def equal(self: Any, actual: Any) -> bool:
        found = is_equal(self, actual)
        if found and isinstance(actual, float | np.floating) and np.isfinite(actual):
            frame: FrameType | None = sys._getframe()
            while frame is not None and not (_is_test(frame) and frame.f_code.co_filename != __file__):
                frame = frame.f_back
            bound = float(self.tolerance)
            margins.record_from(frame, lambda: abs(float(actual) - float(self.expected)) / bound if bound else None)
        return found

    patch.setattr(np, "allclose", allclose)
    patch.setattr(np.testing, "assert_allclose", assert_allclose)
    patch.setattr(scalar, "__eq__", equal)


def pytest_addoption(parser: pytest.Parser) -> None:
    pytest.register_assert_rewrite("tests.helpers", "tests.references")
    parser.addoption("--margins", type=Path, help="write outcomes, and value / bound of every comparison, to this file")


def pytest_configure(config: pytest.Config) -> None:
    file = config.getoption("--margins")
    if file is not None:
        margins = Margins(file)
        patch = pytest.MonkeyPatch()
        _watch_comparisons(margins, patch)
        config.add_cleanup(patch.undo)
        config.pluginmanager.register(margins, "atwood-margins")
