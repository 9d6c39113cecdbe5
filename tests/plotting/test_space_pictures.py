"""Pictures of scenes in space: every scene, from every side, with what is in it found from its laws."""

import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import atwood
from atwood import Component, Frame, ResultError, Scalar, Scene, UsageError, Vector, connector, constraint, dot
from atwood.pipeline import simulate
from atwood.plotting.camera import as_camera
from atwood.plotting.scene3d.model import SpaceModel, build_model
from atwood.plotting.scene3d.picture import make_space_picture
from atwood.plotting.scene3d.reading import read_scene
from atwood.result.result import Result
from atwood_library import (
    Cylindrical,
    Damper,
    Ground,
    Link,
    Pivot,
    Planar,
    PointMass,
    PointOnCircle,
    PointOnPlane,
    RigidBody,
    Rope,
    Screw,
    Slider,
    Spring,
    Weld,
)
from atwood_library.scenes import SCENES, LagrangeTop

from ..helpers.runs import EVERYDAY, GENERAL

pytest.importorskip("matplotlib")

from atwood.plotting import animate, plot_mechanism, plot_on_sphere

from .planar import fingerprint

IN_SPACE = [
    name for name in (*GENERAL, "bead-on-wire", "bead-on-surface", "rattleback") if SCENES[name]().space == "space"
]
FLAT = [*EVERYDAY, "four-bar-row"]


@pytest.fixture(scope="module")
def results() -> dict[str, Result]:
    return {name: simulate(SCENES[name](), t_end=0.5, rtol=1e-6, outputs=41) for name in IN_SPACE}


@pytest.fixture(scope="module")
def models(results: dict[str, Result]) -> dict[str, SpaceModel]:
    return {name: build_model(read_scene(result)) for name, result in results.items()}


class Mixed(Scene):
    """One of each joint beside the others, and things that go between nodes."""

    space = "space"

    def build(self) -> None:
        """Put each thing in a place of its own."""
        block = {"mass": 1.0, "moments": (0.02, 0.03, 0.04)}
        for number, (name, joint, part) in enumerate(
            (
                ("planar", Planar(), RigidBody(**block)),
                ("bush", Cylindrical(axis=(1.0, 0.0, 0.0)), RigidBody(**block)),
                ("screw", Screw(pitch=0.3), RigidBody(**block)),
                ("hoop", PointOnCircle(axis=(0.0, 1.0, 0.0), radius=0.6), PointMass()),
                ("table", PointOnPlane(axis=(0.0, 0.3, 1.0)), PointMass()),
                ("rail", Slider(axis=(1.0, 0.0, 0.0)), PointMass()),
                ("hinge", Pivot(), Link(length=0.8)),
            )
        ):
            ground = self.add(f"ground_{name}", Ground(position=(2.0 * (number % 3), 2.0 * (number // 3), 0.0)))
            held, moving = self.add(name, joint), self.add(f"part_{name}", part)
            self.connect(ground.frame, held.a)
            self.connect(held.b, moving.connectors()["a" if name == "hinge" else next(iter(moving.connectors()))])
        spring, damper, rope = self.add("spring", Spring()), self.add("damper", Damper()), self.add("rope", Rope())
        arm, bob, other = self.add("arm", Weld(displacement=(0.3, 0.0, 0.2))), PointMass(), PointMass()
        bob, other = self.add("bob", bob), self.add("other", other)
        self.connect(self.part_hinge.b, spring.a)
        self.connect(spring.b, bob.point)
        self.connect(self.part_hinge.b, damper.a)
        self.connect(damper.b, bob.point)
        self.connect(self.part_planar.frame, arm.a)
        self.connect(arm.b, rope.a)
        self.connect(rope.b, other.point)
        self.start.update({"hinge.angle": 0.4, "rail.displacement": 0.2, "rail.speed": 0.5})


@pytest.fixture(scope="module")
def mixed() -> Result:
    return simulate(Mixed(), t_end=0.1, rtol=1e-6, outputs=11)


# -- every scene ----------------------------------------------------------------------------------------------------


@pytest.mark.sample(10)
@pytest.mark.parametrize("view", [(0.0, 0.0), (90.0, 0.0), (0.0, 90.0), (200.0, -35.0)])
@pytest.mark.parametrize("name", IN_SPACE)
def test_every_scene_is_drawn_from_every_side(
    results: dict[str, Result], name: str, view: tuple[float, float], tmp_path: Path
) -> None:
    file = tmp_path / "picture.png"
    figure = plot_mechanism(results[name], file, times=[0.3], view=view)
    assert file.stat().st_size > 3000
    (axes,) = figure.axes
    (low, high), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    painted = [path.vertices for one in axes.collections if one.zorder >= 3 for path in one.get_paths()]
    points = np.concatenate([piece for piece in painted if len(piece)])
    assert len(points) > 40
    assert np.all(np.isfinite(points))
    assert low <= points[:, 0].min()
    assert points[:, 0].max() <= high
    assert bottom <= points[:, 1].min()
    assert points[:, 1].max() <= top


def test_times_stand_side_by_side(results: dict[str, Result]) -> None:
    figure = plot_mechanism(results["lagrange-top"], times=[0.0, 0.2, 0.4])
    assert [axes.get_title() for axes in figure.axes] == ["t = 0 s", "t = 0.2 s", "t = 0.4 s"]


def test_scenes_in_a_plane_are_drawn_as_before() -> None:
    wanted = json.loads((Path(__file__).parent / "planar_pictures.json").read_text(encoding="utf-8"))
    assert set(wanted) <= set(FLAT)
    for name, numbers in wanted.items():
        found = fingerprint(plot_mechanism(simulate(SCENES[name](), t_end=0.5, rtol=1e-8, outputs=41)))
        assert set(found) == set(numbers)
        for kind, values in numbers.items():
            assert found[kind] == pytest.approx(values, rel=1e-4, abs=1e-4), (name, kind)


# -- what is in them ------------------------------------------------------------------------------------------------


def test_everything_is_where_it_is(results: dict[str, Result]) -> None:
    result = results["stewart-platform"]
    reading = read_scene(result)
    for lump in reading.lumps:
        found = reading.poses[lump.body].place(lump.center)
        wanted = np.stack([result.array(f"{lump.part}.position.{axis}") for axis in "xyz"], axis=-1)
        np.testing.assert_allclose(found, wanted, atol=1e-12)
    (platform,) = (lump for lump in reading.lumps if lump.part == "platform")
    for column, axis in enumerate("xyz"):
        wanted = np.stack([result.array(f"platform.{axis}_axis.{c}") for c in "xyz"], axis=-1)
        seen = reading.poses[platform.body].axes @ platform.axes[:, column]
        np.testing.assert_allclose(seen, wanted, atol=1e-12)


def test_both_forms_are_drawn_alike(results: dict[str, Result]) -> None:
    reduced = read_scene(results["spatial-slider-crank"])
    scene = atwood.assemble(SCENES["spatial-slider-crank"](), form="dae")
    dae = read_scene(simulate(scene, t_end=0.5, rtol=1e-8, outputs=41))
    for node in reduced.used:
        np.testing.assert_allclose(dae.place(node), reduced.place(node), atol=1e-4)
    assert [(one.part, one.kind) for one in dae.joinings] == [(one.part, one.kind) for one in reduced.joinings]


@pytest.mark.parametrize(
    ("name", "kinds"),
    [
        ("bricard", {"hinge": 6}),
        ("stewart-platform", {"cross": 6, "slide": 6, "ball": 6}),
        ("gyroscope", {"hinge": 3}),
        ("flyball-governor", {"hinge": 3, "slide": 1}),
        ("double-pendulum-3d", {"cross": 2}),
        ("spatial-slider-crank", {"hinge": 1, "ball": 1, "cross": 1, "slide": 1}),
        ("free-body", {}),
    ],
)
def test_joints_are_found_from_their_laws(results: dict[str, Result], name: str, kinds: dict[str, int]) -> None:
    assert Counter(one.kind for one in read_scene(results[name]).joinings) == kinds


def test_all_joints_and_ties(mixed: Result) -> None:
    reading = read_scene(mixed)
    found = {one.part: one for one in reading.joinings}
    assert {part: (one.kind, one.turns) for part, one in found.items()} == {
        "planar": ("plane", False),
        "bush": ("slide", True),
        "screw": ("slide", True),
        "hoop": ("curve", False),
        "table": ("plane", False),
        "rail": ("slide", False),
        "hinge": ("hinge", False),
    }
    np.testing.assert_allclose(found["hinge"].axes[0], [0.0, -1.0, 0.0])
    np.testing.assert_allclose(np.abs(found["table"].axes[0]), np.array([0.0, 0.3, 1.0]) / np.hypot(0.3, 1.0))
    assert found["rail"].reach == pytest.approx((0.2, 0.2 + 0.5 * 0.1), rel=1e-6)
    curve = found["hoop"].curve
    assert curve is not None
    np.testing.assert_allclose(np.linalg.norm(curve, axis=1), 0.6)
    np.testing.assert_allclose(curve[:, 1], 0.0, atol=1e-15)
    assert {(tie.part, tie.kind) for tie in reading.ties} == {
        ("spring", "spring"),
        ("damper", "damper"),
        ("rope", "rope"),
    }
    assert len(plot_mechanism(mixed).axes) == 4


def test_a_massless_rod_is_a_rod(results: dict[str, Result]) -> None:
    (tie,) = read_scene(results["spherical-pendulum"]).ties
    assert tie.kind == "rod"


class Blade(Component):
    """It holds the velocity of one frame along an axis of another, and no place."""

    a: Frame = connector(Frame, "Where it stands.")
    b: Frame = connector(Frame, "What moves.")

    @constraint(reaction="side_force", unit="N", sign=1.0, doc="Force along the axis.")
    def edge(self) -> Scalar:
        """Return the velocity along the axis."""
        return dot(self.b.velocity - self.a.velocity, self.a.to_world(Vector(1.0, 0.0, 0.0)))


def test_what_holds_velocities_is_no_rod() -> None:
    scene = Scene(space="space", gravity=0.0)
    ground, blade = scene.add("ground", Ground()), scene.add("blade", Blade())
    body = scene.add("body", RigidBody(mass=1.0, moments=(0.1, 0.1, 0.2)))
    scene.connect(ground.frame, blade.a)
    scene.connect(blade.b, body.frame)
    scene.start.update({"body.position.x": 1.0, "body.velocity.x": 0.0, "body.velocity.y": 1.0})
    result = simulate(scene, t_end=0.1, rtol=1e-6, outputs=5)
    reading = read_scene(result)
    assert (reading.ties, reading.joinings, len(reading.lumps)) == ((), (), 1)
    assert len(plot_mechanism(result, times=[0.1]).axes) == 1


def test_a_gyroscope_has_rings(models: dict[str, SpaceModel]) -> None:
    model = models["gyroscope"]
    sizes = {}
    for piece in model.pieces:
        if piece.mesh is not None and len(piece.mesh.faces) > 800:
            sizes[piece.body] = float(np.max(np.linalg.norm(piece.mesh.vertices, axis=1)))
            # Round its axis, which is square to both of its bearings, there is nothing.
            assert np.min(np.linalg.norm(piece.mesh.vertices, axis=1)) > 0.8 * sizes[piece.body]
    outer, inner = sizes[1], sizes[2]
    rotor = max(np.max(np.linalg.norm(p.corners[:, :2], axis=1)) for p in model.pieces if p.body == 3)
    assert outer > 1.05 * inner > 1.05 * rotor


def test_the_axis_of_a_top_moves_on_a_sphere(results: dict[str, Result]) -> None:
    result = results["lagrange-top"]
    (trail,) = make_space_picture(result, as_camera(None)).trails
    assert trail.center is not None
    arms = trail.points - trail.center
    np.testing.assert_allclose(np.linalg.norm(arms, axis=1), trail.radius, rtol=1e-9)
    axis = np.stack([result.array(f"top.z_axis.{c}") for c in "xyz"], axis=-1)
    np.testing.assert_allclose(arms / trail.radius, axis, atol=1e-9)
    assert trail.heights == (0.0, 1.0)


def test_paths_of_free_ends_and_masses(results: dict[str, Result]) -> None:
    (end,) = make_space_picture(results["double-pendulum-3d"], as_camera(None)).trails
    arm = end.points[0] - np.array([results["double-pendulum-3d"].array(f"rod2.position.{c}")[0] for c in "xyz"])
    assert np.linalg.norm(arm) == pytest.approx(0.5, rel=0.02)
    assert len(make_space_picture(results["flyball-governor"], as_camera(None)).trails) == 2


def test_shafts_that_meet_stand_on_their_own_sides(models: dict[str, SpaceModel]) -> None:
    model = models["universal-shaft"]
    middles = []
    for body in (1, 2):
        corners = np.concatenate([p.corners for p in model.pieces if p.body == body])
        middles.append(model.reading.poses[body].axes[0] @ corners.mean(axis=0))
    assert middles[0][0] < -10.0 * model.unit
    assert middles[1][0] > 10.0 * model.unit


def test_there_is_a_floor_where_things_fall(results: dict[str, Result]) -> None:
    for name, view, wanted in (
        ("bricard", (30, 20), True),
        ("bricard", (30, -20), False),
        ("free-body", (30, 20), False),
    ):
        picture = make_space_picture(results[name], as_camera(view))
        assert (picture.floor is not None) is wanted
        if picture.floor is not None:
            assert picture.floor[0, 2] <= picture.cloud[:, 2].min() + 1e-12
            assert np.all(np.mod(picture.floor[:, :2] / picture.step + 1e-9, 1.0) < 1e-6)


# -- what is asked for ----------------------------------------------------------------------------------------------


def test_paths_of_chosen_connectors(results: dict[str, Result]) -> None:
    result = results["bricard"]
    for trace in ("rod3.frame", "rod3"):
        *_, trail = make_space_picture(
            result, as_camera(None), {trace: result.assembly.mechanism.graph.node_of["rod3", "frame"]}
        ).trails
        np.testing.assert_allclose(trail.points[0], [1.0, 0.0, -1.0], atol=1e-6)
        plain, traced = (plot_mechanism(result, times=[0.5], trace=one).axes[0] for one in ((), trace))
        lines = [len(axes.collections[-1].get_paths()) for axes in (plain, traced)]
        assert lines[1] > lines[0] + 20


def test_paths_of_chosen_connectors_in_a_plane() -> None:
    result = simulate(SCENES["four-bar"](), t_end=0.5, rtol=1e-6, outputs=41)
    plain, traced = (plot_mechanism(result, trace=one).axes[0] for one in ((), ("crank.b",)))
    assert len(traced.collections) == len(plain.collections) + 1
    reached = np.concatenate([path.vertices for path in traced.collections[-1].get_paths()])
    length = result.assembly.flat.parts["crank"].values["length"]
    np.testing.assert_allclose(np.linalg.norm(reached, axis=1), length, rtol=1e-6)


@pytest.mark.parametrize(
    ("trace", "said"), [("rod33", "rod3"), ("hinge1", "hinge1.a, hinge1.b"), ("", "no such connector")]
)
def test_connectors_that_there_are_not(results: dict[str, Result], trace: str, said: str) -> None:
    with pytest.raises(UsageError) as caught:
        plot_mechanism(results["bricard"], trace=[trace])
    assert said in str(caught.value)


def test_views_that_there_are_not(results: dict[str, Result], tmp_path: Path) -> None:
    flat = simulate(SCENES["simple-pendulum"](), t_end=0.1, outputs=5)
    for result, view in ((results["bricard"], (1.0, 2.0, 3.0)), (results["bricard"], (0.0, 91.0)), (flat, (0.0, 0.0))):
        with pytest.raises(UsageError, match="view"):
            plot_mechanism(result, tmp_path / "a.png", view=view)
        with pytest.raises(UsageError, match="view"):
            animate(result, tmp_path / "a.gif", view=view)
    assert not list(tmp_path.iterdir())


def test_animation_in_space(results: dict[str, Result], tmp_path: Path) -> None:
    from PIL import Image

    file = animate(results["heavy-top"], tmp_path / "run.gif", seconds=0.3, frames_per_second=10, view="10,30")
    with Image.open(file) as picture:
        assert picture.n_frames == 3  # type: ignore[attr-defined]
        frames = []
        for number in range(3):
            picture.seek(number)
            frames.append(np.asarray(picture.convert("L"), dtype=float))
    assert np.abs(frames[2] - frames[0]).max() > 50.0


def test_paths_on_the_unit_sphere(tmp_path: Path) -> None:
    runs = {
        motion: simulate(LagrangeTop(motion=motion), t_end=0.5, rtol=1e-8, outputs=101)
        for motion in ("cusps", "steady")
    }
    figure = plot_on_sphere(runs, "top.z_axis", tmp_path / "sphere.svg", view=(0, 90))
    assert [axes.get_title() for axes in figure.axes] == ["cusps", "steady"]
    # Seen from above a steady precession is a circle of the sine of the angle of the axis.
    steady = figure.axes[1].get_lines()
    tips = [line.get_data() for line in steady]
    assert any(np.hypot(float(x[-1]), float(y[-1])) == pytest.approx(0.5, abs=1e-6) for x, y in tips)
    assert "<svg" in (tmp_path / "sphere.svg").read_text(encoding="utf-8")
    assert len(plot_on_sphere(runs["cusps"], "top.x_axis").axes) == 1
    with pytest.raises(UsageError, match="its length is not one"):
        plot_on_sphere(runs, "top.spin")
    with pytest.raises(ResultError):
        plot_on_sphere(runs, "top.zaxis")
    with pytest.raises(UsageError, match="no run"):
        plot_on_sphere({}, "top.z_axis")
