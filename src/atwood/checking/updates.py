"""Updates of states: called on numbers, each gives one finite number for each state that it sets."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

from atwood.checking.forces import in_motion
from atwood.checking.report import Finding
from atwood.consistency.trials import Trial

__all__ = ["wrong_updates"]


def wrong_updates(trial: Trial, mode: str) -> Iterator[Finding | None]:
    """Yield, for each update law, what is wrong with what it returns, or None.

    Parameters
    ----------
    trial
        The component in a random state.
    mode
        Its mode.
    """
    for law in trial.component.laws("update"):
        if law.holds_in(trial.space.name) and law.acts_in(mode):
            specs = trial.component.state_specs()
            count = sum(len(specs[name].names(trial.part.values)) for name in law.options.sets)
            text = _wrong(trial, law.name, count)
            yield Finding("failure", "updates", law.name, trial.space.name, text) if text else None


def _wrong(trial: Trial, name: str, count: int) -> str:
    """Return what is wrong, in words, or nothing."""
    try:
        given = getattr(in_motion(trial), name)()
    except Exception as error:  # whatever a law of somebody's own can raise
        return f"it raises {type(error).__name__}: {error}"
    values = list(_flat(given))
    if len(values) != count:
        return f"it returns {len(values)} values where it sets {count}"
    for value in values:
        try:
            if math.isfinite(float(value)):
                continue
        except (TypeError, ValueError):
            return f"it returns {value!r} where a number is wanted"
        return f"it returns {float(value)!r}, which no state can be"
    return ""


def _flat(given: Any) -> Iterator[Any]:
    """Yield the values in what an update returned."""
    if isinstance(given, Iterable) and not isinstance(given, str):
        for one in given:
            yield from _flat(one)
    else:
        yield given
