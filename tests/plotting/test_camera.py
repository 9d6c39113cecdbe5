"""The parallel projection: known directions, known points, and what is no view."""

import numpy as np
import pytest

from atwood import UsageError
from atwood.plotting.camera import DEFAULT_VIEW, as_camera, check_view

POINT = np.array([1.0, 2.0, 3.0])


@pytest.mark.parametrize(
    ("view", "page", "depth"),
    [
        ((0.0, 0.0), (1.0, 3.0), -2.0),  # from the front: as in a plane, y into the page
        ((90.0, 0.0), (2.0, 3.0), 1.0),  # from the right: along -x
        ((180.0, 0.0), (-1.0, 3.0), 2.0),  # from behind
        ((-90.0, 0.0), (-2.0, 3.0), -1.0),  # from the left
        ((0.0, 90.0), (1.0, 2.0), 3.0),  # from above: y upwards on the page
        ((0.0, -90.0), (1.0, -2.0), -3.0),  # from below
    ],
)
def test_known_points(view: tuple[float, float], page: tuple[float, float], depth: float) -> None:
    camera = as_camera(view)
    np.testing.assert_allclose(camera.project(POINT), page, atol=1e-15)
    assert camera.depth(POINT) == pytest.approx(depth, abs=1e-15)


def test_the_isometric_view_shortens_all_axes_alike() -> None:
    camera = as_camera((45.0, np.degrees(np.arctan(np.sqrt(0.5)))))
    page = camera.project(np.eye(3))
    np.testing.assert_allclose(np.linalg.norm(page, axis=1), np.sqrt(2.0 / 3.0), rtol=1e-14)
    np.testing.assert_allclose(page[2], [0.0, np.sqrt(2.0 / 3.0)], atol=1e-15)


def test_page_and_depth_are_a_turned_frame() -> None:
    for view in np.random.default_rng(3).uniform([-400.0, -90.0], [400.0, 90.0], (50, 2)):
        axes = as_camera(view).axes
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-14)
        assert np.linalg.det(axes) == pytest.approx(1.0)
        assert axes[0, 2] == 0.0  # what is level stays level
        assert axes[1, 2] >= 0.0  # what is above is drawn above


def test_a_view_without_words() -> None:
    assert as_camera(None) == as_camera(DEFAULT_VIEW)
    assert as_camera("30, 20") == as_camera((30, 20)) == as_camera(np.array([30.0, 20.0]))
    right, front, above = as_camera(None).towards * (1.0, -1.0, 1.0)
    assert min(right, front, above) > 0.2


@pytest.mark.parametrize(
    "view", ["front", "", "30", "1,2,3", (30.0,), (1.0, 2.0, 3.0), (np.nan, 0.0), (0.0, np.inf), (None, 3.0), 30.0]
)
def test_what_is_no_view(view: object) -> None:
    with pytest.raises(UsageError, match="no direction to look from") as caught:
        as_camera(view)  # type: ignore[arg-type]
    assert "azimuth and elevation in degrees" in caught.value.advice


@pytest.mark.parametrize("elevation", [90.1, -100.0])
def test_there_is_nothing_beyond_straight_above(elevation: float) -> None:
    with pytest.raises(UsageError, match="does not exist") as caught:
        as_camera((0.0, elevation))
    assert "-90" in caught.value.advice


def test_a_plane_has_one_side() -> None:
    assert check_view("space", (1.0, 2.0))
    assert check_view("space", None)
    assert not check_view("plane", None)
    for space in ("plane", "line"):
        with pytest.raises(UsageError, match="always seen from the front"):
            check_view(space, (1.0, 2.0))
