"""Parts that say what they look like are drawn so, in space and in the plane."""

from pathlib import Path

import numpy as np
import pytest

from atwood import Component, Outline, Scene, simulate
from atwood.plotting.planar.geometry import make_picture
from atwood.plotting.scene3d.model import build_model
from atwood.plotting.scene3d.reading import read_scene
from atwood.plotting.shapes.meshes import Mesh, outline_mesh
from atwood.solids import read_stl
from atwood_library import (
    Bar,
    Box,
    Cone,
    Cylinder,
    Disc,
    Ground,
    MeshBody,
    Pivot,
    RigidBody,
    Sphere,
    Spherical,
    Tube,
    Weld,
)

pytest.importorskip("matplotlib")

from atwood.plotting import plot_mechanism

TETRAHEDRON = Path(__file__).parents[1] / "model" / "tetrahedron.stl"

# A shape, and the lowest and highest corner of the box that it fits in.
SIZES = [
    (Box(length_x=0.3, length_y=0.2, length_z=0.7), (-0.15, -0.1, -0.35), (0.15, 0.1, 0.35)),
    (Cylinder(radius=0.1, length=0.8, axis="x"), (-0.4, -0.1, -0.1), (0.4, 0.1, 0.1)),
    (Tube(outer_radius=0.2, inner_radius=0.1, length=0.5), (-0.2, -0.2, -0.25), (0.2, 0.2, 0.25)),
    (Tube(outer_radius=0.2, inner_radius=0.0, length=0.5), (-0.2, -0.2, -0.25), (0.2, 0.2, 0.25)),
    (Sphere(radius=0.3), (-0.3, -0.3, -0.3), (0.3, 0.3, 0.3)),
    (Disc(radius=0.5, inner_radius=0.4, thickness=0.1), (-0.5, -0.05, -0.5), (0.5, 0.05, 0.5)),
    (Cone(radius=0.2, height=0.6, axis="y"), (-0.2, 0.0, -0.2), (0.2, 0.6, 0.2)),
    (MeshBody(file=TETRAHEDRON, scale=2.0), (0.0, 0.0, 0.0), (2.0, 2.0, 2.0)),
]


def volume(mesh: Mesh) -> float:
    """The volume that a surface encloses, by the divergence theorem on its triangles."""
    corners = mesh.vertices[mesh.faces]
    halves = [(0, 1, 2), (0, 2, 3)]
    return (
        sum(float(np.einsum("ij,ij->", corners[:, a], np.cross(corners[:, b], corners[:, c]))) for a, b, c in halves)
        / 6
    )


@pytest.mark.parametrize(("part", "low", "high"), SIZES, ids=[repr(part) for part, *_ in SIZES])
def test_surfaces_have_the_sizes_and_the_volume_of_the_part(part, low, high) -> None:
    mesh = outline_mesh(part.outline())
    assert np.allclose(mesh.vertices.min(axis=0), low, atol=1e-12)
    assert np.allclose(mesh.vertices.max(axis=0), high, atol=1e-12)
    # Forty corners on a circle; faces look outwards, so that the volume is positive.
    assert volume(mesh) == pytest.approx(part.volume(), rel=0.02)


def test_what_has_no_thickness_is_drawn_with_a_little() -> None:
    for part in (Disc(radius=0.5), Disc(radius=0.5, inner_radius=0.5), Tube(outer_radius=0.1, inner_radius=0.1), Bar()):
        mesh = outline_mesh(part.outline())
        assert np.all(np.ptp(mesh.vertices, axis=0) > 0.0)
        assert volume(mesh) > 0.0


def several(space: str) -> Scene:
    scene = Scene(space=space)
    ground, pivot, beam = scene.add("ground", Ground()), scene.add("pivot", Pivot()), scene.add("beam", Box())
    joint = scene.add("joint", Spherical() if space == "space" else Pivot())
    wheel, weld = (
        scene.add("wheel", Disc(inner_radius=0.3, mass=1.0)),
        scene.add("weld", Weld(displacement=(0, 0, -0.5))),
    )
    cone = scene.add("cone", Cone(density=500.0))
    scene.connect(ground.frame, pivot.a)
    scene.connect(pivot.b, beam.a)
    scene.connect(beam.b, joint.connectors()["a"])
    scene.connect(joint.connectors()["b"], wheel.frame)
    scene.connect(wheel.frame, weld.a)
    scene.connect(weld.b, cone.tip)
    scene.start["pivot.angle"] = -0.4
    return scene


def test_bodies_in_space_are_drawn_as_they_are() -> None:
    scene = several("space")
    scene.add("stone", MeshBody(file=TETRAHEDRON, density=100.0))
    result = simulate(scene.copy(), t_end=0.2, outputs=3)
    reading = read_scene(result)
    assert {lump.part for lump in reading.lumps if lump.outline is not None} == {"beam", "wheel", "cone", "stone"}
    model = build_model(reading)
    stone = next(lump for lump in reading.lumps if lump.part == "stone")
    drawn = next(piece for piece in model.pieces if piece.body == stone.body and piece.mesh is not None)
    file = np.unique(read_stl(TETRAHEDRON).reshape(-1, 3), axis=0)
    assert np.allclose(np.unique(drawn.mesh.vertices, axis=0), file, atol=1e-12)


def test_bodies_in_a_plane_are_drawn_and_turn(tmp_path: Path) -> None:
    result = simulate(several("plane"), t_end=0.5, outputs=11)
    picture = make_picture(result)
    solids = {shape.part: shape for shape in picture.shapes if shape.kind == "solid"}
    assert set(solids) == {"beam", "wheel", "cone"}
    assert np.allclose(picture.angles[solids["beam"].nodes[0]], result["beam.angle"])
    assert np.allclose(picture.angles[solids["cone"].nodes[0]], result["wheel.angle"])
    lows, highs = picture.everything().min(axis=0), picture.everything().max(axis=0)
    assert np.all(highs - lows > 1.0)
    figure = plot_mechanism(result, tmp_path / "plane.png")
    assert (tmp_path / "plane.png").stat().st_size > 1000
    assert len(figure.axes[0].collections) >= 3


def test_other_values_are_drawn_with_their_sizes() -> None:
    from atwood import assemble

    moved = assemble(several("plane")).with_values({"beam.length_x": 2.0, "beam.length_z": 0.2})
    assert moved.why_new == ""
    solids = {shape.part: shape for shape in make_picture(simulate(moved, t_end=0.1, outputs=2)).shapes}
    assert np.allclose(np.ptp(solids["beam"].surface.vertices, axis=0), (2.0, 1.0, 0.2))


def test_a_part_of_ones_own_says_what_it_looks_like() -> None:
    class Egg(RigidBody):
        """A body with a profile of its own."""

        def outline(self) -> Outline:
            """Return what it looks like."""
            return Outline.revolved(((0.0, -0.1), (0.3, 0.0), (0.0, 0.4)), "x")

    scene = Scene(space="space")
    scene.add("egg", Egg(moments=(1.0, 1.0, 1.0)))
    (lump,) = read_scene(simulate(scene, t_end=0.1, outputs=2)).lumps
    assert lump.outline is not None
    mesh = outline_mesh(lump.outline)
    assert np.allclose(np.ptp(mesh.vertices, axis=0), (0.5, 0.6, 0.6))
    assert Component.outline(scene["egg"]) is None
