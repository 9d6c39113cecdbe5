"""Robots' files: small texts with answers in closed form, and what is refused."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from atwood import AtwoodError, Scene, dynamics, plot_mechanism, simulate
from atwood.cli import main
from atwood.cli.scenes import find_scene
from atwood_library import Ground, Pivot, PointMass, RigidBody, Spherical, Weld
from atwood_library.robots import nearest_inertia, read_urdf, write_urdf

LINK = '<link name="{}"><inertial><origin xyz="{}"/><mass value="{}"/>{}</inertial></link>'


def link(name: str, mass: float = 1.0, centre: str = "0 0 0", moments: str = "0.1 0.1 0.1") -> str:
    xx, yy, zz = moments.split()
    return LINK.format(name, centre, mass, f'<inertia ixx="{xx}" ixy="0" ixz="0" iyy="{yy}" iyz="0" izz="{zz}"/>')


def joint(name: str, parent: str, child: str, kind: str = "revolute", inner: str = '<axis xyz="0 1 0"/>') -> str:
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inner}</joint>'


def written(folder: Path, *parts: str, name: str = "robot.urdf") -> Path:
    file = folder / name
    file.write_text(f'<robot name="r">\n{"".join(one + chr(10) for one in parts)}</robot>')
    return file


def mass(scene: Scene) -> Any:
    made = dynamics(scene)
    return made.mass_matrix(made.start()[0])


def test_a_pendulum_has_the_inertia_and_the_torque_of_the_book(tmp_path: Path) -> None:
    """J + m l^2 about a hinge at (0, 0, 1) that a link turned by rpy hangs on; gravity has the arm l sin(q)."""
    inner = '<origin xyz="0 0 1" rpy="0.4 0 0"/><axis xyz="2 0 0"/><dynamics damping="0.3"/>'
    arm = link("arm", 2.0, "0 0 -0.5", "0.1 0.2 0.3")
    made = dynamics(read_urdf(written(tmp_path, link("base"), arm, joint("hinge", "base", "arm", inner=inner))))
    assert made.coordinates == ("hinge.angle",)
    assert made.mass_matrix([0.7])[0, 0] == pytest.approx(0.1 + 2.0 * 0.5**2, rel=1e-14)
    torque = made.inverse_dynamics([0.7], [1.5], [0.0])[0]
    assert torque == pytest.approx(2.0 * 9.81 * 0.5 * np.sin(0.7 + 0.4) + 0.3 * 1.5, rel=1e-14)


def test_all_joints_loads_and_gears(tmp_path: Path) -> None:
    """A slide that follows a hinge adds m r^2 to its inertia; a rotor behind n = 5 adds n^2 J."""
    inner = '<axis xyz="0 0 1"/><mimic joint="hinge" multiplier="0.5" offset="0.1"/>'
    rotor = (
        '<transmission name="t"><joint name="hinge"/><actuator name="m"><mechanicalReduction>5</mechanicalReduction>'
        "<rotorInertia>0.02</rotorInertia></actuator></transmission>"
    )
    limit = '<axis xyz="0 0 1"/><limit lower="-1" upper="1"/><dynamics friction="0.2"/>'
    file = written(
        tmp_path,
        *(
            link("base"),
            link("drum"),
            link("rack", 3.0),
            link("plate", 2.0),
            link("balloon"),
            '<link name="tool-tip"/>',
        ),
        joint("hinge", "base", "drum", inner=limit),
        joint("slide", "base", "rack", "prismatic", inner),
        joint("table", "base", "plate", "planar", '<axis xyz="0 0 1"/>'),
        joint("flight", "base", "balloon", "floating", ""),
        joint("tool", "drum", "tool-tip", "fixed", '<origin xyz="1 0 0"/>'),
        rotor,
    )
    scene = read_urdf(file, stops=0.5)
    assert scene["hinge"].upper_stop == 1.0
    assert "hinge_friction" in scene.parts
    scene = read_urdf(file, friction=False)
    made = dynamics(scene)
    matrix, names = made.mass_matrix(made.start()[0]), made.speeds
    assert not made.constraints
    index = names.index("hinge.angle'")
    assert matrix[index, index] == pytest.approx(0.1 + 25.0 * 0.02 + 3.0 * 0.25, rel=1e-13)
    load = scene.add("load", PointMass(mass=1.0))
    scene.connect(scene["tool_tip"].frame, load.point)  # a link connects to anything, and so does a joint
    heavier = dynamics(scene)
    index = heavier.speeds.index("hinge.angle'")
    assert heavier.mass_matrix(heavier.start()[0])[index, index] - matrix[index, index] == pytest.approx(1.0)
    result = simulate(scene, t_end=0.2)
    assert result.array("slide.displacement") == pytest.approx(0.5 * result.array("hinge.angle") + 0.1, abs=1e-9)


def test_what_mimics_a_fixed_joint_is_fixed(tmp_path: Path) -> None:
    parts = link("a"), link("b"), link("c"), joint("ab", "a", "b", "fixed", "")
    mimic = '<axis xyz="0 1 0"/><mimic joint="ab" multiplier="2" offset="0.3"/>'
    scene = read_urdf(written(tmp_path, *parts, joint("bc", "b", "c", inner=mimic)), base="free")
    assert scene["bc"].rotation == 0.3
    assert len(dynamics(scene).speeds) == 6
    missing = '<axis xyz="0 1 0"/><mimic joint="none"/>'
    with pytest.warns(UserWarning, match="mimics a joint 'none' that there is not"):
        read_urdf(written(tmp_path, *parts, joint("bc", "b", "c", inner=missing)))


def test_the_nearest_inertia_fulfils_the_triangle_inequality_with_equality() -> None:
    """Of diag(1, 1, 5) it is diag(2, 2, 4): s = (2, 2, 0) solves the normal equations."""
    assert nearest_inertia(np.diag([1.0, 1.0, 5.0])) == pytest.approx(np.diag([2.0, 2.0, 4.0]), abs=1e-14)
    possible = np.diag([1.0, 2.0, 2.5])
    assert nearest_inertia(possible) == pytest.approx(possible, abs=1e-14)


def test_names_that_python_has_not_or_that_are_taken(tmp_path: Path) -> None:
    parts = link("1-base"), link("start"), joint("start", "1-base", "start"), link("x"), joint("x", "start", "x")
    scene = read_urdf(written(tmp_path, *parts))
    assert {"part_1_base", "start_", "start__", "x", "x_"} <= set(scene.parts)


def test_visuals_and_a_missing_mesh(tmp_path: Path) -> None:
    (tmp_path / "shapes").mkdir()
    (tmp_path / "shapes" / "w.stl").write_text("solid w\n" + FACE * 4 + "endsolid w\n")
    seen = '<visual><origin xyz="0 0 1"/><geometry>{}</geometry></visual>'
    shapes = (
        '<box size="1 2 3"/>',
        '<cylinder radius="1" length="2"/>',
        '<sphere radius="1"/>',
        '<mesh filename="package://shapes/w.stl" scale="2 2 2"/>',
    )
    body = link("a").replace("</link>", "".join(map(seen.format, shapes)) + "</link>")
    arm = joint("j", "a", "b")
    scene = read_urdf(written(tmp_path, body, link("b", centre="0 0 1"), arm))
    assert Path(scene["a_visual_4"].file).is_file()
    result = simulate(scene, t_end=0.1)
    plot_mechanism(result)
    scene = read_urdf(written(tmp_path, body.replace("w.stl", "none.dae"), link("b", centre="0 0 1"), arm))
    with pytest.warns(UserWarning, match=r"none\.dae"):
        plot_mechanism(simulate(scene, t_end=0.1))


FACE = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"


def test_the_command_line_takes_robots_files(tmp_path: Path) -> None:
    file = written(tmp_path, link("base"), link("arm"), joint("hinge", "base", "arm"))
    scene, name = find_scene(str(file))
    assert name == "robot"
    assert "hinge" in scene.parts
    with pytest.raises(AtwoodError, match="there is no such file"):
        find_scene(str(tmp_path / "none.urdf"))
    shown = CliRunner().invoke(main, ["info", str(file)], catch_exceptions=False).output
    assert "1 degree of freedom" in shown
    assert "hinge (Pivot)" in shown


BAD = {
    "no XML": ('<robot name="r"><link name="a">', r"robot\.urdf:1.*no XML"),
    "not a robot": ("<mujoco/>", r"robot\.urdf:1.*<mujoco> and not <robot>"),
    "an entity": ('<!DOCTYPE r [<!ENTITY e "x">]>\n<robot>&e;</robot>', r"robot\.urdf:1.*entities"),
    "no link": ('<robot name="r"/>', r"robot\.urdf:1.*no links"),
    "no number": (link("a").replace('"1.0"', '"1_0"'), r"robot\.urdf:2.*'value' of <mass> should be 1 number"),
    "nan": (link("a").replace('"1.0"', '"nan"'), r"robot\.urdf:2.*'value' of <mass>"),
    "two links": (link("a") + "\n" + link("a"), r"robot\.urdf:3.*two links 'a'.*urdf:2"),
    "two roots": (link("a") + link("b"), r"robot\.urdf:2.*2 root links, 'a', 'b'"),
    "two parents": (
        link("a") + link("b") + joint("j", "a", "b") + "\n" + joint("k", "a", "b"),
        r"robot\.urdf:3.*'b' is the child of two joints, 'j' and 'k'",
    ),
    "a loop": (link("a") + link("b") + joint("j", "a", "b") + joint("k", "b", "a"), r"'a', 'b' are a loop"),
    "a loop beside": (
        link("r") + link("a") + link("b") + joint("j", "a", "b") + joint("k", "b", "a"),
        r"'a', 'b' are a loop",
    ),
    "no such link": (link("a") + joint("j", "a", "b"), r"robot\.urdf:2.*'j' names a link 'b' that there is not"),
    "no such type": (link("a") + link("b") + joint("j", "a", "b", "hinge"), r"robot\.urdf:2.*'j' has the type 'hinge'"),
    "no axis": (
        link("a") + link("b") + joint("j", "a", "b", inner='<axis xyz="0 0 0"/>'),
        r"robot\.urdf:2.*axis of joint 'j' is zero",
    ),
    "mimics itself": (
        link("a") + link("b") + joint("j", "a", "b", inner='<mimic joint="j"/>'),
        r"robot\.urdf:2.*'j' mimics 'j'",
    ),
    "two mimic each other": (
        link("a")
        + link("b")
        + link("c")
        + joint("j", "a", "b", inner='<mimic joint="k"/>')
        + joint("k", "b", "c", inner='<mimic joint="j"/>'),
        r"robot\.urdf:2.*'j' mimics 'k' mimics 'j'",
    ),
    "impossible inertia": (
        link("a", moments="1 1 5"),
        r"robot\.urdf:2: link 'a'.*principal moments 1, 1, 5 kg m\^2",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_wrong_is_said_with_file_and_line(case: str, tmp_path: Path) -> None:
    text, said = BAD[case]
    file = tmp_path / "robot.urdf"
    file.write_text(text if re.match(r"<(robot|mujoco|!)", text) else f'<robot name="r">\n{text}</robot>')
    with pytest.raises(AtwoodError, match=said):
        read_urdf(file)


def test_a_file_that_is_cut_off_anywhere_is_refused(tmp_path: Path) -> None:
    file = written(tmp_path, link("base"), link("arm"), joint("hinge", "base", "arm"))
    data = file.read_bytes()
    for end in range(0, len(data), 7):
        file.write_bytes(data[:end])
        with pytest.raises(AtwoodError, match=r"robot\.urdf"):
            read_urdf(file)
    file.write_bytes(bytes(range(256)))
    with pytest.raises(AtwoodError, match=r"robot\.urdf"):
        read_urdf(file)


@pytest.mark.parametrize("given", [{"base": "fixd"}, {"inertias": 1}, {"stops": 2.0}, {"file": None}, {"file": "a\0"}])
def test_bad_options(given: dict[str, Any], tmp_path: Path) -> None:
    limit = '<axis xyz="0 1 0"/><limit lower="-1" upper="1"/>'
    file = written(tmp_path, link("base"), link("arm"), joint("hinge", "base", "arm", inner=limit))
    with pytest.raises(AtwoodError):
        read_urdf(**{"file": file, **given})


def compared(a: Scene, b: Scene) -> float:
    """Return by how much mass matrices and inverse dynamics of two scenes with the same coordinates differ."""
    one, other = dynamics(a), dynamics(b)
    q, u, acceleration = np.random.default_rng(1).normal(size=(3, len(one.coordinates)))
    order = [one.coordinates.index(path) for path in other.coordinates]
    pairs = (
        (one.mass_matrix(q)[np.ix_(order, order)], other.mass_matrix(q[order])),
        (
            one.inverse_dynamics(q, u, acceleration)[order],
            other.inverse_dynamics(q[order], u[order], acceleration[order]),
        ),
    )
    return max(float(np.max(np.abs(x - y)) / np.max(np.abs(x))) for x, y in pairs)


def test_written_and_read_again(tmp_path: Path) -> None:
    inner = '<origin xyz="0 1 1" rpy="0.4 0.2 0.1"/><axis xyz="2 0 1"/><dynamics damping="0.3" friction="0.1"/>'
    mimic = '<axis xyz="0 0 1"/><mimic joint="hinge" multiplier="0.5" offset="0.1"/>'
    seen = '<visual><origin xyz="0 0 1" rpy="1 0 0"/><geometry><box size="1 2 3"/></geometry></visual></link>'
    file = written(
        tmp_path,
        *(link("base"), link("arm", 2.0, "1 2 3").replace("</link>", seen), link("tip"), link("hand")),
        joint("hinge", "base", "arm", inner=inner),
        joint("slide", "arm", "tip", "prismatic", mimic),
        joint("fix", "arm", "hand", "fixed", '<origin xyz="1 0 0" rpy="0.3 1.5707963267948966 0.2"/>'),
        '<transmission name="t"><joint name="hinge"/><actuator name="m"><rotorInertia>0.02</rotorInertia></actuator>'
        "</transmission>",
    )
    scene = read_urdf(file, stops=0.3)
    again = read_urdf(write_urdf(scene, tmp_path / "again.urdf"), stops=0.3)
    assert list(again.parts) == list(scene.parts)
    assert again["hinge_friction"].sliding(1.0) == 0.1
    smooth = read_urdf(file, friction=False), read_urdf(tmp_path / "again.urdf", friction=False)
    assert compared(*smooth) < 1e-14


def chain(reverse: bool = False) -> Scene:
    """Return a pendulum whose hinge may be the other way round, with a turned weld below."""
    scene = Scene(space="space")
    ground = scene.add("ground", Ground())
    hinge = scene.add("hinge", Pivot(axis=(0.0, 1.0, 0.5)))
    weld = scene.add("weld", Weld(displacement=(0.1, 0.2, -0.5), angle=0.7, axis=(1.0, 1.0, 0.0)))
    body = scene.add("body", RigidBody(mass=2.0, center=(0.0, 0.1, -0.3), moments=(0.1, 0.2, 0.15)))
    ends = (hinge.b, hinge.a) if reverse else (hinge.a, hinge.b)
    scene.connect(ground.frame, ends[0])
    scene.connect(ends[1], weld.a)
    scene.connect(weld.b, body.frame)
    return scene


@pytest.mark.parametrize("reverse", [False, True])
def test_scenes_of_ones_own_are_written(reverse: bool, tmp_path: Path) -> None:
    scene = chain(reverse)
    assert compared(scene, read_urdf(write_urdf(scene, tmp_path / "own.urdf"))) < 1e-14


def test_what_urdf_has_not_is_refused_by_name(tmp_path: Path) -> None:
    file = tmp_path / "own.urdf"
    scene = chain()
    load = scene.add("load", PointMass(mass=1.0))
    scene.connect(scene["body"].frame, load.point)
    with pytest.raises(AtwoodError, match=r"no counterpart in URDF: load \(PointMass\)"):
        write_urdf(scene, file)
    scene = chain()
    closing = scene.add("closing", Pivot())
    scene.connect(scene["body"].frame, closing.a)
    scene.connect(closing.b, scene["ground"].frame)
    with pytest.raises(AtwoodError, match="closes a loop"):
        write_urdf(scene, file)
    scene = chain()
    scene["hinge"].stiffness = 3.0
    with pytest.raises(AtwoodError, match=r"hinge: URDF has nothing like its stiffness"):
        write_urdf(scene, file)
    scene = chain()
    scene.add("astray", RigidBody())
    with pytest.raises(AtwoodError, match=r"astray: it hangs on nothing"):
        write_urdf(scene, file)
    scene = chain()
    ball, other = scene.add("ball", Spherical()), scene.add("other", RigidBody())
    scene.connect(scene["body"].frame, ball.a)
    scene.connect(ball.b, other.frame)
    with pytest.raises(AtwoodError, match=r"ball: URDF has no joint like a Spherical"):
        write_urdf(scene, file)
    with pytest.raises(AtwoodError, match="only scenes in space"):
        write_urdf(Scene(), file)
    with pytest.raises(AtwoodError, match="cannot be written"):
        write_urdf(chain(), tmp_path / "none" / "own.urdf")
    assert not file.exists()
