"""A lower and an upper bound, of which a part has one or both."""

from __future__ import annotations

from typing import Any

from atwood import ParameterError

__all__ = ["check_bounds"]


def check_bounds(part: Any) -> None:
    """Refuse bounds the wrong way round, and none at all.

    Parameters
    ----------
    part
        A part with the parameters `lower` and `upper`, each None where there is no bound.
    """
    lower, upper = part.lower, part.upper
    if lower is None and upper is None:
        raise ParameterError("it has no bound", where=part.path, advice="Give lower=, upper= or both.")
    if None not in (lower, upper) and not lower < upper:
        raise ParameterError(
            f"the upper bound {upper:g} is not above the lower one, {lower:g}", where=f"{part.path}.upper"
        )
