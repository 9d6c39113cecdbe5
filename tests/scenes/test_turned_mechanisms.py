"""Mechanisms of the library on a base that is turned and moved: freedoms, redundancy, accelerations and forces stay."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from atwood import Component, Scene
from atwood.model.local.flatten import flatten
from atwood.pipeline import assemble
from atwood.simulation.dynamics.reactions import ReactionSolver
from atwood.simulation.initialization.start import find_start, own_state
from atwood.simulation.problem.preparation import make_problem
from atwood_library import Ground, Link, Pivot, Weld
from atwood_library.scenes import Bricard, FlyballGovernor, FourBarRow, SpatialSliderCrank, UniversalShaft

FORMS = ("reduced", "dae")
MAKE: dict[str, tuple[Callable[[], Scene], Mapping[str, float]]] = {
    "bricard": (Bricard, {"hinge1.angle": 0.3, "hinge1.angular_velocity": 2.0}),
    "row": (lambda: FourBarRow(space="space"), {"foot[0].angle": 1.1, "foot[0].angular_velocity": -1.0}),
    "shaft": (UniversalShaft, {"bearing1.angle": 0.4, "bearing1.angular_velocity": 10.0}),
    "slider-crank": (SpatialSliderCrank, {}),
    "governor": (FlyballGovernor, {}),
}
BASES = (
    (0.0, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)),
    (math.radians(45.0), (0.0, 0.0, 1.0), (30.0, -70.0, 11.0)),
    (2.1, (0.3, -1.2, 0.7), (0.1, 0.2, -0.3)),
    (1e-7, (1.0, 0.5, -0.2), (-4e3, 7e3, 5e3)),
)


def stands_on(name: str, angle: float, axis: tuple[float, ...], place: tuple[float, ...]) -> Scene:
    """Return a scene of the library, without weight, with a base in place of its grounds."""
    make, start = MAKE[name]
    scene = make()
    made = Scene(space="space", gravity=0.0)
    world, base = made.add("world", Ground(position=place)), made.add("base", Weld(angle=angle, axis=axis))
    made.connect(world.frame, base.a)

    def again(part: Component) -> Component:
        values: dict[str, Any] = {key: one for key, one in part.parameters().items() if one is not None}
        if isinstance(part, Ground):
            return Weld(displacement=values["position"], angle=values["angle"], axis=(0.0, -1.0, 0.0))
        return type(part)(**values)

    for short in dict.fromkeys(path.partition("[")[0] for path in scene.parts):
        parts: Any = getattr(scene, short)
        made.add(short, [again(one) for one in parts] if isinstance(parts, list) else again(parts))
    on_ground = {path for path, part in scene.parts.items() if isinstance(part, Ground)}
    for path in on_ground:
        made.connect(base.b, made[path].a)
    for pair in scene._connections:
        ends = [one.rpartition(".")[::2] for one in pair]
        made.connect(*(getattr(made[path], "b" if path in on_ground else end) for path, end in ends))
    flat = flatten(scene, name)
    made.start.update({**flat.start, **start})
    made.guess.update({path: value for path, value in flat.guess.items() if path not in made.start})
    return made


@dataclass(frozen=True, eq=False)
class Seen:
    """What a scene is at its start: freedoms, redundant constraints by path, sizes of forces and bearings' moments."""

    freedom: int
    redundant: tuple[str, ...]
    forces: dict[str, float]


def seen(scene: Scene, form: str) -> Seen:
    assembly = assemble(scene, form=form)
    start = find_start(assembly)
    q, u = own_state(assembly, start)
    finding = make_problem(assembly, start.time, q, u, start.length, 1.0).finding
    solver = ReactionSolver(assembly, start.time, q, u)
    values = solver.at(np.array([start.time]), q[:, None], u[:, None])[0][:, 0]
    parts: dict[str, list[float]] = {}
    for reaction, value in zip(assembly.reactions, values, strict=True):
        part, _, name = reaction.path.partition(".")
        if name.startswith(("force", "bearing_")):
            parts.setdefault(part if name.startswith("force") else f"{part}'s bearing", []).append(float(value))
    forces = {part: math.hypot(*found) for part, found in parts.items() if part not in ("world", "base")}
    redundant = tuple(assembly.maximal.constraints[i].key[0] for i in solver.finding.redundant)
    return Seen(len(u) - finding.rank, redundant, forces)


@pytest.mark.sample(2)
@pytest.mark.parametrize("base", BASES[1:], ids=lambda base: f"{base[0]:.3g}")
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", MAKE)
def test_a_mechanism_on_a_turned_base_is_the_same(name: str, form: str, base: Any) -> None:
    found, expected = seen(stands_on(name, *base), form), seen(stands_on(name, *BASES[0]), form)
    assert (found.freedom, found.redundant) == (expected.freedom, expected.redundant)
    known = [part for part, value in expected.forces.items() if math.isfinite(value)]
    size = max([expected.forces[part] for part in known] or [1.0]) or 1.0
    gaps = [abs(found.forces[part] - expected.forces[part]) / size for part in known]
    assert max(gaps) < 1e-8


# -- in the plane -----------------------------------------------------------------------------------------------------


def three_cranks(place: tuple[float, ...], length: float, mass: float, order: tuple[int, ...], prefix: str) -> Scene:
    """Return a parallelogram with a third crank, which is one constraint too many."""
    scene = Scene(space="plane", gravity=0.0)
    ground = scene.add(f"{prefix}ground", Ground(position=place))
    top = scene.add(f"{prefix}top", Link(length=2.5 * length, mass=mass))
    ends = {0: (ground.frame, top.a), 2: (None, top.b)}
    for i, share in ((1, 0.4), (2, 1.0)):
        foot, head = (
            scene.add(f"{prefix}{kind}{i}", Weld(displacement=(2.5 * share * length, 0.0, 0.0)))
            for kind in ("foot", "head")
        )
        scene.connect(ground.frame, foot.a)
        scene.connect(top.a, head.a)
        ends[i] = (foot.b, head.b)
    for i in order:
        crank = scene.add(f"{prefix}crank{i}", Link(length=length, mass=(1.0 + i) * mass))
        low, high = scene.add(f"{prefix}low{i}", Pivot()), scene.add(f"{prefix}high{i}", Pivot())
        for a, b in ((ends[i][0], low.a), (low.b, crank.a), (crank.b, high.a), (high.b, ends[i][1])):
            scene.connect(a, b)
        scene.guess.update({f"{prefix}low{i}.angle": 1.0, f"{prefix}high{i}.angle": -1.0})
    del scene.guess[f"{prefix}low0.angle"]
    scene.start.update({f"{prefix}low0.angle": 1.0, f"{prefix}low0.angular_velocity": 2.0})
    return scene


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("place", "length", "mass", "order", "prefix"),
    [
        ((1e3, 0.0, -7e2), 1.0, 1.0, (0, 1, 2), ""),
        ((1e6, 0.0, 3e5), 1.0, 1.0, (0, 1, 2), ""),
        ((1.0, 0.0, 2.0), 1e-6, 1.0, (0, 1, 2), ""),
        ((0.0, 0.0, 0.0), 1e6, 1e-6, (0, 1, 2), ""),
        ((0.1, 0.0, 0.2), 1e-3, 1e6, (2, 0, 1), "z"),
        ((3.0, 0.0, 4.0), 1.0, 1.0, (1, 2, 0), "another_"),
    ],
)
@pytest.mark.parametrize("form", FORMS)
def test_a_plane_mechanism_far_away_and_of_any_size(
    form: str, place: Any, length: float, mass: float, order: tuple[int, ...], prefix: str
) -> None:
    found = seen(three_cranks(place, length, mass, order, prefix), form)
    expected = seen(three_cranks((0.0, 0.0, 0.0), 1.0, 1.0, (0, 1, 2), ""), form)
    assert (found.freedom, len(found.redundant)) == (expected.freedom, 1) == (1, 1)
    known = 1e-13 * (1.0 + math.hypot(*place) / length)
    for i in range(3):
        force = found.forces[f"{prefix}high{i}"] / (mass * length)
        assert force == pytest.approx(expected.forces[f"high{i}"], rel=max(1e-9, 100.0 * known))
