"""Steps that look good by chance: where an error estimate has a zero, the ratio of both estimates before tells."""

from __future__ import annotations

import numpy as np
import pytest

from atwood import assemble, simulate
from atwood_library.scenes import FourBar, SpatialSliderCrank


@pytest.mark.parametrize(
    ("make", "path", "end", "bound"),
    [(FourBar, "rocker.velocity.x", 2.0, 60.0), (SpatialSliderCrank, "block.velocity.x", 1.0, 120.0)],
)
def test_errors_of_linkages_follow_the_tolerance(make: type, path: str, end: float, bound: float) -> None:
    """Of 31 tolerances none errs by chance; before, the worst were 266 and 411 tolerances."""
    assembly = assemble(make())
    times = np.linspace(0.0, end, 41)
    exact = simulate(assembly, rtol=1e-13, t_end=end, outputs=times)[path]
    size = np.max(np.abs(exact))
    found = []
    for rtol in np.logspace(-4.0, -8.5, 31):
        values = simulate(assembly, rtol=rtol, t_end=end, outputs=times, solver="explicit")[path]
        found.append(float(np.max(np.abs(values - exact))) / size / rtol)
    assert max(found) < bound
