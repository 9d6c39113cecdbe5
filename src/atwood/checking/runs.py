"""A component on its test bench, run in both forms: they have to say the same, and energy has to be balanced."""

from __future__ import annotations

import warnings
from collections.abc import Iterator

import numpy as np

from atwood.checking.bench import on_bench
from atwood.checking.report import Finding
from atwood.consistency.trials import Trial
from atwood.errors import AtwoodError, ParameterError, SolveError, StartError, TopologyError
from atwood.model.declare.connectors import Frame, Shaft
from atwood.model.values.units import parse_unit
from atwood.pipeline import simulate
from atwood.result.result import Result

__all__ = ["wrong_runs"]

TOLERANCE = 1e-4
"""Relative: runs at 1e-9 of both forms differ by less, also where what is on the bench is nearly unstable."""
LENGTH_OF_RUN = 0.05
"""In seconds, with speeds of about a length, or a radian, a second."""


def wrong_runs(trials: list[Trial]) -> Iterator[Finding | None]:
    """Yield what is wrong with a run in both forms, or None; a note where no start was found.

    Parameters
    ----------
    trials
        The component in random states; the first that it can start from is taken.
    """
    space, reason = trials[0].space.name, ""
    if space == "line" and any(isinstance(one, Shaft) for one in trials[0].component.connectors().values()):
        return  # on a line nothing turns
    for trial in trials:
        results: list[Result] = []
        try:
            for form in ("reduced", "dae"):
                results.append(_run(trial, form))
        except (StartError, SolveError) as error:
            if results:
                message = f"it runs in the reduced form, and not in the dae form: {error}"
                yield Finding("failure", "both forms", "", space, message)
                return
            reason = reason or str(error)
            continue
        except TopologyError as error:
            if all(isinstance(one, Frame) for one in trial.component.connectors().values()) and _is_rigid(trial):
                return  # what stands still
            yield Finding("failure", "both forms", "", space, str(error))
            return
        except ParameterError:
            return  # values within their bounds, which do not go together
        except AtwoodError as error:
            yield Finding("failure", "both forms", "", space, str(error))
            return
        yield from _compared(results[0], results[1], space, trial.length)
        return
    yield Finding("note", "both forms", "", space, f"it could not be run on the test bench: {reason}")


def _run(trial: Trial, form: str) -> Result:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return simulate(on_bench(trial), form=form, t_end=LENGTH_OF_RUN, outputs=3, rtol=1e-9)


def _compared(one: Result, other: Result, space: str, length: float) -> Iterator[Finding | None]:
    wrong = False
    for path in one.paths:
        if path not in other:
            continue
        a, b = np.asarray(one[path]), np.asarray(other[path])
        count = min(len(a), len(b))
        a, b = a[:count], b[:count]
        off = a - b
        if one.unit(path) == "rad":
            off = np.remainder(off + np.pi, 2.0 * np.pi) - np.pi
        size = float(np.nanmax(np.abs(np.concatenate([a, b])), initial=0.0))
        size = max(size, length ** parse_unit(one.unit(path)).exponents[1])  # masses and times are some kg and s
        bad = (np.isnan(a) != np.isnan(b)) | (np.abs(np.nan_to_num(off)) > TOLERANCE * size)
        if bad.any():
            i = int(np.argmax(bad))
            name = path.removeprefix("part.")
            law = name if name != path else ""  # another one is of a body on the bench
            message = f"{name} is {a[i]:.6g} {one.unit(path)} in the reduced form, and {b[i]:.6g} in the dae form"
            yield Finding("failure", "both forms", law.split(".")[0], space, message)
            wrong = True
    if not wrong:
        yield None
    for result in (one, other):
        ledger = result.energy
        drift = float(np.ptp(ledger.kinetic + ledger.potential - ledger.work))
        drift /= max(*(float(np.ptp(part)) for part in (ledger.kinetic, ledger.potential, ledger.work)), length**2)
        if not drift < 1e-3 and not result.events:
            message = f"energy and work differ by {drift:.2g} of what the scene exchanges ({result.form} form)"
            yield Finding("failure", "power", "", space, message)
        else:
            yield None


def _is_rigid(trial: Trial) -> bool:
    """Return whether a component is a rigid joint, which may hold all there is."""
    return any(law.options.rigid for law in trial.component.laws("joint") if law.holds_in(trial.space.name))
