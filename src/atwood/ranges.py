"""Values and ranges as they are written: ``0.5:2:16``, ``1,2,5 kg``, ``-90:90deg``."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from atwood.errors import UsageError

__all__ = ["range_of", "values_of"]

_RANGE = re.compile(r"([^:]+):([^:]+):\s*(\d+)\s*([^:]*)\Z")
_DISTRIBUTION = re.compile(r"\s*([A-Za-z]+)\s*\((.*)\)(.*)\Z")
_LARGEST = 10_000_000


def values_of(text: str) -> Any:
    """Return the values that a text stands for: a list, or a distribution of `scipy.stats`."""
    distribution = _DISTRIBUTION.match(text)
    if distribution is not None:
        return _distribution(distribution[1], distribution[2], distribution[3], text)
    found = _RANGE.match(text)
    if found is not None:
        import numpy as np

        first, last, count, unit = found.groups()
        number = int(count)
        if not 1 <= number <= _LARGEST:
            raise UsageError(f"{number} is no number of values", advice="Write FROM:TO:COUNT.")
        values = np.linspace(_number(first, text), _number(last, text), number).tolist()
        return [f"{value!r} {unit.strip()}" for value in values] if unit.strip() else values
    if ":" in text:
        raise UsageError(f"{text!r} is no range", advice="Write FROM:TO:COUNT, such as 0:90:10deg.")
    parts = [part.strip() for part in text.split(",")]
    if not all(parts):
        raise UsageError(f"{text!r} lacks a value", advice="Write A,B,C.")
    tail = re.match(r"[-+.\deE]+\s*([A-Za-z%].*)\Z", parts[-1])
    numbers = [_maybe_number(part) for part in parts]
    if tail is None:
        return [part if number is None else number for part, number in zip(parts, numbers, strict=True)]
    return [part if number is None else f"{part} {tail[1]}" for part, number in zip(parts, numbers, strict=True)]


_DISTRIBUTIONS: dict[str, tuple[str, Callable[..., tuple[str, tuple[float, ...], float, float]]]] = {
    "normal": ("MEAN,SD", lambda mean, sd: ("norm", (), mean, sd)),
    "uniform": ("LOW,HIGH", lambda low, high: ("uniform", (), low, high - low)),
    "triangular": (
        "LOW,MODE,HIGH",
        lambda low, mode, high: ("triang", ((mode - low) / (high - low),), low, high - low),
    ),
    "lognormal": ("MEDIAN,SIGMA", lambda median, sigma: ("lognorm", (sigma,), 0.0, median)),
}
"""Distributions as they are written: their arguments, and name, shape, place and scale in `scipy.stats`."""


def _distribution(name: str, arguments: str, tail: str, text: str) -> Any:
    if name not in _DISTRIBUTIONS:
        advice = f"Write {', '.join(f'{one}({words})' for one, (words, _) in _DISTRIBUTIONS.items())}."
        raise UsageError(f"{name!r} in {text!r} is no distribution", advice=advice)
    words, made = _DISTRIBUTIONS[name]
    numbers = [_maybe_number(one) for one in arguments.split(",")]
    if len(numbers) != words.count(",") + 1 or None in numbers or tail.strip():
        raise UsageError(f"{text!r} is not written as a distribution", advice=f"Write {name}({words}), in SI units.")
    import scipy.stats

    try:
        kind, shape, place, scale = made(*numbers)
    except ZeroDivisionError:
        raise UsageError(f"{text!r} has no width", advice=f"Write {name}({words}).") from None
    return getattr(scipy.stats, kind)(*shape, loc=place, scale=scale)


def range_of(text: str) -> tuple[float | str, float | str]:
    """Return the ends of a range, such as ``"-90:90deg"``: text where it has a unit, which the lower end may lack."""
    low, colon, high = text.partition(":")
    if not colon:
        raise UsageError(f"{text!r} is no range", advice="Write FROM:TO, such as -90deg:90deg.")
    unit = "".join(character for character in high if character.isalpha())
    return _bound(low.strip(), unit), _bound(high.strip(), unit)


def _bound(text: str, unit: str) -> float | str:
    number = _maybe_number(text)
    return text if number is None else f"{number} {unit}" if unit else number


def _maybe_number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _number(part: str, text: str) -> float:
    number = _maybe_number(part)
    if number is None:
        raise UsageError(f"{part.strip()!r} in {text!r} is no number", advice="Give the unit at the end: 0:90:10deg.")
    return number
