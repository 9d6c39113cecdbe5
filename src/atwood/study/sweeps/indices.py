"""Sobol's indices: how much of the variance of a quantity comes from each thing that was varied.

With independent samples A and B, and A with column i of B as C_i, the first-order index is the mean of f(B) (f(C_i) -
f(A)) over the variance (A. Saltelli et al., Comput. Phys. Commun. 181, 2010), and the total index half the mean of
(f(A) - f(C_i))^2 over it (M. J. W. Jansen, Comput. Phys. Commun. 117, 1999). Errors are those of bootstrap samples of
the points (G. E. B. Archer, A. Saltelli and I. M. Sobol, J. Stat. Comput. Simul. 58, 1997).
"""

from __future__ import annotations

import numpy as np

from atwood.arguments import check, whole
from atwood.arrays import FloatArray
from atwood.errors import ResultError, UsageError
from atwood.lazy_dataclasses import dataclass
from atwood.study.sweeps.result import Sweep
from atwood.table import Shown, Table, table

_SAMPLES = whole("a whole number of bootstrap samples, 2 to 100000", 2, 100_000)


@dataclass(frozen=True, eq=False)
class SobolIndices(Shown):
    """How much of the variance of a quantity comes from each thing that was varied.

    Attributes
    ----------
    quantity
        Its path.
    paths
        What was varied.
    first
        First-order indices, shape (paths,): the share of the variance that each has alone.
    total
        Total indices, shape (paths,): the same with all that it has together with others.
    first_errors, total_errors
        Standard errors of these.
    points
        How many points of the design they come from.
    left_out
        How many points had a run without an end.
    """

    quantity: str
    paths: tuple[str, ...]
    first: FloatArray
    total: FloatArray
    first_errors: FloatArray
    total_errors: FloatArray
    points: int
    left_out: int

    def tables(self) -> tuple[Table, ...]:
        """Return the indices, a row for each thing that was varied."""
        columns = zip(self.paths, self.first, self.first_errors, self.total, self.total_errors, strict=True)
        rows = [(path, *(f"{number:.4f}" for number in numbers)) for path, *numbers in columns]
        notes = (f"{self.left_out} points were left out: a run of theirs has no end",) if self.left_out else ()
        title = f"Sobol's indices of {self.quantity}, from {self.points} points"
        return (table(("varied", "first order>", "error>", "total>", "error>"), rows, title=title, notes=notes),)


def find_indices(sweep: Sweep, path: str, samples: int) -> SobolIndices:
    """Return indices of a quantity; see `Sweep.sobol_indices`."""
    count = int(check(_SAMPLES, samples, "samples", "Sweep.sobol_indices"))
    values = sweep.end(path)
    if sweep.design != "saltelli":
        had = f"the design {sweep.design!r}" if sweep.design else "lists of values"
        advice = "Give sweep distributions and design='saltelli'."
        raise UsageError(f"Sobol's indices need runs that go together, and the sweep has {had}", advice=advice)
    varied = tuple(sweep.varied)
    blocks = values.reshape(len(varied) + 2, -1)
    whole_points = np.all(np.isfinite(blocks), axis=0)
    blocks = blocks[:, whole_points]
    points = blocks.shape[1]
    spread = np.ptp(blocks[:2]) if points > 1 else 0.0
    if not spread > 1e-14 * np.max(np.abs(blocks), initial=0.0):
        raise ResultError("it does not vary, so that nothing has a share of its variance", where=path)
    # Of a large mean plus little the products would keep few digits.
    blocks = (blocks - np.mean(blocks[:2])) / spread
    first, total = _estimates(blocks)
    rng = np.random.default_rng(0)
    drawn = [_estimates(blocks[:, rng.integers(points, size=points)]) for _ in range(count)]
    errors = [np.std([one[k] for one in drawn], axis=0, ddof=1) for k in (0, 1)]
    return SobolIndices(path, varied, first, total, errors[0], errors[1], points, int(np.sum(~whole_points)))


def _estimates(blocks: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return first-order and total indices of values by block: A, B, and each C_i."""
    a, b, mixed = blocks[0], blocks[1], blocks[2:]
    variance = np.var(blocks[:2])
    first: FloatArray = np.mean(b * (mixed - a), axis=1) / variance
    total: FloatArray = 0.5 * np.mean((a - mixed) ** 2, axis=1) / variance
    return first, total
