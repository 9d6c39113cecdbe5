"""Surfaces are closed and face outwards; bodies look as heavy as they are; what is far is hidden by what is near."""

import numpy as np
import pytest

from atwood import solids
from atwood.plotting.camera import as_camera
from atwood.plotting.scene3d.body_shapes import BodyShape, shape_of
from atwood.plotting.scene3d.painter import Stage, lighter
from atwood.plotting.scene3d.picture import hull
from atwood.plotting.scene3d.reading import Lump
from atwood.plotting.shapes.meshes import Mesh, box, cylinder, frame_along, revolved, ring
from atwood.plotting.sheet import Sheet

pytest.importorskip("matplotlib")


def volume(mesh: Mesh) -> float:
    """Volume by the divergence theorem; right only for faces that face outwards."""
    total = 0.0
    for corners in ((0, 1, 2), (0, 2, 3)):
        a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in corners)
        total += float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0
    return total


def polygon(corners: int) -> float:
    """Area of a regular polygon over that of its circle."""
    return corners / (2.0 * np.pi) * np.sin(2.0 * np.pi / corners)


@pytest.mark.parametrize(
    ("mesh", "expected"),
    [
        (box((1.0, 2.0, 3.0)), 6.0),
        (box((0.1, 0.1, 4.0), cells=8), 0.04),
        (cylinder(0.5, 2.0), 0.5 * np.pi * polygon(36)),
        (cylinder(2.0, 0.1, around=40, marks=True), 0.4 * np.pi * polygon(40)),
        (revolved([(0.0, -1.0), (1.0, 0.0), (0.0, 1.0)], around=24), 2.0 * np.pi / 3.0 * polygon(24)),
        (ring(2.0, 0.3), 4.0 * np.pi**2 * 0.09 * polygon(14) * polygon(64)),
    ],
)
def test_surfaces_are_closed(mesh: Mesh, expected: float) -> None:
    turned = mesh.placed((5.0, -3.0, 2.0), frame_along((1.0, 2.0, -0.5), (0.3, 0.2, 0.1)))
    assert volume(mesh) == pytest.approx(expected, rel=1e-9)
    assert volume(turned) == pytest.approx(expected, rel=1e-9)
    fresh = Mesh(turned.vertices, turned.faces, turned.marked)
    np.testing.assert_allclose(turned.normals, fresh.normals, atol=1e-12)
    # Each edge lies between two faces.
    pairs = [tuple(sorted(p)) for face in mesh.faces.tolist() for p in zip(face, np.roll(face, 1), strict=True)]
    sides = {pair: pairs.count(pair) for pair in set(pairs) if pair[0] != pair[1]}
    open_ends = [pair for pair, count in sides.items() if count != 2]
    assert all(np.array_equal(mesh.vertices[a], mesh.vertices[b]) for a, b in open_ends)


def test_a_box_has_twelve_edges() -> None:
    ends, _, sharp = box((1.0, 1.0, 1.0), cells=1).edges
    assert len(ends) == 12
    assert sharp.all()
    assert not cylinder(1.0, 1.0).edges[2].all()


def lump(properties: solids.MassProperties, axes: np.ndarray | None = None) -> Lump:
    turn = np.eye(3) if axes is None else axes
    tensor = turn @ np.asarray(properties.inertia) @ turn.T
    return Lump("body", 1, 1, properties.mass, np.array([1.0, 2.0, 3.0]), turn, tensor)


@pytest.mark.parametrize("turned", [False, True])
def test_uniform_bodies_are_drawn_as_what_they_are(turned: bool) -> None:
    axes = frame_along((1.0, 2.0, -0.5)) if turned else np.eye(3)
    found = shape_of(lump(solids.box(1.0, 2.0, 3.0, mass=4.0), axes))
    assert found.kind == "box"
    np.testing.assert_allclose(found.sides, [1.0, 2.0, 3.0], rtol=1e-12)
    np.testing.assert_allclose(found.axes, axes, atol=1e-12)
    found = shape_of(lump(solids.cylinder(0.5, 2.0, mass=4.0), axes))
    assert (found.kind, found.is_long) == ("round", False)
    np.testing.assert_allclose(found.sides, [1.0, 1.0, 2.0], rtol=1e-12)
    np.testing.assert_allclose(found.axes[:, 2], axes[:, 2], atol=1e-12)
    found = shape_of(lump(solids.disc(0.5, mass=4.0), axes))
    np.testing.assert_allclose(found.sides, [1.0, 1.0, 0.0], atol=1e-7)
    found = shape_of(lump(solids.rod(2.0, mass=4.0, axis="y"), axes))
    assert found.is_long
    np.testing.assert_allclose(found.sides[2], 2.0, rtol=1e-12)
    np.testing.assert_allclose(found.ends[1] - found.center, axes[:, 1], atol=1e-12)


def inertia_of(shape: BodyShape) -> np.ndarray:
    a, b, c = shape.sides
    uniform = solids.box(a, b, c, mass=shape.lump.mass)
    if shape.kind == "round":
        uniform = solids.cylinder(0.5 * a, c, mass=shape.lump.mass)
    return shape.axes @ np.asarray(uniform.inertia) @ shape.axes.T


def test_every_inertia_has_its_shape() -> None:
    random = np.random.default_rng(5)
    for _ in range(40):
        squares = random.uniform(0.1, 2.0, 3)
        moments = squares.sum() - squares
        axes = frame_along(random.normal(size=3), random.normal(size=3))
        made = Lump("body", 1, 1, 1.7, np.zeros(3), np.eye(3), axes @ np.diag(moments) @ axes.T)
        found = shape_of(made)
        np.testing.assert_allclose(inertia_of(found), made.tensor, rtol=1e-9, atol=1e-12)
        assert np.linalg.det(found.axes) == pytest.approx(1.0)


def test_bars_are_not_drawn_too_thick_to_see_their_joints() -> None:
    bar = shape_of(lump(solids.cylinder(0.1, 2.0, mass=1.0)))
    np.testing.assert_allclose(bar.drawn(0.01, 0.05).sides, [0.05, 0.05, 2.0])
    block = shape_of(lump(solids.box(1.0, 1.1, 0.001, mass=1.0)))
    np.testing.assert_allclose(block.drawn(0.01, 0.05).sides, [1.0, 1.1, 0.01])


@pytest.mark.parametrize(
    ("properties", "point", "nearest"),
    [
        (solids.box(1.0, 1.2, 1.4, mass=1.0), (2.0, 0.1, -3.0), (0.5, 0.1, -0.7)),
        (solids.cylinder(0.5, 1.0, mass=1.0), (3.0, 4.0, 0.2), (0.3, 0.4, 0.2)),
        (solids.cylinder(0.1, 2.0, mass=1.0), (3.0, 4.0, 0.2), (0.0, 0.0, 0.2)),
    ],
)
def test_the_nearest_point_of_a_body(
    properties: solids.MassProperties, point: tuple[float, ...], nearest: tuple[float, ...]
) -> None:
    shape = shape_of(lump(properties))
    np.testing.assert_allclose(shape.nearest(shape.center + np.array(point)) - shape.center, nearest, atol=1e-12)


def painted(stage: Stage) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the faces and the lines that are painted, first ones first."""
    from matplotlib.figure import Figure

    axes = Figure().subplots()
    stage.paint(Sheet(axes), 3.0)
    faces, lines = axes.collections if len(axes.collections) == 2 else (axes.collections[0], None)
    ends = [] if lines is None else [path.vertices for path in lines.get_paths()]
    return [path.vertices for path in faces.get_paths()], ends


@pytest.mark.parametrize("height", [0.3, 1.7])
def test_a_line_behind_a_box_is_hidden(height: float) -> None:
    stage = Stage(as_camera((0.0, 0.0)), 0.02)
    stage.mesh(box((1.0, 1.0, 1.0)), "#ffffff", line=1.0)
    edges = len(painted(stage)[1])
    behind = np.array([[-2.0, 3.0, height], [2.0, 3.0, height]])
    stage.line(behind, "#000000", 1.0)
    shown = np.array(painted(stage)[1][: len(painted(stage)[1])])
    mine = shown[np.isclose(shown[:, :, 1], height).all(axis=1)]
    middle = mine.mean(axis=1)[:, 0]
    assert len(shown) > edges
    if height < 0.5:
        assert np.all(np.abs(middle) > 0.48)
        assert np.any(np.abs(middle) < 0.6)
    else:
        assert np.any(np.abs(middle) < 0.05)


def test_a_line_before_a_ball_is_seen_and_one_behind_it_is_not() -> None:
    for y, hidden in ((-2.0, False), (2.0, True)):
        stage = Stage(as_camera((0.0, 0.0)), 0.02)
        stage.ball(np.zeros(3), 0.5, "#2a6fbb")
        stage.line(np.array([[-1.0, y, 0.0], [1.0, y, 0.0]]), "#000000", 1.0)
        middle = np.array(painted(stage)[1]).mean(axis=1)[:, 0]
        assert bool(np.any(np.abs(middle) < 0.45)) is not hidden


def test_near_faces_are_painted_last() -> None:
    stage = Stage(as_camera((0.0, 0.0)), 0.02)
    for x, y in ((0.0, -5.0), (0.3, 5.0)):  # the near one first
        stage.mesh(box((1.0, 1.0, 1.0), cells=1).placed((x, y, 0.0), np.eye(3)), "#ffffff")
    faces, _ = painted(stage)
    assert [round(float(face[:4, 0].mean()), 2) for face in faces if len(face)][-1] == 0.0
    assert len(faces) == 2  # of each box the front alone


def test_colours_fade_towards_white() -> None:
    np.testing.assert_allclose(lighter("#ff0000", 0.5), [1.0, 0.5, 0.5])
    np.testing.assert_allclose(lighter("#336699", 0.0), [0.2, 0.4, 0.6])


def test_the_convex_hull() -> None:
    random = np.random.default_rng(1)
    inside = random.uniform(-1.0, 1.0, (50, 2))
    corners = np.array([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]])
    found = hull(np.concatenate([inside, corners]))
    assert {tuple(one) for one in found} == {tuple(one) for one in corners}
