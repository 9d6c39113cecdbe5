"""What a structure that is new waits for, in counts: nothing is compiled for it before its first result."""

from __future__ import annotations

from typing import Any

import pytest

from atwood import Scene, simulate
from atwood.codegen.llvm import build, tiers
from atwood_library import PointMass
from atwood_library.scenes import SCENES

from ..helpers.runs import FORMS

NAMES = ("four-bar", "universal-shaft", "chaplygin-sleigh", "double-pendulum")


def beside(name: str) -> Scene:
    """Return a scene of the library with a mass beside it, which makes another structure of it."""
    scene: Scene = SCENES[name]()
    scene.add("beside", PointMass(mass=1.0))
    return scene


@pytest.mark.parametrize("form", FORMS)
def test_no_machine_code_is_awaited(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rates, projections, looks for singular positions and Taylor series begin as tapes."""
    monkeypatch.setenv("ATWOOD_CACHE", "0")
    for name in NAMES:  # what a machine makes once, whatever the scene, is there then
        simulate(SCENES[name](), form=form, t_end=0.01)
    made: list[str] = []

    def compiled(text: str, *given: Any, **named: Any) -> bytes:
        made.append(text)
        return compile_text(text, *given, **named)

    compile_text = build.compile_text
    for module in (build, tiers):
        monkeypatch.setattr(module, "compile_text", compiled)
    for name in NAMES:
        simulate(beside(name), form=form, t_end=0.01)
    assert not made
    simulate(beside("four-bar"), form=form, solver="ida", t_end=0.01)
    assert made
