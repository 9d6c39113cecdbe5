"""Every shape against integrals over it, and against meshes of itself."""

import math

import numpy as np
import pytest
from scipy import integrate

from atwood.errors import ParameterError
from atwood.solids import (
    MassProperties,
    box,
    closed_mesh,
    combine,
    cone,
    cylinder,
    disc,
    ellipsoid,
    mesh_solid,
    rod,
    sphere,
    spherical_shell,
    subtract,
    tube,
)

from . import meshes


def by_slices(radius_squared, inner_squared, low, high, density):
    """Mass properties of a body of revolution about z from the integrals over its slices (rings R^2, r^2)."""

    def over(weight):
        return integrate.fixed_quad(np.vectorize(weight), low, high, n=8)[0]  # exact for these polynomials

    def area(z):
        return math.pi * (radius_squared(z) - inner_squared(z))

    def about_diameter(z):
        return math.pi / 4 * (radius_squared(z) ** 2 - inner_squared(z) ** 2)

    mass = density * over(area)
    height = density * over(lambda z: z * area(z)) / mass
    across = density * over(lambda z: about_diameter(z) + (z - height) ** 2 * area(z))
    about = 2 * density * over(about_diameter)
    return MassProperties(mass, np.array([0, 0, height]), np.diag([across, across, about]))


def test_solids_of_revolution_are_the_integrals_over_their_slices():
    def nothing(z):
        return 0.0

    for made, expected in (
        (cylinder(0.7, 1.9, density=3), by_slices(lambda z: 0.49, nothing, -0.95, 0.95, 3)),
        (tube(0.7, 0.4, 1.9, density=3), by_slices(lambda z: 0.49, lambda z: 0.16, -0.95, 0.95, 3)),
        (sphere(1.3, density=2), by_slices(lambda z: 1.69 - z * z, nothing, -1.3, 1.3, 2)),
        (cone(0.8, 2.1, density=2), by_slices(lambda z: (0.8 * (1 - z / 2.1)) ** 2, nothing, 0, 2.1, 2)),
        (ellipsoid(0.8, 0.8, 0.3, density=2), by_slices(lambda z: 0.64 * (1 - z * z / 0.09), nothing, -0.3, 0.3, 2)),
    ):
        assert made.is_close(expected, 1e-11)


def test_a_box_is_the_integral_over_it():
    a, b, c = 0.5, 1.2, 2.3

    def moment(f):
        return integrate.tplquad(lambda z, y, x: 7 * f(x, y, z), -a / 2, a / 2, -b / 2, b / 2, -c / 2, c / 2)[0]

    made = box(a, b, c, density=7)
    assert made.mass == pytest.approx(7 * a * b * c)
    expected = [moment(lambda x, y, z: y * y + z * z), moment(lambda x, y, z: z * z + x * x)]
    expected.append(moment(lambda x, y, z: x * x + y * y))
    assert np.allclose(np.diag(made.inertia), expected, rtol=1e-12)


def test_textbook_values():
    """Goldstein, Poole and Safko, ch. 5, problems; Beer and Johnston, table of moments of inertia."""
    assert np.allclose(np.diag(cylinder(2, 3, mass=12).inertia), [21, 21, 24])
    assert np.allclose(np.diag(sphere(5, mass=2).inertia), 20)
    assert np.allclose(np.diag(spherical_shell(3, mass=2).inertia), 12)
    assert np.allclose(np.diag(disc(2, mass=3).inertia), [3, 3, 6])
    assert np.allclose(np.diag(disc(2, inner_radius=2, mass=3).inertia), [6, 6, 12])
    assert np.allclose(np.diag(rod(6, mass=2).inertia), [6, 6, 0])
    about_tip = cone(2, 4, mass=10).inertia_about([0, 0, 4])
    assert np.allclose(np.diag(about_tip), [3 / 5 * 10 * (1 + 16), 3 / 5 * 10 * (1 + 16), 12])
    assert np.allclose(cone(2, 4, mass=10).centre, [0, 0, 1])
    cube_about_corner = box(2, 2, 2, mass=3).inertia_about([-1, -1, -1])
    assert np.allclose(cube_about_corner, 3 * 4 * (11 / 12 * np.eye(3) - 1 / 4))


def test_masses_follow_from_densities():
    assert rod(3, line_density=2).mass == pytest.approx(6)
    assert disc(1, inner_radius=0.5, area_density=4).mass == pytest.approx(3 * math.pi)
    assert spherical_shell(2, area_density=1).mass == pytest.approx(16 * math.pi)
    assert sphere(2, inner_radius=1, density=3).mass == pytest.approx(28 * math.pi)
    assert ellipsoid(1, 2, 3, density=1).mass == pytest.approx(8 * math.pi)


def test_hollow_shapes_are_full_ones_less_a_hole():
    assert tube(2, 1, 3, density=5).is_close(subtract(cylinder(2, 3, density=5), cylinder(1, 3, density=5)), 1e-13)
    assert sphere(2, inner_radius=1, density=5).is_close(subtract(sphere(2, density=5), sphere(1, density=5)), 1e-13)


def test_thin_limits_are_reached_without_cancellation():
    almost = sphere(2, inner_radius=2 * (1 - 1e-13), mass=3)
    assert almost.is_close(spherical_shell(2, mass=3), 1e-12)
    assert sphere(2, inner_radius=2, mass=3).is_close(spherical_shell(2, mass=3), 1e-14)
    assert cylinder(2, 1e-9, mass=3).is_close(disc(2, mass=3), 1e-12)
    assert cylinder(1e-9, 2, mass=3).is_close(rod(2, mass=3), 1e-12)
    assert ellipsoid(2, 2, 2, mass=3).is_close(sphere(2, mass=3), 1e-15)


def test_the_axis_turns_the_shape():
    turn = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])  # takes z to x, x to y, y to z
    for name, arguments in ((cylinder, (1, 3)), (tube, (1, 0.5, 3)), (cone, (1, 3)), (disc, (1,)), (rod, (2,))):
        along_z = name(*arguments, mass=2)
        assert name(*arguments, mass=2, axis="x").is_close(along_z.placed(turn), 1e-15)
        assert name(*arguments, mass=2, axis="y").is_close(along_z.placed(turn @ turn), 1e-15)
    with pytest.raises(ParameterError, match="axis cannot be 'w'"):
        rod(1, mass=1, axis="w")


def of_mesh(soup, density=2.0):
    return mesh_solid(closed_mesh(soup), density=density)


def test_meshes_of_boxes_and_prisms_are_exact():
    assert of_mesh(meshes.box_mesh(0.5, 1.2, 2.3)).is_close(box(0.5, 1.2, 2.3, density=2), 1e-14)
    square = meshes.cylinder_mesh(1.0, 3.0, 4)  # a square prism with its corners on the circle
    assert of_mesh(square).is_close(box(math.sqrt(2), math.sqrt(2), 3, density=2), 1e-14)


@pytest.mark.parametrize(
    ("mesh", "shape"),
    [
        (lambda n: meshes.cylinder_mesh(0.7, 1.9, n), cylinder(0.7, 1.9, density=2)),
        (lambda n: meshes.tube_mesh(0.7, 0.4, 1.9, n), tube(0.7, 0.4, 1.9, density=2)),
        (lambda n: meshes.cone_mesh(0.8, 2.1, n), cone(0.8, 2.1, density=2)),
        (lambda n: meshes.ellipsoid_mesh(1.3, 1.3, 1.3, n), sphere(1.3, density=2)),
        (lambda n: meshes.ellipsoid_mesh(0.5, 1.3, 0.9, n), ellipsoid(0.5, 1.3, 0.9, density=2)),
    ],
)
def test_meshes_of_round_bodies_converge_with_second_order(mesh, shape):
    errors = []
    for sides in (16, 32, 64):
        found = of_mesh(mesh(sides))
        gap = np.max(np.abs(found.inertia - shape.inertia)) / np.max(shape.inertia)
        errors.append([abs(found.mass / shape.mass - 1), gap])
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    assert np.all(np.abs(orders - 2) < 0.08)
    assert np.max(errors[-1]) < 0.02


def test_a_composed_body_is_the_mesh_of_all_its_shells():
    """Two boxes side by side, one with a cavity: shells of one mesh."""
    shift = np.array([5.0, 1.0, -2.0])
    soup = np.concatenate(
        [
            meshes.box_mesh(2, 2, 2),
            meshes.box_mesh(1, 1.5, 0.5)[:, ::-1] + [0.2, 0.1, -0.3],
            meshes.box_mesh(1, 3, 1) + shift,
        ]
    )
    parts = subtract(box(2, 2, 2, density=2), box(1, 1.5, 0.5, density=2).placed(translation=[0.2, 0.1, -0.3]))
    assert of_mesh(soup).is_close(combine(parts, box(1, 3, 1, density=2).placed(translation=shift)), 1e-13)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: box(1, 1, 1), "neither is given"),
        (lambda: box(1, 1, 1, mass=1, density=1), "both are given"),
        (lambda: box(1, -1, 1, mass=1), "length along y is -1 m"),
        (lambda: sphere(math.nan, mass=1), "radius is nan"),
        (lambda: sphere(1, mass=0), "mass is 0 kg"),
        (lambda: sphere(1, density=-5), "density is -5"),
        (lambda: tube(1, 2, 1, mass=1), "greater than the outer"),
        (lambda: tube(1, -0.5, 1, mass=1), "inner radius is -0.5"),
        (lambda: tube(1, 1, 1, density=1), "Give its mass"),
        (lambda: rod("long", mass=1), "length is 'long'"),
    ],
)
def test_bad_sizes_are_refused(make, text):
    with pytest.raises(ParameterError, match=text):
        make()
