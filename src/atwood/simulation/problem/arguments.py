"""What the arguments of a run may be; runs, sweeps and comparisons share them."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

import numpy as np

from atwood.arguments import CALLBACK, FLAG, TEXT, Kind, Refused, each, either, number, one_of, optional, show, whole
from atwood.errors import AtwoodError, UsageError
from atwood.forms.residuals import LEVELS
from atwood.integrators.methods import AUTO, GAUSS, METHODS
from atwood.model.values.units import parse_quantity, parse_unit
from atwood.tolerances import tolerances
from atwood.topology.orientation_coordinates import ORIENTATIONS

FORMS = ("reduced", "dae")

_LONGEST, _SHORTEST = 1e30, 1e-30
"""s. Beyond, squares and fourth powers of times soon have no floating-point numbers."""

_MOST = 10_000_000
"""Output times, and samples, that a run can hold."""

_TOO_MANY_STEPS = 1e9
"""A largest step that asks for more steps than this asks for a run without an end."""


def _time(value: Any) -> float:
    if isinstance(value, str):
        try:
            value = parse_quantity(value, parse_unit("s"), "t_end")
        except AtwoodError as error:
            raise Refused(f"{error.message[:1].upper()}{error.message[1:]}.") from None
    return float(_SECONDS.read(value))


_SECONDS = number(least=-_LONGEST, most=_LONGEST)


def _monitor(value: Any) -> Any:
    if value is not None and not callable(getattr(value, "along", None)):
        raise Refused
    return value


def _nominal(value: Any) -> Any:
    if not isinstance(value, Mapping) or not all(isinstance(one, (str, float, int)) for one in value.values()):
        raise Refused
    return {str(path): size for path, size in value.items()}


def _condition(value: Any) -> str:
    if not isinstance(value, str) or not value.strip():
        raise Refused
    return value


def _times(value: Any) -> Any:
    if isinstance(value, (str, bytes, set, frozenset, dict)):
        raise Refused
    if isinstance(value, np.ndarray) and value.dtype.kind not in "fiu":
        raise Refused
    times = np.array(value if isinstance(value, np.ndarray) else [_SECONDS.read(one) for one in value], dtype=float)
    if times.ndim != 1 or not len(times) or not np.isfinite(times).all() or (times[1:] <= times[:-1]).any():
        raise Refused
    return times


FORM = one_of(FORMS)
LEVEL = one_of(LEVELS)
ORIENTATION = one_of(ORIENTATIONS)
SOLVER = one_of((AUTO, *METHODS))
NAME = optional(TEXT)
ACCURACY = optional(number("an error between 1e-15 and 0.1, such as 1e-8", least=1e-15, most=0.1))
T_END = optional(Kind(f"seconds, at most {_LONGEST:g}, or text such as '2 min'", _time, "TIME", _time))
RTOL = number("a relative tolerance between 0 and 1, such as 1e-8", above=0.0, below=1.0)
ATOL = optional(number("an absolute tolerance between 0 and 1, as a share of the scene's sizes", above=0.0, below=1.0))
OUTPUTS = either(
    whole(f"the number of output times, 2 to {_MOST:,}", 2, _MOST),
    Kind("the times themselves, s, finite and rising", _times),
)
LIMITS = {
    "max_steps": optional(whole("a whole number of steps, at least 1", 1, 10**18)),
    "max_seconds": optional(number("a number of seconds above 0", above=0.0)),
}
_ORDERS = GAUSS.orders


def _order(value: Any) -> int:
    found = int(whole("", 2, 12).read(value))
    if found not in _ORDERS:
        raise Refused
    return found


SAMPLES = whole(f"a whole number of samples, 1 to {_MOST:,}", 1, _MOST)
ORDER = optional(Kind(f"one of {', '.join(map(str, _ORDERS))}", _order, "INTEGER", float, tuple(map(str, _ORDERS))))
STRUCTURE = FLAG
PROGRESS = optional(either(FLAG, CALLBACK))
MONITOR = Kind("what `atwood.conserved(scene)` returns", _monitor)
NOMINAL = optional(
    Kind(
        "sizes by the path of a quantity, such as {'slider.displacement': '1 mm'}", _nominal, "PATH=SIZE", is_many=True
    )
)
_WATCHED = "a condition such as 'rod1.angle crosses 0', a function of quantities, or a list of these"
_ONE = either(Kind(_WATCHED, _condition), CALLBACK)
_WATCHES = either(CALLBACK, each(_ONE, _WATCHED))
CONDITIONS = optional(Kind(_WATCHED, lambda value: _WATCHES.read(value), "CONDITION", is_many=True))


def refuse_idle_settings(solver: str, order: int | None, step: float | None, first_step: float | None = None) -> None:
    """Refuse an order or a step for a solver that chooses these itself, and a first step for one that does not."""
    if order is None and step is None and first_step is None:
        return
    equal = [one.key for one in METHODS.values() if one.has_equal_steps]
    for name, value in (("order", order), ("step", step)):
        if value is not None and solver not in equal:
            raise UsageError(
                f"{name}={value!r} is for the solvers {' and '.join(map(repr, equal))}; {solver!r} chooses its own",
                advice=f"Give solver={equal[0]!r}, or rtol for the accuracy.",
            )
    if first_step is not None and solver in equal:
        raise UsageError(f"all steps of {solver!r} are equal", where="first_step", advice="Give step.")


def refuse_two_accuracies(accuracy: float | None, rtol: float, atol: float | None, step: float | None) -> None:
    """Refuse an accuracy of the motion together with a tolerance or a step, of which one would be ignored."""
    given = [("rtol", rtol, tolerances.RTOL), ("atol", atol, None), ("step", step, None)]
    for name, value, usual in given:
        if accuracy is not None and value != usual:
            raise UsageError(
                f"{name}={value!r} and accuracy={accuracy!r} ask for two things",
                advice="Leave one out: with an accuracy, tolerances are chosen for it.",
            )


def check_span(
    begin: float,
    end: float,
    max_step: float | None = None,
    step: float | None = None,
    first_step: float | None = None,
) -> None:
    """Refuse a run that does not go forwards, that takes no time, or that would take too many steps."""
    span = end - begin
    if not span > 0.0 or not np.isfinite(span):
        raise UsageError(f"the end, t = {end:g}, is not after the start, t = {begin:g}", advice="Give a later t_end.")
    if span < _SHORTEST or span < 1e3 * sys.float_info.epsilon * max(abs(begin), abs(end)):
        raise UsageError(
            f"from the start, t = {begin:g}, to the end, t = {end!r}, is too short a time for floating-point numbers",
            advice="Give a later t_end.",
        )
    least = 16.0 * sys.float_info.epsilon * max(abs(begin), abs(end))
    if first_step is not None and not least <= first_step <= span:
        raise UsageError(
            f"first_step cannot be {show(first_step)} in a run from t = {begin:g} to {end:g}",
            advice=f"Give a time between {least:.0e} and {span:.0e} s.",
        )
    for name, longest in (("max_step", max_step), ("step", step)):
        if longest is None or span / longest <= _TOO_MANY_STEPS:
            continue
        raise UsageError(
            f"{name} cannot be {show(longest)}, which asks for {span / longest:.0e} steps to t = {end:g}",
            advice=f"Give at least {span / _TOO_MANY_STEPS:.0e} s.",
        )
