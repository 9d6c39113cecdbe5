"""Moving pictures: what is moved is what would be drawn anew, and files of three kinds hold it."""

import sys
from pathlib import Path

import numpy as np
import pytest

from atwood import Result, UsageError, animate, simulate
from atwood.plotting import drawing, moving
from atwood.plotting.camera import as_camera
from atwood.plotting.scene3d.painter import Stage
from atwood.plotting.shapes.meshes import Mesh, box, cylinder, frame_along, ring
from atwood_library.scenes import SCENES

pytest.importorskip("matplotlib")


@pytest.fixture(scope="module")
def swing() -> Result:
    return simulate(SCENES["double-pendulum"](), t_end=0.4, outputs=5)


def pixels(result: Result, moments: list[int], *, anew: bool) -> list[np.ndarray]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    found, stage = [], None
    for moment in moments:
        stage = drawing._stage(result, None, {}) if stage is None or anew else stage
        canvas = FigureCanvasAgg(stage[0])
        stage[1](moment)
        canvas.draw()
        found.append(np.array(canvas.buffer_rgba()))
    return found


@pytest.mark.parametrize("name", ["double-pendulum", "atwood", "trebuchet", "lagrange-top", "rolling-ball"])
def test_what_is_moved_is_what_would_be_drawn_anew(name: str) -> None:
    result = simulate(SCENES[name](), t_end=0.6, outputs=4)
    for moved, anew in zip(*(pixels(result, [0, 3, 1], anew=anew) for anew in (False, True)), strict=True):
        assert np.array_equal(moved, anew)
        assert np.mean(anew < 200) > 1e-3, "the picture is empty"


def test_convex_surfaces_hide_what_their_faces_hide() -> None:
    """By their planes, which is faster, as face by face."""
    random = np.random.default_rng(3)
    shapes = [box((1.0, 2.0, 0.4)), cylinder(0.6, 1.5), box((0.3, 0.3, 3.0)), ring(1.0, 0.2)]
    assert [one.planes is None for one in shapes] == [False, False, False, True]
    placed = [one.placed(random.normal(size=3), frame_along(random.normal(size=3))) for one in shapes * 3]
    kept = []
    for by_planes in (True, False):
        stage = Stage(as_camera(None), 0.03)
        for one in placed:
            mesh = Mesh(one.vertices, one.faces, one.marked)
            mesh.__dict__.update(one.__dict__ if by_planes else {**one.__dict__, "planes": None})
            stage.mesh(mesh, "#2a6fbb")
        kept.append([face.tobytes() for some in stage._shown_faces() for face in some.corners])
    assert kept[0] == kept[1]
    assert 0 < len(kept[0]) < 0.9 * sum(len(one.tones) for one in stage._faces)


@pytest.mark.parametrize(("kind", "error"), [("gif", 12), ("webp", 0)])
def test_pictures_hold_the_frames(swing: Result, tmp_path: Path, kind: str, error: int) -> None:
    from PIL import Image, ImageSequence

    moments = list(range(5))
    figure, draw = drawing._stage(swing, None, {})
    frames = [one.view(np.uint8).reshape(*one.shape, 4) for one in moving._frames(figure, draw, moments, ["swing"] * 5)]
    saved = animate(swing, tmp_path / f"swing.{kind}", seconds=0.7)
    assert saved.kind == kind
    assert f"data:image/{kind}" in saved._repr_html_()
    with Image.open(saved) as picture:
        shown = [(np.array(one.convert("RGB")), one.info["duration"]) for one in ImageSequence.Iterator(picture)]
    assert sum(duration for _, duration in shown) == 700
    below = slice(60, None)  # the time is written above
    for (found, _), frame in zip(shown, frames, strict=True):
        assert np.max(np.abs(found[below].astype(int) - frame[below, :, :3])) <= error


def test_films_need_what_writes_them(swing: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    saved = animate(swing, tmp_path / "swing.mp4", seconds=0.5)
    data = next(ffmpeg.read_frames(str(tmp_path / "swing.mp4")))
    assert data["duration"] == pytest.approx(0.5, abs=0.11)
    assert all(side % 2 == 0 for side in data["size"])
    assert saved._repr_html_().startswith("<video")
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(UsageError, match=r"pip install 'atwood\[video\]'"):
        animate(swing, tmp_path / "other.mp4")
    assert not (tmp_path / "other.mp4").exists()
