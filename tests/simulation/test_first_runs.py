"""What a structure that is new waits for, in counts: nothing is compiled for it before its first result."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from atwood import Scene, assemble, simulate
from atwood.codegen.llvm import build, tiers
from atwood.expr.core.graph import Graph
from atwood.forms.loose import balance_now, kept_touching
from atwood_library import Ground, PointContact, PointMass, Spring
from atwood_library.scenes import SCENES

from ..helpers.runs import FORMS

NAMES = ("four-bar", "universal-shaft", "chaplygin-sleigh", "double-pendulum")


def beside(name: str, masses: int) -> Scene:
    """Return a scene of the library with masses beside it, which make another structure of it."""
    scene: Scene = SCENES[name]()
    for number in range(masses):
        scene.add(f"beside{number}", PointMass(mass=1.0))
    return scene


@pytest.mark.parametrize("form", FORMS)
def test_no_machine_code_is_awaited(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rates, projections, looks for singular positions and Taylor series begin as tapes."""
    monkeypatch.setenv("ATWOOD_CACHE", "0")
    monkeypatch.setattr(tiers, "_LEAST", math.inf)  # a busy machine is no long run
    for name in NAMES:  # what a machine makes once, whatever the scene, is there then
        simulate(beside(name, 1), form=form, t_end=0.01)
    made: list[str] = []

    def compiled(text: str, *given: Any, **named: Any) -> bytes:
        made.append(text)
        return compile_text(text, *given, **named)

    compile_text = build.compile_text
    for module in (build, tiers):
        monkeypatch.setattr(module, "compile_text", compiled)
    for name in NAMES:
        simulate(beside(name, 2), form=form, t_end=0.01)
    assert not made
    simulate(beside("four-bar", 2), form=form, solver="ida", t_end=0.01)
    assert made


def over_floors(count: int) -> Scene:
    """Return a mass on a spring over so many tilted floors, of which it comes to rest on the highest."""
    scene = Scene()
    mass = scene.add("m", PointMass(mass=1.0))
    anchor, spring = scene.add("anchor", Ground()), scene.add("spring", Spring(stiffness=20.0, natural_length=1.0))
    scene.connect(anchor.frame, spring.a)
    scene.connect(mass.point, spring.b)
    for i in range(count):
        ground = scene.add(f"ground{i}", Ground(position=(0.0, 0.0, -1.3 - i)))
        floor = scene.add(f"floor{i}", PointContact(normal=(0.1 * i, 0.0, 1.0), friction=0.3))
        scene.connect(ground.frame, floor.plane)
        scene.connect(mass.point, floor.point)
    scene.start.update({"m.position.x": 0.3, "m.position.z": -1.2, "m.velocity.x": 0.0, "m.velocity.z": 0.0})
    return scene


@pytest.mark.parametrize("form", FORMS)
def test_where_nothing_touches_the_balance_of_forces_has_no_rows_for_what_could(form: str) -> None:
    few, many = (balance_now(assemble(over_floors(n), form=form), form).program.size for n in (1, 8))
    assert few == many
    assembly = assemble(over_floors(8), form=form)
    whole = balance_now(kept_touching(assembly), form).program
    assert whole is assembly.balance(form).program
    assert whole.size > 50 * many
    state = [1.0], np.array([0.3, -1.2]), np.array([0.4, 0.5])
    loose = assembly.kernel(balance_now(assembly, form).program)(*state)
    assert loose == assembly.kernel(whole)(*state)


@pytest.mark.parametrize("form", FORMS)
def test_what_a_first_run_over_floors_derives(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    made, insert = [0], Graph._insert

    def counted(self: Graph, *given: Any, **named: Any) -> Any:
        made[0] += 1
        return insert(self, *given, **named)

    monkeypatch.setattr(Graph, "_insert", counted)
    found = []
    for count in (1, 8):
        made[0] = 0
        simulate(over_floors(count), form=form, t_end=2.0)
        found.append(made[0])
    assert found[1] <= 10_400  # 1,260 of them join known factors, which takes a fifth of the operations of each slope
    assert found[0] < 500
