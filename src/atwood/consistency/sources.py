"""Where a law is written."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

from atwood.model.declare.component import Component

__all__ = ["contradiction_at", "line_of"]


def line_of(cls: type[Component], law: str) -> str:
    """Return file and line of a law, such as ``parts.py, line 12``; empty where there is no file."""
    function: Any = inspect.getattr_static(cls, law, None)
    function = inspect.unwrap(getattr(function, "_read", function)) if function is not None else None
    code = getattr(function, "__code__", None)
    if code is None:
        return ""
    return f"{Path(code.co_filename).name}, line {code.co_firstlineno}"


def contradiction_at(cls: type[Component], *laws: str) -> str:
    """Return, for the end of a message, where laws are written; empty where nothing is known."""
    places = [place for place in dict.fromkeys(line_of(cls, law) for law in laws) if place]
    return f" ({'; '.join(places)})" if places else ""
