"""What an inertia must fulfil, principal axes, parallel axes, and composing bodies."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from atwood.errors import ParameterError
from atwood.solids import MassProperties, box, combine, cylinder, point_mass, rod, sphere, subtract

lengths = st.floats(0.05, 3.0)
coordinates = st.floats(-5.0, 5.0)
points = st.tuples(coordinates, coordinates, coordinates).map(np.array)
quaternions = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1)
rotations = quaternions.map(lambda q: Rotation.from_quat(q).as_matrix())
masses = st.floats(0.01, 100.0)
bodies = st.builds(
    lambda a, b, c, m, turn, shift: box(a, b, c, mass=m).placed(turn, shift),
    lengths,
    lengths,
    lengths,
    masses,
    rotations,
    points,
)
many = settings(derandomize=True, max_examples=150, deadline=None)


def cloud(body):
    """Six point masses with the mass properties of a body: pairs on its principal axes."""
    moments, axes = body.principal()
    squares = np.maximum(moments.sum() / 2 - moments, 0) / body.mass  # integrals of x^2 dm / m along each axis
    offsets = [sign * axes[:, k] * math.sqrt(3 * squares[k]) for k in range(3) for sign in (1, -1)]
    return [(body.mass / 6, body.centre + offset) for offset in offsets]


def by_sums(points_and_masses):
    mass = sum(m for m, _ in points_and_masses)
    centre = sum(m * r for m, r in points_and_masses) / mass
    inertia = np.zeros((3, 3))
    for m, r in points_and_masses:
        x, y, z = r - centre
        inertia += m * np.array(
            [[y * y + z * z, -x * y, -x * z], [-x * y, x * x + z * z, -y * z], [-x * z, -y * z, x * x + y * y]]
        )
    return MassProperties(mass, centre, inertia)


def kinetic_energy(points_and_masses, velocity, omega):
    return sum(0.5 * m * np.sum((velocity + np.cross(omega, r)) ** 2) for m, r in points_and_masses)


@many
@given(bodies, points, points)
def test_kinetic_energy_is_that_of_the_points_the_body_consists_of(body, velocity, omega):
    at_centre = velocity + np.cross(omega, body.centre)
    energy = 0.5 * body.mass * at_centre @ at_centre + 0.5 * omega @ body.inertia @ omega
    assert energy == pytest.approx(kinetic_energy(cloud(body), velocity, omega), rel=1e-10, abs=1e-10 * body.mass)


@many
@given(bodies, points)
def test_inertia_about_a_point_is_that_of_the_points(body, point):
    shifted = [(m, r - point) for m, r in cloud(body)]
    omega = np.array([0.3, -1.1, 0.7])
    expected = kinetic_energy(shifted, np.zeros(3), omega)
    assert 0.5 * omega @ body.inertia_about(point) @ omega == pytest.approx(expected, rel=1e-10)


@many
@given(bodies, points)
def test_inertia_about_a_point_leads_back_to_the_centre(body, point):
    back = MassProperties.from_inertia_about(body.mass, body.centre, body.inertia_about(point), point)
    assert np.allclose(back.inertia, body.inertia, rtol=0, atol=1e-12 * np.max(body.inertia_about(point)))


@many
@given(bodies, rotations, points)
def test_moving_a_body_moves_its_points(body, turn, shift):
    moved = body.placed(turn, shift)
    assert moved.is_close(by_sums([(m, turn @ r + shift) for m, r in cloud(body)]), 1e-9)
    assert moved.placed(turn.T, -turn.T @ shift).is_close(body, 1e-9)
    assert np.allclose(moved.principal_moments, body.principal_moments, rtol=1e-10)


@many
@given(bodies)
def test_principal_axes_rebuild_the_inertia_and_are_right_handed(body):
    moments, axes = body.principal()
    assert np.all(np.diff(moments) >= 0)
    assert np.allclose(axes @ np.diag(moments) @ axes.T, body.inertia, rtol=0, atol=1e-8 * moments[2])
    assert np.allclose(axes.T @ axes, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)


@many
@given(st.lists(bodies, min_size=1, max_size=5))
def test_bodies_combine_as_their_points_do(parts):
    assert combine(*parts).is_close(by_sums([point for part in parts for point in cloud(part)]), 1e-9)


@pytest.mark.sample(0)
@many
@given(st.lists(bodies, min_size=3, max_size=3), rotations, points)
def test_combining_does_not_depend_on_order_grouping_or_frame(parts, turn, shift):
    a, b, c = parts
    total = combine(a, b, c)
    assert total.is_close(combine(c, a, b), 1e-10)
    assert total.is_close(combine(combine(a, b), c), 1e-10)
    assert combine(*[part.placed(turn, shift) for part in parts]).is_close(total.placed(turn, shift), 1e-9)


@many
@given(bodies, bodies)
def test_a_hole_undoes_what_was_added(a, b):
    size = combine(a, b).inertia.trace() / a.mass
    left = subtract(combine(a, b), b)
    assert left.mass == pytest.approx(a.mass, rel=1e-9)
    assert np.allclose(left.centre, a.centre, atol=1e-9 * math.sqrt(size))


def test_combining_far_from_the_origin_loses_nothing():
    far = np.array([1e6, -2e6, 3e6])
    parts = [box(1, 2, 3, mass=2), sphere(0.5, mass=1).placed(translation=[0, 0, 2])]
    near = combine(*parts)
    moved = combine(*[part.placed(translation=far) for part in parts])
    assert np.allclose(moved.inertia, near.inertia, rtol=1e-8)


def test_a_box_with_a_hole_is_made_of_the_boxes_around_it():
    holed = subtract(box(2, 2, 1, density=5), box(1, 1, 1, density=5))
    sides = [box(2, 0.5, 1, density=5).placed(translation=[0, s * 0.75, 0]) for s in (1, -1)]
    sides += [box(0.5, 1, 1, density=5).placed(translation=[s * 0.75, 0, 0]) for s in (1, -1)]
    assert holed.is_close(combine(*sides), 1e-13)


def test_points_make_a_dumb_bell():
    body = combine(point_mass(2, [1, 0, 0]), point_mass(2, [-1, 0, 0]))
    assert body.is_close(MassProperties(4, np.zeros(3), np.diag([0, 4, 4])))
    assert np.array_equal(body.principal_moments, [0, 4, 4])


@pytest.mark.parametrize(
    ("moments", "columns"),
    [
        ([2, 2, 2], [0, 1, 2]),
        ([1, 2, 3], [0, 1, 2]),
        ([3, 1, 2.5], [1, 2, 0]),
        ([2, 1, 1], [1, 2, 0]),
        ([1, 2, 2], [0, 1, 2]),
        ([1, 1, 2], [0, 1, 2]),
    ],
)
def test_axes_of_a_body_in_its_own_axes_are_those_of_the_frame(moments, columns):
    _, axes = MassProperties(1, np.zeros(3), np.diag(moments).astype(float)).principal()
    assert np.allclose(axes, np.eye(3)[:, columns], atol=1e-15)


def test_axes_are_the_same_whatever_rounding_does():
    turn = Rotation.from_rotvec([0.3, -0.8, 0.5]).as_matrix()
    axes = MassProperties(1, np.zeros(3), turn @ np.diag([1.0, 1.0, 1.7]) @ turn.T).principal_axes
    rng = np.random.default_rng(3)
    for _ in range(20):
        noise = rng.normal(size=(3, 3)) * 1e-15
        other = turn @ np.diag([1.0, 1.0, 1.7]) @ turn.T + noise + noise.T
        assert np.allclose(MassProperties(1, np.zeros(3), other).principal_axes, axes, atol=1e-12)


def test_what_is_given_is_copied_and_cannot_be_changed():
    inertia, centre = np.eye(3), np.zeros(3)
    body = MassProperties(1, centre, inertia)
    inertia[0, 0] = centre[0] = 7
    assert body.inertia[0, 0] == 1
    assert body.centre[0] == 0
    with pytest.raises(ValueError, match="read-only"):
        body.inertia[0, 0] = 2


def refused(mass=1.0, centre=(0, 0, 0), inertia=None):
    with pytest.raises(ParameterError) as caught:
        MassProperties(mass, np.array(centre), np.eye(3) if inertia is None else inertia)
    return str(caught.value)


def test_an_inertia_no_body_can_have_is_refused_with_the_moments_that_clash():
    text = refused(inertia=np.diag([1.0, 2.0, 3.5]))
    assert "1, 2, 3.5" in text
    assert "largest, 3.5" in text
    assert "other two, 3" in text
    assert "negative principal moment" in refused(inertia=np.diag([-0.5, 2.0, 2.0]))
    turn = Rotation.from_rotvec([0.3, -0.8, 0.5]).as_matrix()
    assert "1, 2, 3.5" in refused(inertia=turn @ np.diag([1.0, 2.0, 3.5]) @ turn.T)


def test_products_of_inertia_with_the_wrong_sign_are_pointed_out():
    products = by_sums(
        [(1, np.array([1.0, 1, 1])), (1, np.array([-1.0, -1, -1])), (0.1, np.array([1.0, -1, 0]))]
    ).inertia
    wrong = 2 * np.diag(np.diag(products)) - products
    assert "minus the products" in refused(inertia=wrong)
    assert "minus the products" not in refused(inertia=np.diag([1.0, 2.0, 3.5]))


def test_bad_numbers_are_refused():
    assert "not symmetric: I_xz" in refused(inertia=np.array([[2, 0, 0.1], [0, 2, 0], [0.2, 0, 2]]))
    assert "the mass is -1" in refused(mass=-1.0)
    assert "the mass is nan" in refused(mass=math.nan)
    assert "the mass is 'heavy'" in refused(mass="heavy")
    assert "not finite" in refused(centre=(0, math.inf, 0))
    assert "shape (2,)" in refused(centre=(0, 0))
    assert "shape (3,)" in refused(inertia=np.ones(3))
    assert "no mass" in refused(mass=0.0)


def test_rounding_of_plates_and_needles_is_let_pass():
    assert MassProperties(1, np.zeros(3), np.diag([0.333333, 0.333333, 0.666667])).mass == 1
    needle = MassProperties(1, np.zeros(3), np.diag([-1e-9, 1.0, 1.0]))
    assert np.linalg.eigvalsh(needle.inertia)[0] >= -1e-16
    assert MassProperties(0, np.ones(3), np.zeros((3, 3))).mass == 0


def test_an_inertia_about_the_wrong_point_says_so():
    with pytest.raises(ParameterError, match=r"1 m away.*about which|which point"):
        MassProperties.from_inertia_about(2, [1, 0, 0], np.diag([1.0, 1.0, 1.0]))


def test_rotations_that_are_none_are_refused():
    body = cylinder(1, 2, mass=3)
    with pytest.raises(ParameterError, match="mirror"):
        body.placed(np.diag([1, 1, -1]))
    with pytest.raises(ParameterError, match="right angles"):
        body.placed(np.diag([1, 1, 1.01]))


def test_combining_nothing_and_holes_that_are_too_large_are_refused():
    with pytest.raises(ParameterError, match="nothing to combine"):
        combine()
    with pytest.raises(ParameterError, match="holes take"):
        subtract(sphere(1, mass=1), sphere(2, mass=2))
    with pytest.raises(ParameterError, match="do not overlap"):
        subtract(sphere(1, mass=2), rod(9, mass=1))


def test_massless_parts_combine():
    nothing = point_mass(0, [1, 2, 3])
    assert combine(nothing, nothing).is_close(nothing)
    assert combine(nothing, sphere(1, mass=2)).is_close(sphere(1, mass=2), 1e-15)
