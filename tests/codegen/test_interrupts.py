"""Ctrl-C while machine code is made, loaded and taken out of memory again: it must not be lost in a finalizer."""

from __future__ import annotations

import gc
import sys
import weakref
from typing import Any

import pytest
from llvmlite import binding

from atwood.codegen.llvm import engine

TEXT = """
define double @twice{0}(double %x) {{
  %y = fmul double %x, 2.0
  ret double %y
}}
"""


def made(number: int) -> engine.LoadedCode:
    """Return machine code of its own."""
    name = f"twice{number}"
    return engine.load_code(engine.compile_text(TEXT.format(number), 1), [name], {})


@pytest.fixture
def finalized(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return what LLVM does within finalizers of its objects, as it happens."""
    found: list[str] = []

    def watched(kind: type, name: str) -> None:
        dispose = getattr(kind, name)

        def noted(self: Any, *arguments: Any) -> Any:
            frame = sys._getframe(1)
            while frame is not None:
                if frame.f_code.co_name == "__del__":
                    found.append(kind.__name__)
                frame = frame.f_back  # type: ignore[assignment]
            return dispose(self, *arguments)

        monkeypatch.setattr(kind, name, noted)

    for kind in (binding.ModuleRef, binding.context.ContextRef, binding.ResourceTracker):
        watched(kind, "_dispose")
    return found


def test_nothing_of_llvm_is_left_to_finalizers(finalized: list[str]) -> None:
    gc.collect()
    gone = weakref.ref(made(1))
    gc.collect()
    assert gone() is None
    assert not finalized
    assert engine._dead
    code = made(2)
    assert code.addresses
    assert not engine._dead
    assert not finalized


def test_code_that_is_no_longer_used_is_unloaded_with_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    engine._unload_dead()
    before = len(engine._graves)
    for number in range(10, 20):
        made(number)
    gc.collect()
    assert len(engine._graves) <= before + 1
