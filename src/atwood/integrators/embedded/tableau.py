"""What makes one embedded pair: its coefficients, its orders, and where it stops being stable."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

from atwood.lazy_dataclasses import dataclass


@dataclass(frozen=True, eq=False)
class Tableau:
    """The coefficients of an embedded explicit Runge-Kutta pair with dense output.

    Slopes are numbered from 0, the one at the begin of a step.  The one at its end begins the next step.

    Attributes
    ----------
    order, dense_order
        Of the method, which chooses the steps by the roots of errors, and of the dense output.
    end
        The number of the slope at the end of a step; those behind it are taken for the dense output alone.
    edge
        The largest product of a step and a rate of decay at which the method is stable.
    nodes
        Where slopes are taken, as shares of the step.
    stages
        Weights of earlier slopes in the values at which slopes 1, 2, ... are taken; those of `end` are the method's.
    errors
        Weights of the slopes in one embedded estimate of the error, or in two of different orders, of which the error
        is made as in Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, section II.10.
    dense
        Weights of the slopes in the coefficients of the dense output behind those of the cubic through both ends.
    """

    order: int
    dense_order: int
    end: int
    edge: float
    nodes: tuple[float, ...]
    stages: tuple[Mapping[int, float], ...]
    errors: tuple[Mapping[int, float], ...]
    dense: tuple[Mapping[int, float], ...]

    @cached_property
    def rows(self) -> dict[str, int]:
        """Rows of the table of arrays of a session: slopes come first.

        `last` is the value at which the slope before that of the end was taken.
        """
        slopes = len(self.nodes)
        rows = {"slope": 0, "end slope": self.end}
        rows |= {name: slopes + k for k, name in enumerate(("y", "y_old", "trial", "absolute", "dense"))}
        last = rows["dense"] + self.terms
        return rows | {"last": last, "all": last + 1}

    @property
    def judges_end(self) -> bool:
        """Whether estimates of the error read the slope at the end of a step."""
        return any(self.end in weights for weights in self.errors)

    @property
    def terms(self) -> int:
        """How many coefficients the dense output has behind the value at the begin."""
        return 3 + len(self.dense)
