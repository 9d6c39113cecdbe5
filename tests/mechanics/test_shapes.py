"""Rigid bodies of a simple shape: inertia from sizes, and shapes that are welded together as one body."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from atwood import (
    Component,
    ParameterError,
    Scene,
    assemble,
    from_data,
    report,
    simulate,
    sweep,
    to_data,
)
from atwood.solids import MassProperties, box, combine, cone, cylinder, disc, rod, sphere, stl_solid, tube
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
from atwood_library.interfaces.shape import Shape

from ..references.rotations import about
from ..solids.meshes import ellipsoid_mesh, write_binary

TETRAHEDRON = Path(__file__).parents[1] / "model" / "tetrahedron.stl"

# What a component should weigh and how it should turn, by atwood.solids.
ALIKE: list[tuple[Shape, MassProperties]] = [
    (Box(length_x=0.3, length_y=0.2, length_z=0.7, density=2700.0), box(0.3, 0.2, 0.7, density=2700.0)),
    (Box(length_x=0.3, length_y=0.2, length_z=0.7, mass=3.0), box(0.3, 0.2, 0.7, mass=3.0)),
    (Cylinder(radius=0.07, length=0.9, density=7800.0), cylinder(0.07, 0.9, density=7800.0)),
    (Cylinder(radius=0.07, length=0.9, mass=2.0, axis="x"), cylinder(0.07, 0.9, mass=2.0, axis="x")),
    (Tube(outer_radius=0.2, inner_radius=0.15, length=1.3, density=900.0), tube(0.2, 0.15, 1.3, density=900.0)),
    (Tube(outer_radius=0.2, inner_radius=0.2, length=1.3, mass=1.5, axis="y"), tube(0.2, 0.2, 1.3, mass=1.5, axis="y")),
    (Sphere(radius=0.4, density=1100.0), sphere(0.4, density=1100.0)),
    (Sphere(radius=0.4, inner_radius=0.39, density=1100.0), sphere(0.4, inner_radius=0.39, density=1100.0)),
    (Sphere(radius=0.4, inner_radius=0.4, mass=2.0), sphere(0.4, inner_radius=0.4, mass=2.0)),
    (Disc(radius=0.5, mass=4.0), disc(0.5, mass=4.0, axis="y")),
    (Disc(radius=0.5, inner_radius=0.5, mass=4.0, axis="z"), disc(0.5, inner_radius=0.5, mass=4.0, axis="z")),
    (Disc(radius=0.5, thickness=0.1, density=500.0, axis="x"), cylinder(0.5, 0.1, density=500.0, axis="x")),
    (Disc(radius=0.5, inner_radius=0.3, thickness=0.1, density=5.0), tube(0.5, 0.3, 0.1, density=5.0, axis="y")),
    (Cone(radius=0.2, height=0.6, density=1000.0), cone(0.2, 0.6, density=1000.0)),
    (Cone(radius=0.2, height=0.6, mass=0.7, axis="x"), cone(0.2, 0.6, mass=0.7, axis="x")),
    (Bar(length=1.7, mass=0.3), rod(1.7, mass=0.3)),
    (Bar(length=1.7, density=2000.0, area=3e-4, axis="x"), rod(1.7, line_density=0.6, axis="x")),
    (MeshBody(file=TETRAHEDRON, density=3.0), stl_solid(TETRAHEDRON, density=3.0)),
    (MeshBody(file=TETRAHEDRON, mass=3.0, scale="10 cm"), stl_solid(TETRAHEDRON, mass=3.0, scale=0.1)),
]


def properties(part: Shape) -> MassProperties:
    """What a shape says of itself, with its parameters as numbers."""
    return MassProperties(part.total_mass(), list(part.center_of_mass()), part.tensor())


@pytest.mark.parametrize(("part", "expected"), ALIKE, ids=[repr(part) for part, _ in ALIKE])
def test_inertia_is_that_of_the_solid(part: Shape, expected: MassProperties) -> None:
    assert properties(part).is_close(expected, 1e-14)


def test_inertia_by_closed_forms() -> None:
    m, r, big, h = 2.0, 0.3, 0.5, 0.8
    assert np.allclose(np.diag(Tube(outer_radius=big, inner_radius=r, length=h, mass=m).tensor()),
                       [m * (3 * (big**2 + r**2) + h**2) / 12] * 2 + [m * (big**2 + r**2) / 2], rtol=1e-14)  # fmt: skip
    assert np.allclose(np.diag(Cone(radius=r, height=h, mass=m).tensor()),
                       [3 * m * (4 * r**2 + h**2) / 80] * 2 + [3 * m * r**2 / 10], rtol=1e-14)  # fmt: skip
    shell = 2 * m * (big**5 - r**5) / (5 * (big**3 - r**3))
    assert np.allclose(np.diag(Sphere(radius=big, inner_radius=r, mass=m).tensor()), shell, rtol=1e-14)
    assert Cone(radius=r, height=h, density=1.0).total_mass() == pytest.approx(math.pi * r * r * h / 3.0, rel=1e-15)


def test_a_shape_of_which_nothing_is_said_weighs_a_kilogram() -> None:
    for kind in (Box, Cylinder, Tube, Sphere, Disc, Cone, Bar):
        assert kind().total_mass() == 1.0


# -- what cannot be -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "where", "message"),
    [
        (lambda: Box(length_x=-1.0), "Box.length_x", "too small"),
        (lambda: Sphere(radius=0.0), "Sphere.radius", "too small"),
        (lambda: Disc(thickness=-0.1), "Disc.thickness", "too small"),
        (lambda: Cylinder(mass=-1.0), "Cylinder.mass", "too small"),
        (lambda: Cylinder(density=0.0), "Cylinder.density", "too small"),
        (lambda: Cone(axis="w"), "Cone.axis", "'w'"),
        (lambda: Tube(outer_radius=0.1, inner_radius=0.2), "part.inner_radius", "greater than the outer one"),
        (lambda: Sphere(radius=0.1, inner_radius=0.2), "part.inner_radius", "greater than the outer one"),
        (lambda: Disc(radius=0.1, inner_radius=0.2), "part.inner_radius", "greater than the outer one"),
        (lambda: Tube(outer_radius=0.1, inner_radius=0.1, density=1.0), "part.density", "without volume"),
        (lambda: Disc(density=1000.0), "part.density", "without volume"),
        (lambda: Box(mass=1.0, density=1.0), "part", "both"),
        (lambda: MeshBody(), "MeshBody.file", "must be given"),
        (lambda: MeshBody(file="nowhere.stl"), "part.file", "nowhere.stl"),
        (lambda: MeshBody(file=__file__), "part.file", "test_shapes.py"),
        (lambda: MeshBody(file=""), "MeshBody.file", "no text"),
    ],
)
def test_what_cannot_be_is_refused_by_name(make: Callable[[], Component], where: str, message: str) -> None:
    def put_together() -> None:
        scene = Scene(space="space")
        scene.add("part", make())
        assemble(scene)

    with pytest.raises(ParameterError) as caught:
        put_together()
    assert caught.value.where == where
    assert message in caught.value.message
    assert caught.value.advice


def test_a_mesh_that_is_not_closed_is_refused_with_the_part(tmp_path: Path) -> None:
    write_binary(tmp_path / "open.stl", ellipsoid_mesh(1.0, 1.0, 1.0, 8)[1:])
    scene = Scene(space="space")
    scene.add("part", MeshBody(file=tmp_path / "open.stl"))
    with pytest.raises(ParameterError, match="not closed") as caught:
        assemble(scene)
    assert caught.value.where == "part.file"


# -- in scenes ----------------------------------------------------------------------------------------------------


def pendulum(body: Component, space: str = "plane", at: str = "a") -> Scene:
    """A body that hangs on a pivot, released at an angle."""
    scene = Scene(space=space)
    ground, pivot, part = scene.add("ground", Ground()), scene.add("pivot", Pivot()), scene.add("body", body)
    scene.connect(ground.frame, pivot.a)
    scene.connect(pivot.b, part.connectors()[at])
    scene.start["pivot.angle"] = 0.4
    return scene


@pytest.mark.parametrize("space", ["plane", "space"])
@pytest.mark.parametrize(
    ("body", "at", "arm"),
    [
        (Box(length_x=0.6, length_y=0.1, length_z=0.2, density=800.0), "a", (0.3, 0.0)),
        (Cylinder(radius=0.1, length=0.8, mass=2.0), "b", (0.0, -0.4)),
        (Cone(radius=0.2, height=0.5, mass=2.0), "tip", (0.0, -0.375)),
        (Tube(length=0.5, axis="x"), "b", (-0.25, 0.0)),
    ],
)
def test_pendulums_swing_as_their_moments_say(space: str, body: Shape, at: str, arm: tuple[float, float]) -> None:
    # (J + m r^2) theta'' = -m g x, with x the distance of the centre of mass from below the pivot
    result = simulate(pendulum(body.copy(), space, at), t_end=1e-3, outputs=2, rtol=1e-12)
    c, s = math.cos(0.4), math.sin(0.4)
    x = arm[0] * c - arm[1] * s
    mass, moment = body.total_mass(), body.tensor()[1][1]
    acceleration = -mass * 9.81 * x / (moment + mass * (arm[0] ** 2 + arm[1] ** 2))
    assert result["pivot.angular_velocity"][-1] / 1e-3 == pytest.approx(acceleration, rel=1e-5)


def test_a_disc_in_a_plane_may_stand_on_edge() -> None:
    for axis, moment in (("y", 0.5), ("x", 0.25), ("z", 0.25)):
        scene = pendulum(Disc(radius=1.0, mass=1.0, axis=axis), at="frame")
        scene["pivot"].motor = 2.0
        result = simulate(scene, t_end=0.1, rtol=1e-10)
        assert result["pivot.angular_velocity"][-1] == pytest.approx(0.1 * 2.0 / moment, rel=1e-9)


def test_other_sizes_need_nothing_new() -> None:
    scene = pendulum(Tube(outer_radius=0.1, inner_radius=0.05, length=0.5, density=900.0), "space")
    moved = assemble(scene).with_values({"body.outer_radius": 0.2, "body.length": 0.7})
    assert moved.why_new == ""
    anew = pendulum(Tube(outer_radius=0.2, inner_radius=0.05, length=0.7, density=900.0), "space")
    one, other = (simulate(x, t_end=1.0, rtol=1e-10) for x in (moved, anew))
    assert np.array_equal(one["pivot.angle"], other["pivot.angle"])
    with pytest.raises(ParameterError, match="greater than the outer one"):
        moved.with_values({"body.inner_radius": 0.3})


def test_a_sweep_meets_the_wall() -> None:
    scene = pendulum(Tube(outer_radius=0.1, inner_radius=0.05, length=0.5))
    given = {"body.inner_radius": [0.02, 0.08, 0.12]}
    made = sweep(scene, given, quantities=["pivot.angle"], t_end=0.5, outputs=3)
    alone = simulate(pendulum(Tube(outer_radius=0.1, inner_radius=0.08, length=0.5)), t_end=0.5, outputs=3)
    assert made["pivot.angle"][1] == pytest.approx(alone["pivot.angle"], rel=1e-9)
    assert np.isfinite(made["pivot.angle"][0]).all()
    assert not np.isfinite(made["pivot.angle"][2]).any()
    assert made.failed == (2,)
    assert "greater than the outer one" in str(made.to_dict())


def test_files_are_kept_and_may_be_others(tmp_path: Path) -> None:
    write_binary(tmp_path / "egg.stl", ellipsoid_mesh(0.1, 0.1, 0.2, 12))
    scene = Scene(space="space")
    scene.add("part", MeshBody(file=TETRAHEDRON, density=10.0))
    again = from_data(to_data(scene))
    assert again["part"].file == str(TETRAHEDRON)
    made = assemble(again)
    moved = made.with_values({"part.file": str(tmp_path / "egg.stl")})
    assert "part.file" in moved.why_new
    (mass,) = report(moved).bodies
    assert mass.mass == pytest.approx(stl_solid(tmp_path / "egg.stl", density=10.0).mass, rel=1e-12)
    larger = made.with_values({"part.scale": 2.0})
    assert larger.why_new == ""
    (mass,) = report(larger).bodies
    assert mass.mass == pytest.approx(8.0 * 10.0 / 6.0, rel=1e-12)


def test_a_file_is_looked_for_where_the_program_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files of one name, one size and one date in two folders are two files."""
    for name, height in (("low", 0.1), ("high", 0.2)):
        (tmp_path / name).mkdir()
        write_binary(tmp_path / name / "egg.stl", ellipsoid_mesh(0.1, 0.1, height, 6))
        os.utime(tmp_path / name / "egg.stl", ns=(10**18, 10**18))
    part, masses = MeshBody(file="egg.stl", density=1.0), []
    for name in ("low", "high"):
        monkeypatch.chdir(tmp_path / name)
        masses.append(part.total_mass())
    assert masses[1] == pytest.approx(2.0 * masses[0], rel=1e-6)


# -- welded together ----------------------------------------------------------------------------------------------


def _turned(axis: tuple[float, float, float], angle: float) -> np.ndarray:
    return np.asarray(about(np.array(axis) / np.linalg.norm(axis), angle))


PIECES: list[tuple[Shape, tuple[float, float, float], tuple[float, float, float], float]] = [
    (Cylinder(radius=0.05, length=0.8, density=2700.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0.0),
    (Box(length_x=0.3, length_y=0.1, length_z=0.2, mass=1.3), (0.1, 0.2, 0.4), (1.0, 0.0, 0.0), 0.7),
    (Sphere(radius=0.1, density=1000.0), (0.0, -0.3, 0.1), (0.0, 0.0, 1.0), -1.1),
    (Cone(radius=0.1, height=0.3, mass=0.4), (-0.2, 0.1, 0.0), (2.0, -1.0, 2.0), 2.3),
    (Disc(radius=0.2, inner_radius=0.1, mass=0.5), (0.3, 0.0, -0.2), (0.0, 1.0, 1.0), 0.4),
]


def welded(count: int, joined_by: str) -> Scene:
    """Some shapes welded to the first one, each on it or each on the one before, that hang on a joint."""
    scene = _hung(joined_by)
    for number, (piece, place, axis, angle) in enumerate(PIECES[:count]):
        part = scene.add(f"piece{number}", piece.copy())
        if number == 0:
            first = part
            if joined_by != "free":
                scene.connect(scene["joint"].connectors()["b"], part.frame)
            continue
        weld = scene.add(f"weld{number}", Weld(displacement=place, axis=axis, angle=angle))
        scene.connect(first.frame, weld.a)
        scene.connect(weld.b, part.frame)
    _throw(scene, "piece0", joined_by)
    return scene


def one_body(count: int, joined_by: str) -> Scene:
    """The same as a single body."""
    solids = [properties(piece).placed(_turned(axis, angle), place) for piece, place, axis, angle in PIECES[:count]]
    scene = _hung(joined_by)
    body = scene.add("piece0", RigidBody.of(combine(*solids)))
    if joined_by != "free":
        scene.connect(scene["joint"].connectors()["b"], body.frame)
    _throw(scene, "piece0", joined_by)
    return scene


def _hung(joined_by: str) -> Scene:
    scene = Scene(space="space")
    if joined_by != "free":
        ground = scene.add("ground", Ground())
        joint = scene.add("joint", Spherical() if joined_by == "ball" else Pivot(axis=(1.0, 2.0, 2.0)))
        scene.connect(ground.frame, joint.a)
    return scene


def _throw(scene: Scene, body: str, joined_by: str) -> None:
    if joined_by == "hinge":
        scene.start["joint.angle"], scene.start["joint.angular_velocity"] = 0.3, 1.0
    else:
        scene.start.update({f"{body}.spin.{axis}": rate for axis, rate in zip("xyz", (0.5, 1.0, -0.7), strict=True)})
        scene.guess.update({f"{body}.phi": 0.0})


@pytest.mark.sample(3)
@pytest.mark.parametrize("joined_by", ["free", "ball", "hinge"])
@pytest.mark.parametrize("count", [2, 3, 5])
def test_welded_shapes_cost_and_move_as_one_body(count: int, joined_by: str) -> None:
    several, one = welded(count, joined_by), one_body(count, joined_by)
    reports = report(several), report(one)
    for form, tolerance in (("reduced", 1e-9), ("dae", 1e-8)):
        assert reports[0].states[form] == reports[1].states[form]
        operations = [sum(found.operations[form].values()) for found in reports]
        assert operations[0] <= 1.02 * operations[1]
        results = [simulate(x, form=form, t_end=0.5, rtol=1e-11, outputs=6) for x in (several, one)]
        for path in ("x_axis.x", "y_axis.z", "z_axis.y", "spin.x", "spin.y", "spin.z"):
            assert np.max(np.abs(results[0][f"piece0.{path}"] - results[1][f"piece0.{path}"])) < tolerance, path
    assert len(reports[0].bodies) == len(reports[1].bodies) == 1
    assert {entry.into for entry in reports[0].merged} == {"piece0"}
    whole = sum(properties(piece).mass for piece, *_ in PIECES[:count])
    assert reports[0].bodies[0].mass == pytest.approx(whole, rel=1e-14)


def test_welds_between_several_bodies_cost_nothing() -> None:
    """Two compound bodies on two joints are two bodies, whatever they are welded of."""

    def chain(is_welded: bool) -> Scene:
        scene = Scene(space="space")
        ground = scene.add("ground", Ground())
        before = ground.frame
        for link in range(2):
            joint = scene.add(f"joint{link}", Pivot(axis=(0.0, 1.0, 0.0) if link else (1.0, 0.0, 0.0)))
            scene.connect(before, joint.a)
            solids = [properties(p).placed(_turned(axis, angle), place) for p, place, axis, angle in PIECES[:3]]
            if is_welded:
                body = scene.add(f"body{link}", PIECES[0][0].copy())
                for number, (piece, place, axis, angle) in enumerate(PIECES[1:3]):
                    weld = scene.add(f"weld{link}{number}", Weld(displacement=place, axis=axis, angle=angle))
                    part = scene.add(f"part{link}{number}", piece.copy())
                    scene.connect(body.frame, weld.a)
                    scene.connect(weld.b, part.frame)
            else:
                body = scene.add(f"body{link}", RigidBody.of(combine(*solids)))
            end = scene.add(f"end{link}", Weld(displacement=(0.0, 0.1, -0.6), axis=(1.0, 0.0, 1.0), angle=0.5))
            scene.connect(joint.b, body.frame)
            scene.connect(body.frame, end.a)
            before = end.b
        scene.start.update({"joint0.angle": 0.4, "joint1.angle": -0.3, "joint0.angular_velocity": 2.0})
        return scene

    several, one = (report(chain(is_welded)) for is_welded in (True, False))
    assert several.states == one.states
    for form in one.states:
        assert sum(several.operations[form].values()) <= 1.03 * sum(one.operations[form].values())
    moved = [simulate(chain(is_welded), t_end=1.0, rtol=1e-11, outputs=11) for is_welded in (True, False)]
    for path in ("joint0.angle", "joint1.angle", "joint1.force.x", "joint1.torque.z"):
        assert np.max(np.abs(moved[0][path] - moved[1][path])) < 1e-8, path
