"""Keeping the solver library's own messages off the standard output.

scikit-sundae prints what IDA has to say about a failure.  The drivers say it themselves, in the answer they hand
back, and standard output belongs to the user.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, cast

__all__ = ["without_solver_messages"]


class _Forwarding:
    """A text stream that passes everything on except IDA's own messages."""

    def __init__(self, stream: Any) -> None:
        self.stream = stream
        self._skip = threading.local()

    def write(self, text: str) -> int:
        if text.startswith("\n[IDA") and ", Error: " in text:
            self._skip.newline = True
            return len(text)
        if text == "\n" and getattr(self._skip, "newline", False):
            self._skip.newline = False
            return 1
        return cast("int", self.stream.write(text))

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)


_forwarding_lock = threading.Lock()
_forwarding_depth = 0
_forwarding: _Forwarding | None = None


@contextmanager
def without_solver_messages() -> Iterator[None]:
    """Keep IDA's messages off the standard output; shared by all sessions that are advancing."""
    global _forwarding, _forwarding_depth
    with _forwarding_lock:
        _forwarding_depth += 1
        if _forwarding_depth == 1 and sys.stdout is not None:
            _forwarding = _Forwarding(sys.stdout)
            sys.stdout = cast("Any", _forwarding)
    try:
        yield
    finally:
        with _forwarding_lock:
            _forwarding_depth -= 1
            if _forwarding_depth == 0 and _forwarding is not None:
                if sys.stdout is cast("Any", _forwarding):
                    sys.stdout = _forwarding.stream
                _forwarding = None
