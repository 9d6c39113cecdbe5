"""Designs of sweeps: samples of parameters and starts that have distributions, as `scipy.stats.qmc` makes them.

(I. M. Sobol, USSR Comput. Math. Math. Phys. 7, 1967; M. D. McKay, R. J. Beckman and W. J. Conover, Technometrics 21,
1979; for ``"saltelli"`` A. Saltelli et al., Comput. Phys. Commun. 181, 2010.)
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from atwood.arguments import one_of, optional, show, whole
from atwood.arrays import FloatArray
from atwood.errors import UsageError
from atwood.lazy_modules import scipy

DESIGNS = ("sobol", "latin", "random", "saltelli")
DESIGN = optional(one_of(DESIGNS))
RUNS = optional(whole("a whole number of runs, at least 1", 1, 2**30))
SEED = whole("a whole number, at least 0", 0)

_HALF_STEP = 2.0**-54
"""Shares are kept so far from 0 and 1, where many distributions have no value."""


def is_distribution(value: Any) -> bool:
    """Return whether a value is a distribution of `scipy.stats` with its parameters given."""
    return not isinstance(value, type) and any(callable(getattr(value, name, None)) for name in ("ppf", "icdf"))


def sampled(
    vary: Mapping[str, Any] | None,
    start: Mapping[str, Any] | None,
    design: str | None,
    runs: int | None,
    seed: int,
) -> tuple[Mapping[str, Any] | None, Mapping[str, Any] | None, str]:
    """Return parameters and starts with samples in place of distributions, and the design; as given where none is."""
    both = [(path, value) for one in (vary, start) for path, value in (one or {}).items()]
    random = [path for path, value in both if is_distribution(value)]
    if not random:
        for name, given in (("design", design), ("runs", runs)):
            if given is not None:
                advice = "Give distributions, such as scipy.stats.norm(1.0, 0.05); on a command line normal(1,0.05)."
                raise UsageError(f"nothing that is varied has a distribution for {name} = {given!r}", advice=advice)
        return vary, start, ""
    if len(random) < len(both):
        path = next(path for path, _ in both if path not in random)
        advice = "Give distributions of all that is varied, or lists."
        raise UsageError("it has a list of values, and others have distributions", where=path, advice=advice)
    if runs is None:
        raise UsageError("distributions are sampled, and it is not said how often", advice="Give runs=1024, say.")
    design = design or "sobol"
    shares = _shares(design, runs, len(random), seed)
    columns = iter(shares.T)
    found = [
        {path: _values(path, one, next(columns)) for path, one in (given or {}).items()} for given in (vary, start)
    ]
    return found[0], found[1], design


def _shares(design: str, runs: int, varied: int, seed: int) -> FloatArray:
    """Return points in the unit cube, one row a run."""
    if design == "saltelli":
        base, rest = divmod(runs, varied + 2)
        if rest:
            some = [(varied + 2) * 2 ** max(0, round(np.log2(max(base, 1))) + k) for k in (0, 1)]
            advice = f"Give runs={some[0]} or {some[1]}: {varied + 2} for each point."
            raise UsageError(f"{runs} runs are no whole number of points of the design 'saltelli'", advice=advice)
        both = _points("sobol", base, 2 * varied, seed)
        a, b = both[:, :varied], both[:, varied:]
        mixed = [np.where(np.arange(varied) == k, b, a) for k in range(varied)]
        return np.concatenate([a, b, *mixed])
    return _points(design, runs, varied, seed)


def _points(design: str, runs: int, varied: int, seed: int) -> FloatArray:
    if design == "random":
        found = np.random.default_rng(seed).random((runs, varied))
    elif design == "latin":
        found = scipy.stats.qmc.LatinHypercube(varied, seed=seed).random(runs)
    else:
        with warnings.catch_warnings():
            warnings.simplefilter(
                "ignore", UserWarning
            )  # numbers of runs that are no powers of two are as good, nearly
            found = scipy.stats.qmc.Sobol(varied, seed=seed).random(runs)
    return np.asarray(np.clip(found, _HALF_STEP, 1.0 - _HALF_STEP))


def _values(path: str, distribution: Any, shares: FloatArray) -> Any:
    """Return where a distribution has such shares below."""
    inverse = distribution.ppf if hasattr(distribution, "ppf") else distribution.icdf
    try:
        found = np.asarray(inverse(shares), dtype=float)
    except Exception as error:  # whatever a distribution of somebody's own raises
        raise UsageError(f"its distribution has no values ({error})", where=path) from error
    if found.shape != shares.shape or not np.all(np.isfinite(found)):
        advice = "Give one of a single number, with finite parameters and a scale above zero."
        raise UsageError(f"its distribution {show(distribution)} gives what is no number", where=path, advice=advice)
    return [int(one) for one in found] if hasattr(distribution, "pmf") else found
