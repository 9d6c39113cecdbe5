"""Each part of the library that has a place is drawn, in the plane and in space, as what it is."""

from typing import Any

import numpy as np
import pytest

import atwood_library as lib
from atwood import Component, Scene, simulate
from atwood.checking.bench import on_bench
from atwood.checking.samples import as_part, in_space, samples_of
from atwood.consistency.trials import make_trial
from atwood.model.values.space import make_space
from atwood.plotting.planar.geometry import make_picture
from atwood.plotting.scene3d.reading import read_scene

pytest.importorskip("matplotlib")

# What each part is drawn as, in the plane and in space.
DRAWN = {
    "Bar": ("solid", "lump"), "Box": ("solid", "lump"), "Cone": ("solid", "lump"), "Cylinder": ("solid", "lump"),
    "Disc": ("solid", "lump"), "Inertia": ("solid", "lump"), "Link": ("link", "lump"), "Mass1D": ("mass", "lump"),
    "PointMass": ("mass", "lump"), "RigidBody": ("solid", "lump"), "Rim": ("solid", "lump"), "Rod": ("rod", "rod"),
    "Sphere": ("solid", "lump"), "Tube": ("solid", "lump"),
    "Blade": ("solid", "lump"), "ConstantVelocity": ("", "ball"), "Cylindrical": ("", "slide"), "Drive": ("rail", ""),
    "Pivot": ("pivot", "hinge"), "Planar": ("", "plane"), "PointOnCircle": ("curve", "curve"),
    "PointOnLevelSurface": ("curve", "curve"), "PointOnLine": ("rail", "slide"), "PointOnPlane": ("", "plane"),
    "RollingDisc": ("rail", "plane"), "RollingEllipsoid": ("", "plane"), "RollingSphere": ("rail", "plane"),
    "RotaryDrive": ("pivot", "hinge"), "Rotor": ("pivot", "hinge"), "Screw": ("", "slide"), "Slider": ("rail", "slide"),
    "Spherical": ("pivot", "ball"), "Universal": ("", "cross"),
    "Bushing": ("spring", "spring"), "Damper": ("damper", "damper"), "Spring": ("spring", "spring"),
    "TorsionDamper": ("spiral", ""), "TorsionSpring": ("spiral", ""),
    "ElasticRope": ("rope", "spring"), "Rope": ("rope", "rope"), "WoundRope": ("rope", ""),
}  # fmt: skip


def drawn_as(kind: type[Component], space: str) -> set[str]:
    """Return what a part is drawn as, on a test bench."""
    values: Any = {"moments": (0.1, 0.1, 0.1)} if kind is lib.RigidBody else {}
    component = in_space(next(iter(samples_of(kind(**values)))).component, space)
    direction = getattr(component, "axis", None)
    part = as_part(component)
    line = direction if isinstance(direction, tuple) and direction[1] == 0.0 else (1.0, 0.0, 0.0)
    result = simulate(on_bench(make_trial(part, make_space(space, line), 0)), t_end=1e-3, outputs=2)
    locals_ = result.assembly.mechanism.locals_
    path = next(one for one in locals_ if type(locals_[one].part.component) is kind)
    if space == "plane":
        return {shape.kind for shape in make_picture(result).shapes if shape.part == path}
    reading = read_scene(result)
    found = {one.kind for one in (*reading.joinings, *reading.ties) if one.part == path}
    return found | {"lump" for one in reading.lumps if one.part == path}


@pytest.mark.sample(8)
@pytest.mark.parametrize("name", DRAWN)
def test_it_is_drawn_as_what_it_is(name: str) -> None:
    kind = getattr(lib, name)
    for space, wanted in zip(("plane", "space"), DRAWN[name], strict=True):
        if wanted:
            assert space in kind.spaces
            assert wanted in drawn_as(kind, space)


def on_curve(**values: Any) -> Scene:
    scene = Scene()
    ground, turn = scene.add("ground", lib.Ground()), scene.add("turn", lib.RotaryDrive(rotation=lambda t: 0.5 * t))
    wire, bead = scene.add("wire", lib.PointOnCurve(**values)), scene.add("bead", lib.PointMass())
    scene.connect(ground.frame, turn.a)
    scene.connect(turn.b, wire.a)
    scene.connect(wire.b, bead.point)
    scene.start["wire.parameter"], scene.start["wire.rate"] = 0.5, 0.0
    return scene


def test_a_wire_in_a_plane_is_drawn_where_the_bead_is_and_turns() -> None:
    result = simulate(on_curve(curve=("p", 0, "0.5*p**2"), lower_end=-3.0, upper_end=3.0), t_end=1.0, outputs=5)
    picture = make_picture(result)
    (wire,) = (shape for shape in picture.shapes if shape.part == "wire")
    assert wire.kind == "curve"
    assert np.allclose(wire.line[:, 1], 0.5 * wire.line[:, 0] ** 2)
    for moment, angle in enumerate(picture.angles[wire.nodes[0]]):
        c, s = np.cos(angle), np.sin(angle)
        line = picture.points[wire.nodes[0]][moment] + wire.line @ np.array([[c, s], [-s, c]])
        bead = np.array([result[f"bead.position.{axis}"][moment] for axis in "xz"])
        assert np.min(np.hypot(*(line - bead).T)) < 0.06
    straight = make_picture(simulate(on_curve(curve=("p", 0, 0)), t_end=0.1, outputs=2))
    assert {shape.kind for shape in straight.shapes if shape.part == "wire"} == {"rail"}
