"""Which of many round things are near each other: sweep and prune, strip by strip."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray

_ABOVE = {2: ((0,), (1,)), 3: ((0, 0), (0, 1), (1, -1), (1, 0), (1, 1))}
"""From each strip to itself and to one of every two neighbours, in a plane and in space."""


def near_pairs(places: FloatArray, reach: float) -> NDArray[np.intp]:
    """Return the pairs of places, in a plane or in space, that are no further apart than a reach along each axis.

    Places are sorted along strips as wide as the reach; each is swept to the next ones in its strip, and to those in
    the strips beside it (D. Baraff 1992; J. Cohen et al., I-COLLIDE, 1995). So the cost is nearly linear in their
    number.
    """
    x, *others = places.T - np.min(places, axis=0)[:, None]
    strips = [np.floor(one / reach) + 1.0 for one in others]
    span = float(np.max(x)) + 3.0 * reach
    lengths = np.cumprod([span, *(float(np.max(one)) + 3.0 for one in strips[:0:-1])])[::-1]
    key = x + sum(length * strip for length, strip in zip(lengths, strips, strict=True))
    order = np.argsort(key, kind="stable")
    key = key[order]
    own, swept = np.arange(len(key)), []
    for above in _ABOVE[places.shape[1]]:
        far = float(np.dot(above, lengths))
        first = np.searchsorted(key, key + (far - reach)) if far else own + 1
        counts = np.maximum(np.searchsorted(key, key + (far + reach), side="right") - first, 0)
        begins = np.repeat(first - (np.cumsum(counts) - counts), counts)
        swept.append(np.stack([np.repeat(own, counts), begins + np.arange(len(begins))], axis=1))
    pairs = order[np.concatenate(swept)]
    apart = np.abs(places[pairs[:, 1], 1:] - places[pairs[:, 0], 1:])
    found: NDArray[np.intp] = pairs[np.all(apart <= reach, axis=1)]
    return found
