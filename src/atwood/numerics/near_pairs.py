"""Which of many round things are near each other: sweep and prune, strip by strip."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray


def near_pairs(places: FloatArray, reach: float) -> NDArray[np.intp]:
    """Return the pairs of places in a plane that are no further apart than a reach along each axis.

    Places are sorted along strips as wide as the reach; each is swept to the next ones in its strip, and to those in
    the strip above (D. Baraff 1992; J. Cohen et al., I-COLLIDE, 1995). So the cost is nearly linear in their number.
    """
    x, z = places.T - np.min(places, axis=0)[:, None]
    strip = np.floor(z / reach)
    span = float(np.max(x)) + 3.0 * reach
    key = strip * span + x
    order = np.argsort(key, kind="stable")
    key = key[order]
    own = np.arange(len(key))
    ranges = (
        (own + 1, np.searchsorted(key, key + reach, side="right")),
        (np.searchsorted(key, key + (span - reach)), np.searchsorted(key, key + (span + reach), side="right")),
    )
    swept = []
    for first, last in ranges:
        counts = np.maximum(last - first, 0)
        begins = np.repeat(first - (np.cumsum(counts) - counts), counts)
        swept.append(np.stack([np.repeat(own, counts), begins + np.arange(len(begins))], axis=1))
    pairs = order[np.concatenate(swept)]
    found: NDArray[np.intp] = pairs[np.abs(z[pairs[:, 1]] - z[pairs[:, 0]]) <= reach]
    return found
