"""The kinds of trials, and the modules that make them."""

from __future__ import annotations

import importlib
import os
import traceback
from collections.abc import Callable

from .trial import Discarded, Finding, Trial

KINDS = {
    "accuracies": "accuracies",
    "arguments": "arguments",
    "broken": "broken",
    "claims": "claims",
    "contact_accuracies": "contact_accuracies",
    "contacts": "contacts",
    "control": "control",
    "files": "files",
    "functions": "functions",
    "hostile": "hostile",
    "interrupts": "interrupts",
    "levels": "levels",
    "methods": "methods",
    "poles": "poles",
    "rest": "rest",
    "scenes": "scenes",
    "sets": "sets",
    "stiff": "stiff",
    "tables": "tables",
    "metamorphic": "metamorphic",
    "narrow": "narrow",
    "switches": "switches",
    "memory": "memory",
}
"""Name of a kind and its module, whose `check(seed)` makes a trial."""


def checker(kind: str) -> Callable[[int], Trial]:
    """Return the function that makes trials of a kind."""
    check: Callable[[int], Trial] = importlib.import_module(f".{KINDS[kind]}", __package__).check
    return check


def run_trial(kind: str, seed: int) -> tuple[Trial, float]:
    """Make one trial; return it with the processor's seconds that it took. Whatever it raises is a finding."""
    began = sum(os.times()[:4])  # of this process, and of those that it started
    try:
        trial = checker(kind)(seed)
    except Discarded as reason:
        trial = Trial((f"discarded: {reason}",))
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        what = f"{type(error).__name__} from {last.name} in {last.filename.rsplit('/', 1)[-1]}"
        trial = Trial(("raised",), (Finding("crash", what, traceback.format_exc()),))
    return trial, sum(os.times()[:4]) - began
