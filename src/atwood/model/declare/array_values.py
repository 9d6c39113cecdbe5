"""Parameters that are numbers in a row, or in rows and columns."""

from __future__ import annotations

import math
from typing import Any

from atwood.arguments import real, show
from atwood.errors import ParameterError

__all__ = ["check_array"]


def check_array(value: Any, where: str) -> tuple[Any, ...]:
    """Return numbers as a tuple, or as a tuple of rows that are equally long.

    Parameters
    ----------
    value
        A sequence of numbers or of rows, a NumPy array, a data frame.
    where
        The path of the parameter.

    Raises
    ------
    ParameterError
        If it is none of these, or a number is not finite.
    """
    plain = value.to_numpy() if hasattr(value, "to_numpy") else value
    plain = plain.tolist() if hasattr(plain, "tolist") else plain
    if not isinstance(plain, (list, tuple)) or not plain:
        raise ParameterError(
            f"{show(value)} is not numbers in a row, or in rows and columns", where=where, advice="Give a list of them."
        )
    if not isinstance(plain[0], (list, tuple)):
        return tuple(_number(one, where) for one in plain)
    found = tuple(tuple(_number(one, where) for one in row) for row in plain)
    if len({len(row) for row in found}) > 1:
        lengths = ", ".join(str(len(row)) for row in found[:5])
        raise ParameterError(
            f"its rows are not equally long: {lengths}", where=where, advice="Give rows with as many numbers each."
        )
    return found


def _number(value: Any, where: str) -> float:
    try:
        number = real(value)
    except Exception:  # a value of somebody else's class may raise anything
        number = math.nan
    if not math.isfinite(number):
        raise ParameterError(f"{show(value)} in it is not a finite number", where=where, advice="Give finite numbers.")
    return number
