"""Conserved quantities along a run: what they were, and how far they drifted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from atwood.arrays import FloatArray
from atwood.lazy_dataclasses import dataclass


@dataclass(frozen=True, eq=False)
class ConservedValues:
    """A conserved quantity along a run.

    Attributes
    ----------
    name, kind, unit
        See `atwood.ConservedQuantity`.
    values
        At the output times; not known (nan) in modes whose coordinates it is not made of.
    size
        What deviations are compared with: the most that the terms of the quantity came to.
    """

    name: str
    kind: str
    unit: str
    values: FloatArray
    size: float

    @property
    def max_drift(self) -> float:
        """Largest deviation from the start, relative to `size`."""
        known = self.values[np.isfinite(self.values)]
        moved = float(np.max(np.abs(known - known[:1]), initial=0.0))
        return moved / self.size if self.size > 0.0 else 0.0

    def to_dict(self) -> dict[str, Any]:
        """Return start, end and drift as plain data."""
        ends = {"start": float(self.values[0]), "end": float(self.values[-1])}
        return {"kind": self.kind, "unit": self.unit, **ends, "max_drift": self.max_drift, "size": self.size}


class ConservedLedger(Mapping[str, ConservedValues]):
    """The conserved quantities of a run by name.

    Parameters
    ----------
    items
        The quantities.
    """

    def __init__(self, items: tuple[ConservedValues, ...]) -> None:
        self._items = {one.name: one for one in items}

    def __getitem__(self, name: str) -> ConservedValues:
        return self._items[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._items)

    def __len__(self) -> int:
        return len(self._items)

    @property
    def max_drift(self) -> float:
        """The largest of their relative deviations."""
        return max((one.max_drift for one in self.values()), default=0.0)

    def describe(self) -> str:
        """Return by how much each drifts, in words."""
        if not self:
            return "nothing is conserved"
        return ", ".join(f"{one.name} drifts by {one.max_drift:.1e}" for one in self.values()) + " of their sizes"

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {one.name: one.to_dict() for one in self.values()}

    def __repr__(self) -> str:
        return f"<ConservedLedger: {self.describe()}>"
