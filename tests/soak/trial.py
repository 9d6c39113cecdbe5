"""What a trial of the soak says."""

from __future__ import annotations

from dataclasses import dataclass

GRAVITIES = ("wrong", "hang", "crash", "refused", "message")
"""From a wrong answer that is reported as good to an error that is no help."""


@dataclass(frozen=True)
class Finding:
    """Something that is not as it should be.

    Parameters
    ----------
    gravity
        One of `GRAVITIES`.
    what
        One line that is alike for findings with the same cause, as far as can be told: without numbers that are chance.
    detail
        All else that helps: figures, a traceback, the scene.
    """

    gravity: str
    what: str
    detail: str = ""


@dataclass(frozen=True)
class Trial:
    """What was tried with one seed, in a few words that can be counted, and what was found."""

    tried: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()


class Discarded(Exception):
    """What a seed gave is no good for a comparison: the reason, in words that can be counted."""
