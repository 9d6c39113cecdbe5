"""Scenes in a plane and on a line have the states that they had before there was space, and as few operations.

The numbers were counted by the last version that knew of no space; of scenes that came later, when they came.
"""

from __future__ import annotations

from collections.abc import Callable

import pytest

from atwood import Scene, report, sin
from atwood_library import (
    Damper,
    Force,
    Ground,
    Link,
    Mass1D,
    Pivot,
    Slider,
    Spring,
    TorsionDamper,
    TorsionSpring,
    Weld,
)
from atwood_library.scenes import SCENES, Chain, FourBarRow

from ..helpers.smooth import SMOOTH

MORE = 1.02
"""So many times the operations may be needed at most."""


def jib() -> Scene:
    """Two links welded at an angle, held by a spring and a damper."""
    scene = Scene()
    ground, post = scene.add("ground", Ground()), scene.add("post", Ground(position=(1.0, 0.0, 0.5)))
    pivot, boom = scene.add("pivot", Pivot()), scene.add("boom", Link(length=0.7, mass=2.0))
    weld = scene.add("weld", Weld(displacement=(0.3, 0.0, 0.1), angle=0.4))
    tip = scene.add("tip", Link(length=0.5, mass=1.0))
    spring = scene.add("spring", Spring(stiffness=40.0, natural_length=0.3))
    damper = scene.add("damper", Damper(damping=0.4))
    scene.connect(ground.frame, pivot.a)
    scene.connect(pivot.b, boom.a)
    scene.connect(boom.b, weld.a)
    scene.connect(weld.b, tip.a)
    for one in (spring, damper):
        scene.connect(post.frame, one.connectors()["a"])
        scene.connect(one.connectors()["b"], tip.b)
    return scene


def trolley() -> Scene:
    """A link on a slope, and one that hangs on it by a hinge with a spring and a damper, pushed at its end."""
    scene = Scene()
    ground, slide = scene.add("ground", Ground()), scene.add("slide", Slider(axis=(1.0, 0.0, 0.5)))
    body, pivot = scene.add("body", Link(length=0.4, mass=2.0)), scene.add("pivot", Pivot())
    arm = scene.add("arm", Link(length=0.5, mass=1.0))
    spring = scene.add("spring", TorsionSpring(stiffness=3.0))
    damper = scene.add("damper", TorsionDamper(damping=0.2))
    push = scene.add("push", Force(value=lambda t: sin(t)))
    scene.connect(ground.frame, slide.a)
    scene.connect(slide.b, body.a)
    scene.connect(body.b, pivot.a)
    scene.connect(pivot.b, arm.a)
    for one in (spring, damper):
        scene.connect(pivot.a, one.connectors()["a"])
        scene.connect(pivot.b, one.connectors()["b"])
    scene.connect(push.point, arm.b)
    return scene


def train() -> Scene:
    """Three masses on a line with springs, the first and the last with a damper between them."""
    scene = Scene(space="line")
    ground = scene.add("ground", Ground())
    masses = scene.add("mass", [Mass1D(mass=1.0, origin=(float(i), 0.0, 0.0)) for i in range(3)])
    springs = scene.add("spring", [Spring(stiffness=5.0, natural_length=0.9) for _ in range(3)])
    damper = scene.add("damper", Damper(damping=0.3))
    before = ground.frame
    for i, (mass, spring) in enumerate(zip(masses, springs, strict=True)):
        scene.connect(before, spring.a)
        scene.connect(spring.b, mass.flange)
        before = mass.flange
        scene.start[f"mass[{i}].displacement"] = i + 1.0
    scene.connect(masses[0].flange, damper.a)
    scene.connect(damper.b, masses[2].flange)
    return scene


# Scene: states and operations of the reduced form, then of the dae form.
RECORDED: dict[str, tuple[int, int, int, int]] = {
    "simple-pendulum": (2, 5, 6, 23),
    "double-pendulum": (4, 25, 12, 54),
    "pendulum-on-cart": (4, 17, 12, 38),
    "mass-spring-chain": (4, 14, 4, 14),
    "atwood": (2, 3, 6, 13),
    "double-atwood": (4, 10, 12, 31),
    "four-bar": (6, 59, 34, 135),
    "slider-crank": (4, 37, 30, 101),
    "chain": (20, 207, 60, 302),
    "driven-pendulum": (2, 11, 14, 42),
    "four-bar-row": (10, 104, 58, 278),
    "charged-particle": (4, 9, 4, 9),
    "kepler": (4, 15, 4, 15),
    "falling-with-drag": (4, 10, 4, 10),
    "elastic-pendulum": (4, 17, 4, 17),
    "oscillators": (2, 4, 14, 17),
    "triple-atwood": (6, 16, 18, 49),
    "pulley-with-inertia": (2, 3, 6, 13),
    "swinging-atwood": (4, 27, 24, 91),
    "overhead-crane": (2, 16, 26, 59),
    "quarter-car": (4, 23, 8, 34),
    "cart-pole": (4, 18, 16, 44),
    "chaplygin-sleigh": (6, 25, 7, 19),
    "andrews-squeezer": (14, 160, 82, 488),
    "car-axis": (4, 110, 24, 138),
    "scott-russell-lift": (6, 83, 28, 150),
    "strandbeest": (22, 422, 86, 557),
}

LARGER: dict[str, tuple[Callable[[], Scene], tuple[int, int, int, int]]] = {
    "chain of 5": (lambda: Chain(links=5), (10, 102, 30, 147)),
    "row of 1": (lambda: FourBarRow(windows=1), (6, 59, 34, 135)),
    "row of 5": (lambda: FourBarRow(windows=5), (22, 239, 130, 632)),
    "row of 10": (lambda: FourBarRow(windows=10), (42, 728, 250, 1222)),
    "jib": (jib, (2, 38, 10, 108)),
    "trolley": (trolley, (4, 32, 20, 106)),
    "train": (train, (6, 28, 6, 28)),
}


def test_every_scene_in_a_plane_or_on_a_line_is_here() -> None:
    assert set(RECORDED) == {name for name, make in SMOOTH.items() if make().space != "space"}


@pytest.mark.sample(12)
@pytest.mark.parametrize("name", [*RECORDED, *LARGER])
def test_states_and_operations_are_those_recorded(name: str) -> None:
    make, recorded = LARGER[name] if name in LARGER else (SCENES[name], RECORDED[name])
    found = report(make())
    assert found.space != "space"
    for form, (states, operations) in zip(("reduced", "dae"), (recorded[:2], recorded[2:]), strict=True):
        assert found.states[form] == states, form
        assert sum(found.operations[form].values()) <= MORE * operations, form
