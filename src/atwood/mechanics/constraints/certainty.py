"""Whether numbers that shape the equations are more than rounding."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from atwood.codegen.rounding import ROUGHNESS, RoughProgram, roughly
from atwood.expr import Expression, evaluate
from atwood.tolerances import tolerances

__all__ = ["rounds_to_zero"]


def rounds_to_zero(
    expressions: Sequence[Expression],
    parameters: Mapping[Expression, float],
    place: Mapping[Expression, float] | None = None,
) -> NDArray[np.bool_]:
    """Return which expressions are no larger than what rounding could have made of them.

    Parameters
    ----------
    expressions
        Of one graph.
    parameters
        Symbols that keep their values, with these.
    place
        All other symbols that they depend on, with theirs.
    """
    where = place or {}
    if all(one.is_constant for one in expressions):
        return np.array([one.is_zero for one in expressions], dtype=bool)
    at = np.array(list(where.values()))
    rough = RoughProgram((tuple(parameters), tuple(where)), list(expressions))
    ways = rough(np.array(list(parameters.values())), at[:, None] * roughly(len(at)))
    numbers = np.abs(evaluate(expressions, {**parameters, **where}))
    spread = np.maximum(np.ptp(ways, axis=1), ROUGHNESS * numbers)  # not finite next to a place without a value
    return np.array((numbers <= tolerances.CERTAIN * spread) & np.isfinite(spread), dtype=bool)
