"""Bounds that are parameters: lower and upper ones, of which a part has one or both, and that of static friction."""

from __future__ import annotations

from typing import Any

from atwood import Component, ParameterError

__all__ = ["Bounded", "check_static_friction"]


class Bounded(Component):
    """A part with the parameters `lower` and `upper`, each None where there is no bound."""

    lower: Any
    upper: Any

    def check_values(self) -> None:
        """Refuse bounds the wrong way round, and none at all."""
        lower, upper = self.lower, self.upper
        if lower is None and upper is None:
            raise ParameterError("it has no bound", where=self.path, advice="Give lower=, upper= or both.")
        if None not in (lower, upper) and not lower < upper:
            raise ParameterError(
                f"the upper bound {upper:g} is not above the lower one, {lower:g}", where=f"{self.path}.upper"
            )


def check_static_friction(sticks: Any, slips: Any, path: str) -> None:
    """Refuse static friction below that of slipping: what slips would stop and could not stay."""
    if sticks is not None and sticks < slips:
        raise ParameterError(
            f"the coefficient while it sticks, {sticks:g}, is below that while it slips, {slips:g}",
            where=f"{path}.static_friction",
            advice=f"Give one from {slips:g} on, or none.",
        )
