"""Parts of one kind are written down as their laws would make them, node by node."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import pytest

from atwood import Component, Scene, assemble
from atwood.expr import Expression, Graph
from atwood.forms.assembly import Assembly
from atwood.model.local import kinds
from atwood.model.local.flatten import Part
from atwood.model.local.parts import LocalPart
from atwood_library import Ground, PointMass, RigidBody, Spherical, Spring, Weld
from atwood_library.scenes import SCENES, Chain


def described(one: Any, open_: tuple[int, ...] = ()) -> Iterator[str]:
    """Yield all that something is made of, with the numbers of its expressions."""
    assert id(one) not in open_
    kind, inside = type(one), (*open_, id(one))
    yield kind.__qualname__
    if isinstance(one, Expression):
        yield str(one.index)
    elif isinstance(one, tuple | list):
        for each in one:
            yield from described(each, inside)
    elif isinstance(one, dict):
        for pair in one.items():
            yield from described(pair, inside)
    elif kind.__module__.startswith("atwood.") and not isinstance(one, Graph | Component):
        slots = [name for base in kind.__mro__ for name in vars(base).get("__slots__", ())]
        for name in slots or sorted(vars(one)):
            yield name
            yield from described(getattr(one, name), inside)
    elif isinstance(one, Component):
        yield f"{one.path} {sorted(vars(one))}"
        bound = one._bound
        if bound is not None:
            yield from described(bound, inside)
    elif not isinstance(one, Graph) and not callable(one):
        yield repr(one)


def made(assembly: Assembly) -> tuple[Any, ...]:
    mechanism = assembly.mechanism
    parts = {path: [sorted(local.unread), *described(local)] for path, local in mechanism.locals_.items()}
    values = [(symbol.index, value) for symbol, value in mechanism.table.values.items()]
    return mechanism.table.graph.plain(), values, parts


def net() -> Scene:
    scene = Scene()
    masses = [scene.add(f"m{i}", PointMass(mass=1.0 + i)) for i in range(12)]
    for i, (a, b) in enumerate(pairwise(masses)):
        spring = scene.add(f"s{i}", Spring(stiffness=10.0, natural_length=0.5 * (i % 2)))
        scene.connect(a.point, spring.a)
        scene.connect(spring.b, b.point)
        scene.start.update({f"m{i}.position.x": 1000.0 + i, f"m{i}.velocity.z": 0.0})
    return scene


def bodies() -> Scene:
    scene = Scene(space="space")
    before = scene.add("ground", Ground()).frame
    for i in range(10):
        arm, ball = (
            scene.add(f"arm{i}", Weld(displacement=(0.1, 0.0, 0.2 * (i % 3)))),
            scene.add(f"ball{i}", Spherical()),
        )
        body = scene.add(f"body{i}", RigidBody(moments=(0.02, 0.02, 0.01)))
        scene.connect(before, ball.a)
        scene.connect(ball.b, arm.a)
        scene.connect(arm.b, body.frame)
        before = body.frame
    return scene


@pytest.mark.parametrize("scene", [lambda: Chain(links=12), net, bodies])
def test_parts_of_a_kind_are_as_their_laws_make_them(scene: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    read, plain = set(), kinds.Kinds.read

    def noted(self: kinds.Kinds, part: Part, laws: Callable[[Part], LocalPart]) -> LocalPart:
        return plain(self, part, lambda one: read.add(one.path) or laws(one))

    monkeypatch.setattr(kinds.Kinds, "read", noted)
    found = made(assemble(scene()))
    assert len(read) < len(found[2])
    monkeypatch.setattr(kinds, "_FEWEST", 10**9)
    assert found == made(assemble(scene()))


def test_scenes_of_the_library_too(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> None:
    names = list(SCENES) if request.config.getoption("--all") else list(SCENES)[::6]
    monkeypatch.setattr(kinds, "_FEWEST", 3)
    several = [made(assemble(SCENES[name]())) for name in names]
    monkeypatch.setattr(kinds, "_FEWEST", 10**9)
    for name, found in zip(names, several, strict=True):
        assert found == made(assemble(SCENES[name]())), name


class NamedSpring(Spring):
    """A spring whose stiffness depends on where it is."""

    def signed_stiffness(self) -> Any:
        """Return one that only one of a row has."""
        return self.stiffness * (5.0 if self.path == "s7" else 1.0)


def test_parts_whose_laws_ask_for_their_path_are_read_by_themselves(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(globals(), "Spring", NamedSpring)
    found = made(assemble(net()))
    monkeypatch.setattr(kinds, "_FEWEST", 10**9)
    assert found == made(assemble(net()))
