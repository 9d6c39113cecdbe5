"""Closed meshes and STL files: what is put right, and what is refused."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from atwood.errors import ParameterError
from atwood.solids import box, closed_mesh, mesh_solid, read_stl, sphere, stl_solid
from atwood.solids.mesh import winding_number

from . import meshes

numbers = st.integers(0, 2**31)


def message(soup, **options):
    with pytest.raises(ParameterError) as caught:
        closed_mesh(soup, **options)
    return str(caught.value)


@pytest.mark.sample(0)
@settings(derandomize=True, max_examples=60, deadline=None)
@given(numbers)
def test_mass_properties_move_with_the_mesh(seed):
    rng = np.random.default_rng(seed)
    soup = meshes.ellipsoid_mesh(*rng.uniform(0.2, 2, 3), 12)
    turn, shift = Rotation.random(rng=rng).as_matrix(), rng.uniform(-20, 20, 3)
    still = mesh_solid(closed_mesh(soup), density=3)
    order = rng.permutation(len(soup))
    moved_soup = (np.roll(soup, int(rng.integers(3)), axis=1) @ turn.T + shift)[order]
    assert mesh_solid(closed_mesh(moved_soup), density=3).is_close(still.placed(turn, shift), 1e-9)


def test_a_body_far_from_its_origin_loses_no_digits():
    shift = np.array([1e4, -2e4, 3e4])
    found = mesh_solid(closed_mesh(meshes.box_mesh(1, 2, 3) + shift), mass=3)
    assert np.allclose(found.inertia, box(1, 2, 3, mass=3).inertia, rtol=1e-10)


def test_an_inward_mesh_is_turned_round_and_says_so():
    mesh = closed_mesh(meshes.box_mesh(1, 2, 3)[:, ::-1])
    assert mesh.volume == pytest.approx(6)
    assert any("inward" in note for note in mesh.notes)
    assert closed_mesh(meshes.box_mesh(1, 2, 3)).notes == ()


def test_open_edges_are_counted_and_the_first_is_placed():
    soup = meshes.box_mesh(2, 2, 2)
    text = message(np.delete(soup, 3, axis=0), where="cover.stl")
    assert text.startswith("cover.stl: the mesh is not closed: 3 edges belong to one triangle only")
    place = text.split("from (")[1].split(")")[0]
    corner = np.array([float(word) for word in place.split(",")])
    assert any(np.allclose(corner, vertex) for vertex in soup[3])


def test_a_triangle_that_faces_the_other_way_is_found():
    soup = meshes.box_mesh(2, 2, 2)
    soup[4] = soup[4, ::-1]
    assert "at 3 edges neighbours face opposite ways" in message(soup)


def test_walls_inside_are_refused():
    soup = meshes.box_mesh(2, 2, 2)
    doubled = np.concatenate([soup, soup + np.array([2, 0, 0])])
    assert "belong to more than two triangles" in message(doubled)


def test_a_flat_mesh_and_no_mesh_are_refused():
    triangle = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], dtype=float)
    assert "no volume" in message(np.concatenate([triangle, triangle[:, ::-1]]))
    assert "no triangles" in message(np.empty((0, 3, 3)))
    assert "three corners" in message(np.zeros((4, 3, 3)))
    assert "not finite; the first is number 2" in message(np.array([triangle[0], triangle[0] * np.nan]))
    assert "shape (3, 3)" in message(np.eye(3))


def test_corners_that_rounding_separates_become_one():
    rng = np.random.default_rng(1)
    soup = meshes.ellipsoid_mesh(1, 1, 1, 24)
    rough = soup + rng.uniform(-2e-7, 2e-7, soup.shape)
    mesh = closed_mesh(rough)
    assert len(mesh.vertices) == len(closed_mesh(soup).vertices)
    assert any("made one" in note for note in mesh.notes)
    assert mesh.volume == pytest.approx(closed_mesh(soup).volume, rel=1e-6)
    assert "not closed" in message(rough, tolerance=0.0)
    assert "not closed" in message(soup + rng.uniform(-1e-4, 1e-4, soup.shape))


def test_collapsed_triangles_are_dropped():
    soup = meshes.box_mesh(1, 1, 1)
    needle = np.array([[soup[0, 0], soup[0, 0], soup[0, 1]]])
    mesh = closed_mesh(np.concatenate([soup, needle]))
    assert mesh.volume == pytest.approx(1)
    assert mesh.notes == ("1 triangles with two equal corners were dropped",)


def test_shells_that_face_the_wrong_way_are_refused():
    outer, inner = meshes.box_mesh(4, 4, 4), meshes.box_mesh(1, 1, 1)
    assert "faces outward although it lies inside" in message(np.concatenate([outer, inner]))
    apart = inner[:, ::-1] + [9, 0, 0]
    assert "shell around (9, 0, 0) m faces inward although it lies outside" in message(np.concatenate([outer, apart]))
    hollow = closed_mesh(np.concatenate([outer, inner[:, ::-1]]))
    assert hollow.volume == pytest.approx(63)
    inside_out = closed_mesh(np.concatenate([outer[:, ::-1], inner]))
    assert inside_out.volume == pytest.approx(63)
    core = meshes.box_mesh(0.5, 0.5, 0.5)
    assert closed_mesh(np.concatenate([outer, inner[:, ::-1], core])).volume == pytest.approx(63.125)


def test_a_mesh_that_cuts_through_itself_is_refused():
    box = meshes.box_mesh(2, 2, 2)
    corner = np.add(meshes.box_mesh(1, 1, 1), 1.0)  # an eighth of it overlaps, and would count twice
    assert "cuts through itself" in message(np.concatenate([box, corner]))
    beside = np.add(meshes.box_mesh(1, 1, 1), (2.0, 0.0, 0.0))
    assert closed_mesh(np.concatenate([box, beside])).volume == pytest.approx(9)
    ball = meshes.ellipsoid_mesh(1, 1, 1, 24)
    assert "cuts through itself" in message(np.concatenate([ball, np.add(ball, (1.2, 0.3, 0.1))]))
    # one shell that goes through itself: a ring whose hole was pushed beyond its own outside
    twisted = meshes.ellipsoid_mesh(1, 1, 1, 24)
    twisted[..., 2] *= np.where(np.hypot(twisted[..., 0], twisted[..., 1]) < 0.5, -1.0, 1.0)
    assert "cuts through itself" in message(twisted)


def test_winding_numbers():
    mesh = closed_mesh(meshes.ellipsoid_mesh(1, 1, 1, 16))
    assert winding_number(mesh.vertices, mesh.triangles, np.array([0.3, 0.2, -0.4])) == pytest.approx(1)
    assert winding_number(mesh.vertices, mesh.triangles, np.array([1.3, 0.2, -0.4])) == pytest.approx(0, abs=1e-14)


def test_both_kinds_of_file_give_the_same_body(tmp_path):
    soup = meshes.ellipsoid_mesh(0.3, 0.5, 0.7, 24)
    meshes.write_ascii(tmp_path / "a.stl", soup)
    meshes.write_binary(tmp_path / "b.stl", soup)
    meshes.write_binary(tmp_path / "c.stl", soup, header=b"solid of revolution", tail=b"colours")
    exact = mesh_solid(closed_mesh(soup), density=5)
    assert np.array_equal(read_stl(tmp_path / "a.stl"), soup)
    assert stl_solid(tmp_path / "a.stl", density=5).is_close(exact, 1e-14)
    assert stl_solid(tmp_path / "b.stl", density=5).is_close(exact, 1e-6)
    assert np.array_equal(read_stl(tmp_path / "b.stl"), read_stl(tmp_path / "c.stl"))


def test_the_scale_makes_metres_of_the_unit_of_the_file(tmp_path):
    meshes.write_ascii(tmp_path / "mm.stl", meshes.box_mesh(100, 200, 300))
    assert stl_solid(tmp_path / "mm.stl", density=1000, scale=1e-3).is_close(box(0.1, 0.2, 0.3, density=1000), 1e-12)
    assert stl_solid(tmp_path / "mm.stl", mass=2, scale=1e-3).is_close(box(0.1, 0.2, 0.3, mass=2), 1e-12)


def test_files_that_are_broken_say_how(tmp_path):
    def text(data):
        path = tmp_path / "broken.stl"
        path.write_bytes(data)
        with pytest.raises(ParameterError) as caught:
            read_stl(path)
        assert caught.value.where == str(path)
        return caught.value.message

    soup = meshes.box_mesh(1, 1, 1)
    meshes.write_binary(tmp_path / "whole.stl", soup)
    meshes.write_ascii(tmp_path / "ascii.stl", soup)
    binary, ascii_text = (tmp_path / "whole.stl").read_bytes(), (tmp_path / "ascii.stl").read_bytes()
    assert "says 12 triangles and holds 9" in text(binary[:-120])
    assert "no STL file" in text(b"hello")
    assert "no STL file" in text(b"")
    assert "no end" in text(ascii_text[:-120])
    assert "'vertex 0.5 oops 0.5'" in text(ascii_text.replace(b"vertex 0.5 0.5 0.5", b"vertex 0.5 oops 0.5"))
    assert "'vertex 0.5 0.5'" in text(ascii_text.replace(b"vertex 0.5 0.5 0.5", b"vertex 0.5 0.5"))
    assert "12 facets but 35 corners" in text(ascii_text.replace(b"vertex", b"vertices", 1))
    with pytest.raises(ParameterError, match="cannot be read"):
        read_stl(tmp_path / "missing.stl")


def test_an_empty_solid_and_a_bad_scale_are_refused(tmp_path):
    (tmp_path / "empty.stl").write_text("solid nothing\nendsolid nothing\n")
    with pytest.raises(ParameterError, match="no triangles"):
        stl_solid(tmp_path / "empty.stl", mass=1)
    with pytest.raises(ParameterError, match="scale cannot be 0"):
        stl_solid(tmp_path / "empty.stl", mass=1, scale=0)


def test_a_mesh_needs_one_of_density_and_mass():
    mesh = closed_mesh(meshes.box_mesh(1, 1, 1))
    for options, text in (({}, "neither"), ({"mass": 1, "density": 1}, "both"), ({"mass": -1}, "mass cannot be -1")):
        with pytest.raises(ParameterError, match=text):
            mesh_solid(mesh, **options)


def test_a_large_mesh():
    mesh = closed_mesh(meshes.ellipsoid_mesh(1, 1, 1, 200))
    assert len(mesh.triangles) == 2 * 200 * 99
    assert mesh_solid(mesh, density=1).is_close(sphere(1, density=1), 1e-3)
