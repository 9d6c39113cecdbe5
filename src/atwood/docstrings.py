"""What docstrings say of arguments and attributes, so that commands and pages say the same."""

from __future__ import annotations

import importlib
import inspect
import re
from typing import Any


def documented(of: Any) -> dict[str, str]:
    """Return what a docstring says of each argument, or attribute; what it says that others say is read there."""
    lines = inspect.cleandoc(of.__doc__ or "").split("\n")
    found: dict[str, str] = {}
    names: list[str] = []
    is_on = False
    for k, line in enumerate(lines):
        if line and k + 1 < len(lines) and set(lines[k + 1]) == {"-"}:
            is_on, names = line in ("Parameters", "Attributes"), []
        elif is_on and line and not line.startswith(" ") and set(line) != {"-"}:
            names = [one.strip(" *") for one in line.split(",")]
        elif is_on and line.strip():
            found |= {name: f"{found.get(name, '')} {line.strip()}".strip() for name in names}
    return {name: _followed(name, text) for name, text in found.items()}


def _followed(name: str, text: str) -> str:
    """Return what is said of an argument elsewhere, where a docstring points there."""
    pointed = re.match(r"(?:See|As for) `(?:atwood\.)?(\w+)`", text)
    if not pointed:
        return text
    other = getattr(importlib.import_module("atwood"), pointed[1], None)
    return documented(other).get(name, text)


def first_sentence(text: str) -> str:
    """Return the first sentence of a docstring, without marks of code."""
    return without_marks(re.split(r"(?<=\.)\s+(?=[A-Z])", text, maxsplit=1)[0])


def without_marks(text: str) -> str:
    """Return a sentence without marks of code."""
    return re.sub(r"``([^`]*)``", lambda found: found[1].strip('"'), text).replace("`", "")
