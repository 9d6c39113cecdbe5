"""What is drawn is what is there: geometry of what is on the page, where pictures once said something else."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import to_rgb

import atwood
from atwood import Scene, simulate
from atwood.plotting.camera import as_camera
from atwood.plotting.canvas import new_figure, titled, with_unit
from atwood.plotting.drawing import animate, plot_mechanism
from atwood.plotting.planar.geometry import make_picture
from atwood.plotting.plots.linear import plot_bode
from atwood.plotting.scene3d.painter import Stage
from atwood.plotting.scene3d.picture import make_space_picture
from atwood.plotting.shapes.meshes import box
from atwood.plotting.sheet import Sheet
from atwood.result.result import Result
from atwood_library import Box, Disc, Force, Ground, Link, Pivot, PointMass, RigidBody, Rope, Spring
from atwood_library.scenes import SCENES

ROPE = "#a8642a"


def ropes(result: Result, times: list[float]) -> list[np.ndarray]:
    """Return the lines of ropes that are drawn."""
    lines = plot_mechanism(result, times=times).axes[0].get_lines()
    strong = [
        line for line in lines if line.get_linewidth() == 1.6 and line.get_zorder() >= 3 and line.get_color() != 0
    ]

    return [np.array(line.get_data()).T for line in strong if np.allclose(line.get_color(), to_rgb(ROPE), atol=1e-6)]


def test_a_rope_that_was_let_go_is_not_drawn_taut() -> None:
    thrown = simulate(SCENES["trebuchet"](), outputs=61)
    (released,) = [one.time for one in thrown.events if one.target == "released"]
    assert len(ropes(thrown, [0.5 * released])) == 1
    assert not ropes(thrown, [float(thrown.time[-1])])


def test_a_slack_rope_hangs_and_is_as_long_as_it_is() -> None:
    scene = Scene(t_end=1.2)
    ground, rope, bob = (
        scene.add("g", Ground()),
        scene.add("rope", Rope(when_slack="slack")),
        scene.add("b", PointMass()),
    )
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, bob.point)
    scene.start.update({"b.position.x": 0.8, "b.position.z": 0.6, "b.velocity.x": -1.2, "b.velocity.z": 1.6})
    swung = simulate(scene, outputs=121)
    slack = next(one.time for one in swung.events if one.target == "slack") + 0.15
    (line,) = ropes(swung, [slack])
    length = float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
    way = float(np.linalg.norm(line[-1] - line[0]))
    assert way < 0.97
    assert length == pytest.approx(1.0, rel=0.03)
    assert line[20, 1] < 0.5 * (line[0, 1] + line[-1, 1])


def test_titles_are_within_the_figure() -> None:
    figure = plot_mechanism(simulate(SCENES["overhead-crane"](), outputs=11))
    title = figure.texts[0] if figure.texts else figure._suptitle  # type: ignore[attr-defined]
    title.set_wrap(False)
    box_of_title = title.get_window_extent()
    assert box_of_title.x0 >= 0.0
    assert box_of_title.x1 <= figure.get_figwidth() * figure.dpi
    assert "t = 0" in title.get_text()


def test_a_long_title_makes_a_figure_wide() -> None:
    figure = new_figure(2.0, 1.0)
    titled(figure, "A scene with a rather long name, t = 0, 0.123, 0.456, 0.789 s")
    assert figure.get_figwidth() > 4.0


def test_a_line_that_swings_is_drawn_where_it_is() -> None:
    """A mass that swings on a line of its own: it was drawn beside a straight line through all its places."""
    result = simulate(SCENES["swinging-atwood"](), outputs=61)
    moment = 40
    lines = plot_mechanism(result, times=[float(result.time[moment])]).axes[0].get_lines()
    bob = np.array([result["bob.position.x"][moment], result["bob.position.z"][moment]])
    ends = [np.array(line.get_data()).T for line in lines if len(line.get_xdata()) == 2]
    assert any(np.allclose(one, [[0.0, 0.0], bob], atol=1e-6) for one in ends)


@pytest.mark.parametrize("name", ["benchmark-bicycle", "rattleback", "rolling-disc"])
def test_what_rolls_fills_the_page_and_the_ground_hides_nothing_of_it(name: str) -> None:
    picture = make_space_picture(simulate(SCENES[name](), t_end=3.0, outputs=21), as_camera(None))
    for moment in (0, 10, 20):
        lows, highs = picture.bounds_at(moment)
        spans = []
        for piece in picture.model.pieces:
            if piece.body != 0:
                pose = picture.model.reading.poses[piece.body]
                spans.append(picture.camera.project(pose.origin[moment] + piece.corners @ pose.axes[moment].T))
        seen = np.concatenate(spans)
        assert np.all(seen >= lows)
        assert np.all(seen <= highs)
        assert np.max(np.ptp(seen, axis=0)) > 0.12 * np.max(highs - lows)
    (plane,) = [piece for piece in picture.model.pieces if piece.up is not None]
    assert plane.up[2] == pytest.approx(1.0)
    assert plane.mesh.vertices[:, 2].max() <= 1e-9


def test_what_lies_below_is_painted_first() -> None:
    stage = Stage(as_camera(None), 0.01)
    stage.mesh(box((10.0, 10.0, 0.01)), "#eef1f4", below=True)
    stage.mesh(box((0.5, 0.5, 0.5)).placed((-4.0, 4.0, 0.25), np.eye(3)), "#2a6fbb")
    axes = new_figure(3.0, 3.0).subplots()
    stage.paint(Sheet(axes), 3.0)
    colours = axes.collections[0].get_facecolor()
    is_plane = colours[:, 2] - colours[:, 0] < 0.1
    assert np.all(np.diff(is_plane.astype(int)) <= 0)
    assert 0 < is_plane.sum() < len(is_plane)


def test_wheels_within_a_body_are_seen() -> None:
    scene = Scene(space="space", gravity=0.0, t_end=0.1)
    body = scene.add("body", Box(length_x=1.0, length_y=1.0, length_z=1.0))
    axle, wheel = scene.add("axle", Pivot(axis="x")), scene.add("wheel", Disc(radius=0.2))
    scene.connect(body.frame, axle.a)
    scene.connect(axle.b, wheel.frame)
    pieces = make_space_picture(simulate(scene, outputs=3), as_camera(None)).model.pieces
    reaches = [np.ptp(one.mesh.vertices, axis=0).max() for one in pieces if one.mesh is not None]
    assert max(reaches) < 0.9  # no face of the body
    edges = [one for one in pieces if one.points is not None and len(one.points) == 2]
    assert np.ptp(np.concatenate([one.points for one in edges]), axis=0) == pytest.approx([1.0] * 3)


def half_car() -> Scene:
    scene = Scene(t_end=0.1)
    body = scene.add("body", RigidBody(mass=600.0, moments=(500.0, 1000.0, 600.0)))
    scene.start.update({"body.position.x": 0.0, "body.position.z": 0.5, "body.angle": 0.1})
    for name, length, end in (("front", 1.2, "b"), ("rear", 1.3, "a")):
        arm, spring = scene.add(name, Link(length=length)), scene.add(f"{name}_spring", Spring(stiffness=2e4))
        road = scene.add(f"{name}_road", Ground(position=(length if end == "a" else -length, 0.0, 0.0)))
        scene.connect(body.frame, getattr(arm, end))
        scene.connect(getattr(arm, "b" if end == "a" else "a"), spring.a)
        scene.connect(spring.b, road.frame)
    return scene


def test_the_arms_of_a_body_are_seen_beside_it() -> None:
    picture = make_picture(simulate(half_car(), outputs=3))
    (disc,) = [one for one in picture.shapes if one.kind == "solid"]
    arms = [one for one in picture.shapes if one.kind == "link"]
    assert len(arms) == 2
    for arm in arms:
        first, last = (picture.points[node][0] for node in arm.nodes)
        assert np.linalg.norm(disc.rim, axis=1).max() < 0.2 * np.linalg.norm(last - first)


def test_fast_motions_have_frames_enough(tmp_path) -> None:
    from PIL import Image

    result = simulate(SCENES["simple-pendulum"](), t_end=0.003, outputs=51)
    animate(result, tmp_path / "fast.gif", frames_per_second=5)
    with Image.open(tmp_path / "fast.gif") as gif:
        assert gif.n_frames == 10


def test_few_states_are_drawn_once_each_and_play_as_long(tmp_path) -> None:
    from PIL import Image, ImageSequence

    result = simulate(SCENES["simple-pendulum"](), t_end=0.1, outputs=5)
    animate(result, tmp_path / "few.gif")
    with Image.open(tmp_path / "few.gif") as gif:
        assert gif.n_frames == 5
        assert sum(frame.info["duration"] for frame in ImageSequence.Iterator(gif)) == pytest.approx(2000.0, rel=0.01)


def chain(count: int) -> Scene:
    scene = Scene(space="line")
    before = scene.add("wall", Ground()).frame
    for k in range(count):
        spring, mass = scene.add(f"s{k}", Spring(stiffness=1e4, natural_length=1.0)), scene.add(f"m{k}", PointMass())
        scene.connect(before, spring.a)
        scene.connect(spring.b, mass.point)
        before = mass.point
        scene.start[f"m{k}.position.x"] = k + 1.0
    push = scene.add("push", Force(direction="x"))
    scene.connect(push.point, scene["m0"].point)
    return scene


def test_phases_stay_within_a_turn() -> None:
    model = atwood.linearize(chain(8), inputs=["push.value"], outputs=["m7.position.x"])
    figure = plot_bode(model)
    (curve,) = figure.axes[1].get_lines()
    phases = curve.get_ydata()
    known = phases[np.isfinite(phases)]
    assert known.min() >= -180.001
    assert known.max() <= 180.0
    own = model.frequency_response(np.asarray(curve.get_xdata(), dtype=float)[np.isfinite(phases)])[:, 0, 0]
    assert np.abs(np.exp(1j * np.radians(known)) - own / np.abs(own)).max() < 1e-6
    steps = np.abs(np.diff(known[np.isfinite(known)]))
    assert np.count_nonzero(steps > 200.0) <= np.count_nonzero(~np.isfinite(phases))


def test_labels_without_a_unit_have_none() -> None:
    assert [with_unit("gain", unit) for unit in ("any", "1", "", "N")] == ["gain", "gain", "gain", "gain, N"]
