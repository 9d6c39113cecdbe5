"""What a check of a component found."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from atwood.late import dataclass
from atwood.showing import data_of, fitted

__all__ = ["CheckReport", "Finding"]


@dataclass(frozen=True)
class Finding:
    """Something that a check found.

    Attributes
    ----------
    gravity
        ``"failure"`` for what is wrong; ``"note"`` for what may be meant, or could not be looked at.
    test
        Which test found it, such as ``"units"``.
    law
        The law that it is about; empty for the component as a whole.
    space
        ``"line"``, ``"plane"`` or ``"space"``, or several of them with commas; empty where it does not matter.
    message
        What was found.
    """

    gravity: Literal["failure", "note"]
    test: str
    law: str
    space: str
    message: str

    def __str__(self) -> str:
        place = ", ".join(word for word in (self.law, self.space) if word)
        return f"{self.gravity} ({self.test}{': ' if place else ''}{place}): {self.message}"


@dataclass(frozen=True)
class CheckReport:
    """What `atwood.check` found of a component.

    Attributes
    ----------
    component
        Name of its class.
    spaces
        The spaces that it says it exists in, all of which were looked at.
    tests
        How many comparisons each test made.
    findings
        What was found, failures first.
    """

    component: str
    spaces: tuple[str, ...]
    tests: Mapping[str, int]
    findings: tuple[Finding, ...]

    @property
    def ok(self) -> bool:
        """Whether nothing is wrong; there may be notes."""
        return not self.failures

    @property
    def is_empty(self) -> bool:
        """Whether there was nothing to check."""
        return any(one.test == "content" for one in self.findings)

    @property
    def failures(self) -> tuple[Finding, ...]:
        """What is wrong."""
        return tuple(one for one in self.findings if one.gravity == "failure")

    @property
    def notes(self) -> tuple[Finding, ...]:
        """What may be meant, or could not be looked at."""
        return tuple(one for one in self.findings if one.gravity == "note")

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        return data_of(self, "component", "ok", "spaces", "tests", "findings")

    def __str__(self) -> str:
        made = ", ".join(f"{name} {count}" for name, count in self.tests.items())
        said = "nothing to check" if self.is_empty else "sound" if self.ok else f"{len(self.failures)} failures"
        head = f"{self.component}: {said} ({made})"
        return "\n".join([head, *(f"  {one}" for one in self.findings)])

    def __repr__(self) -> str:
        return fitted(str(self))
