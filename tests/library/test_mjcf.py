"""MJCF: small models with answers in closed form, and what is refused."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from atwood import AtwoodError, Scene, dynamics, simulate
from atwood.cli.scenes import find_scene
from atwood_library import Box, Ground, Pivot, PointMass, Slider, Spherical, Weld
from atwood_library.robots import read_mjcf, write_mjcf

pytestmark = pytest.mark.filterwarnings("ignore:.*left out.*")


def model(folder: Path, body: str, around: str = "", name: str = "model.xml") -> Path:
    file = folder / name
    file.write_text(f"<mujoco>\n{around}\n<worldbody>\n{body}\n</worldbody></mujoco>")
    return file


def inertia(folder: Path, geom: str, around: str = "") -> tuple[float, Any, Any]:
    """Return mass, centre and moments of a body with a geom."""
    file = model(folder, f'<body name="b"><freejoint/>{geom}</body>', around)
    made: Any = read_mjcf(file)["b"]
    return made.mass, np.array(tuple(made.center)), np.array(tuple(made.moments))


def test_geoms_have_the_inertias_of_solids(tmp_path: Path) -> None:
    mass, _, moments = inertia(tmp_path, '<geom type="box" size=".1 .2 .3" density="500"/>')
    assert mass == pytest.approx(500 * 8 * 0.006)
    assert moments == pytest.approx(mass / 3 * np.array([0.13, 0.1, 0.05]))
    mass, centre, moments = inertia(tmp_path, '<geom type="capsule" fromto="0 0 0 2 0 0" size=".1" mass="3"/>')
    drum, caps = math.pi * 0.01 * 2.0, 4 / 3 * math.pi * 0.001
    caps, drum = 3 * caps / (drum + caps), 3 * drum / (drum + caps)
    across = drum * (0.03 + 4.0) / 12 + caps * (0.4 * 0.01 + 1.0 + 0.75 * 0.1)
    assert (mass, centre[0]) == (3.0, 1.0)
    assert moments == pytest.approx([drum * 0.005 + caps * 0.4 * 0.01, across, across])
    mass, _, moments = inertia(tmp_path, '<geom type="ellipsoid" size="1 2 3" mass="5"/>')
    assert moments == pytest.approx([13.0, 10.0, 5.0])
    mass, _, moments = inertia(tmp_path, '<geom size="1" mass="5"/><geom size=".5" pos="1 0 0" mass="5"/>')
    assert moments[1] == pytest.approx(2.0 + 0.5 + 10 * 0.25)
    mass, _, _ = inertia(tmp_path, '<geom size="1" mass="5"/>', '<compiler settotalmass="2"/>')
    assert mass == pytest.approx(2.0)


def test_a_mesh_has_the_inertia_of_its_solid(tmp_path: Path) -> None:
    """A tetrahedron with legs 1, 2 and 3: mass rho/6 a b c, centre a quarter of the legs, J_xx = 3 m (b^2 + c^2)/80."""
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)])
    text = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join("vertex {} {} {}\n".format(*corners[i]) for i in face)
        + "endloop\nendfacet\n"
        for face in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
    )
    (tmp_path / "wedge.stl").write_text(f"solid wedge\n{text}endsolid wedge\n")
    around = '<asset><mesh file="wedge.stl" scale="2 1 1"/></asset>'
    mass, centre, moments = inertia(tmp_path, '<geom type="mesh" mesh="wedge" density="10"/>', around)
    assert mass == pytest.approx(20.0)
    assert centre == pytest.approx([0.5, 0.5, 0.75])
    assert moments == pytest.approx(3 * 20 / 80 * np.array([13.0, 13.0, 8.0]))


def test_joints_defaults_and_units(tmp_path: Path) -> None:
    """A hinge off the body's origin, with a spring at rest at 30 degrees beyond its reference."""
    (tmp_path / "part.xml").write_text(
        '<mujocoinclude><default><joint damping="0.5"/><default class="stiff"><joint stiffness="4" armature="0.25"/>'
        "</default></default></mujocoinclude>"
    )
    body = (
        '<body name="arm" pos="0 0 1" euler="90 0 0" childclass="stiff">'
        '<joint name="hinge" axis="0 0 2" pos="1 0 0" ref="10" springref="40" range="-20 90"/>'
        '<inertial pos="1 0.5 0" mass="2" diaginertia="1 1 1"/></body>'
    )
    file = model(tmp_path, body, '<include file="part.xml"/><option gravity="0 0 -10"/>')
    made = dynamics(read_mjcf(file))
    assert made.mass_matrix([0.3])[0, 0] == pytest.approx(1.0 + 2.0 * 0.25 + 0.25)
    spring, weight = 4 * (0.3 - math.radians(30)), 2 * 10 * 0.5 * math.sin(0.3)
    assert made.bias([0.3], [2.0])[0] == pytest.approx(spring + 0.5 * 2.0 - weight)
    stopped: Any = read_mjcf(file, stops=0.5)["hinge"]
    assert stopped.upper_stop == pytest.approx(math.radians(80))
    radian = model(tmp_path, body, '<include file="part.xml"/><compiler angle="radian"/>', "other.xml")
    made = dynamics(read_mjcf(radian))
    assert made.bias([0.0], [0.0])[0] == pytest.approx(-4 * 30.0, rel=0.2)


def test_orientations_agree(tmp_path: Path) -> None:
    said = (
        'quat="0.7071067811865476 0 0.7071067811865476 0"',
        'axisangle="0 2 0 90"',
        'euler="0 90 0"',
        'xyaxes="0 0 -1 0 1 0"',
        'zaxis="1 0 0"',
    )
    bodies = "".join(
        f'<body name="b{i}" {one}><joint name="j{i}" axis="1 1 0"/>{BALL}</body>' for i, one in enumerate(said)
    )
    made = dynamics(read_mjcf(model(tmp_path, bodies)))
    mass, bias = made.mass_matrix([0.2] * 5), made.bias([0.2] * 5, [1.0] * 5)
    assert np.diag(mass) == pytest.approx(mass[0, 0])
    assert bias == pytest.approx(np.full(5, bias[0]))


BALL = '<geom size="0.1" pos="0.3 0.2 0.1" mass="1"/>'


def test_several_joints_of_a_body_motors_and_equalities(tmp_path: Path) -> None:
    body = (
        f'<body name="cart"><joint name="x" type="slide" axis="1 0 0"/>{BALL}'
        f'<body name="rod" pos="0 0 -1"><joint name="swing" axis="0 1 0" pos="0 0 1"/>{BALL}</body></body>'
        f'<body name="other"><joint name="y" type="slide" axis="0 1 0"/>{BALL}</body>'
        f'<body name="ball" pos="0 0 3"><joint type="ball" damping="1"/>{BALL}</body>'
        f'<body name="plate" pos="1 0 0"><joint name="px" type="slide" axis="1 0 0"/><joint name="turn"/>{BALL}</body>'
    )
    after = (
        '<actuator><motor name="push" joint="x" gear="3"/></actuator>'
        '<equality><joint joint1="y" joint2="x" polycoef="0.1 2 0 0 0"/></equality>'
    )
    file = model(tmp_path, body, after)
    scene = read_mjcf(file)
    scene["push"].u = 2.0
    made = dynamics(scene)
    still = dynamics(read_mjcf(file))
    q, u = made.start()
    difference = made.bias(q, u) - still.bias(q, u)
    by_rate = {"x.displacement'": -6.0, "y.displacement'": -6.0 / 2.0}  # one of the two is left
    found = {name: difference[made.speeds.index(name)] for name in by_rate if name in made.speeds}
    assert len(found) == 1
    assert all(value == pytest.approx(by_rate[name]) for name, value in found.items())
    result = simulate(scene, t_end=0.1)
    assert result.array("y.displacement") == pytest.approx(0.1 + 2 * result.array("x.displacement"), abs=1e-9)


def test_connected_bodies_close_a_loop(tmp_path: Path) -> None:
    """Three links of 1 m, at right angles to each other, whose end is pinned to the world: a square that shears."""
    links = "".join(
        f'<body name="{name}" {place}><joint name="j{name}" axis="0 1 0"/>{BALL}'
        for name, place in (("one", ""), ("two", RIGHT), ("three", RIGHT))
    )
    file = model(
        tmp_path,
        f"{links}</body></body></body>",
        '<equality><connect name="pin" body1="three" anchor="1 0 0"/></equality>',
    )
    result = simulate(read_mjcf(file), t_end=0.4)
    a, b, c = (result.array(f"j{name}.angle") for name in ("one", "two", "three"))
    ways = a, a + b + math.pi / 2, a + b + c + math.pi
    assert sum(np.cos(one) for one in ways) == pytest.approx(0.0, abs=1e-9)
    assert sum(np.sin(one) for one in ways) == pytest.approx(1.0, abs=1e-9)
    assert np.ptp(a) > 0.1


RIGHT = 'pos="1 0 0" euler="0 90 0"'


def test_what_is_left_out_is_said(tmp_path: Path) -> None:
    file = model(tmp_path, f'<body name="b"><joint/>{BALL}</body>', "<sensor><clock/></sensor>")
    with pytest.warns(UserWarning, match=r"model\.xml: left out.*sensor clock; contact of geoms"):
        read_mjcf(file)
    with pytest.raises(AtwoodError, match="sensor clock"):
        read_mjcf(file, strict=True)
    assert isinstance(find_scene(str(file))[0], Scene)


BAD = {
    "cut off": ("<body>", "", r"model\.xml:5.*no XML"),
    "two bodies": ('<body name="b"/>\n<body name="b"/>', "", r"model\.xml:5.*two bodies 'b'"),
    "two joints": (f'<body><joint name="j"/><joint name="j"/>{BALL}</body>', "", r"model\.xml:4.*two joints 'j'"),
    "no axis": ('<body><joint name="j" axis="0 0 0"/></body>', "", r"model\.xml:4.*axis of joint 'j' is zero"),
    "no type": ('<body><joint name="j" type="hing"/></body>', "", r"model\.xml:4.*'hing'"),
    "no class": ('<body><joint class="none"/></body>', "", r"model\.xml:4.*default class 'none'"),
    "no sizes": ('<body><geom type="box" size="1 2"/></body>', "", r"model\.xml:4.*box has 3 sizes"),
    "no mesh": ('<body><geom type="mesh" mesh="none"/></body>', "", r"model\.xml:4.*mesh 'none'"),
    "two ways": ('<body quat="1 0 0 0" euler="1 2 3"/>', "", r"model\.xml:4.*both 'quat' and 'euler'"),
    "zero quaternion": ('<body quat="0 0 0 0"/>', "", r"model\.xml:4.*'quat' of <body> is zero"),
    "includes itself": ("", '<include file="model.xml"/>', r"model\.xml:2.*a second time"),
    "no include": ("", '<include file="none.xml"/>', r"none\.xml.*cannot be read"),
    "replicate": ('<replicate count="3"><body/></replicate>', "", r"model\.xml:4.*<replicate> is not read"),
    "impossible inertia": (
        '<body name="b"><inertial pos="0 0 0" mass="1" diaginertia="1 1 5"/></body>',
        "",
        r"model\.xml:4: body 'b'.*moments 1, 1, 5",
    ),
    "no joint": ("", '<equality><joint joint1="a" joint2="b"/></equality>', r"model\.xml:2.*'a' is no joint"),
    "no body": ("", '<equality><weld body1="a"/></equality>', r"model\.xml:2.*no body 'a'"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_wrong_is_said_with_file_and_line(case: str, tmp_path: Path) -> None:
    body, around, said = BAD[case]
    with pytest.raises(AtwoodError, match=said):
        read_mjcf(model(tmp_path, body, around))


def test_written_and_read_again(tmp_path: Path) -> None:
    body = (
        f'<body name="cart" pos="0 0 1"><joint name="x" type="slide" axis="1 0 0" armature="0.3"/>'
        f'<joint name="turn" axis="0 1 1" pos="0.1 0.2 0.3" stiffness="3" springref="10" range="-20 90"/>{BALL}'
        f'<body name="rod" pos="0 0 -1" euler="10 20 30"><joint name="swing" axis="0 1 0" pos="0 0 1"/>{BALL}'
        f'<body name="tip" pos="0 1 0"><joint name="ball" type="ball" damping="0.1"/>{BALL}</body></body></body>'
        f'<body name="fixed" pos="1 1 1">{BALL}</body>'
        f'<body name="far" pos="3 2 1"><freejoint name="free"/>{BALL}</body>'
    )
    after = (
        '<option gravity="1 2 -9"/><actuator><motor name="push" joint="x" gear="3"/></actuator>'
        '<equality><joint name="tied" joint1="swing" joint2="turn" polycoef="0.1 2 0 0 0"/></equality>'
    )
    scene = read_mjcf(model(tmp_path, body, after), stops=0.1)
    again = read_mjcf(write_mjcf(scene, tmp_path / "again.xml"), stops=0.1)
    assert set(again.parts) == set(scene.parts)
    assert again["push"].gain == 3.0
    one, other = dynamics(read_mjcf(tmp_path / "model.xml")), dynamics(read_mjcf(tmp_path / "again.xml"))
    generator = np.random.default_rng(1)
    q, (u, a) = generator.normal(size=len(one.coordinates)), generator.normal(size=(2, len(one.speeds)))
    places = [one.coordinates.index(path) for path in other.coordinates]
    rows = [one.speeds.index(path) for path in other.speeds]
    found, wanted = other.inverse_dynamics(q[places], u[rows], a[rows]), one.inverse_dynamics(q, u, a)[rows]
    assert found == pytest.approx(wanted, rel=1e-12, abs=1e-12)
    assert read_mjcf(tmp_path / "again.xml").guess["free.x"] == 3.0


def test_scenes_of_ones_own_are_written(tmp_path: Path) -> None:
    """A joint the other way round, a weld between two joints without a body, and a base that moves freely."""
    scene = Scene(space="space")
    hinge, weld = (
        scene.add("hinge", Pivot(axis=(0.0, 1.0, 0.5))),
        scene.add("weld", Weld(displacement=(0.1, 0.2, 0.3), angle=1.0)),
    )
    slide, low, high = (
        scene.add("slide", Slider(axis=(0.0, 0.0, 1.0))),
        scene.add("low", Box(mass=2.0)),
        scene.add("high", Box(mass=3.0)),
    )
    ends = ((low.frame, hinge.b), (hinge.a, weld.a), (weld.b, slide.a), (slide.b, high.frame))
    for pair in ends:
        scene.connect(*pair)
    ground = scene.add("ground", Ground())
    hanging = scene.add("hanging", Spherical())
    scene.connect(ground.frame, hanging.a)
    scene.connect(hanging.b, low.frame)
    again = read_mjcf(write_mjcf(scene, tmp_path / "own.xml"))
    one, other = dynamics(scene), dynamics(again)
    q, u = one.start()
    q[[one.coordinates.index("hinge.angle"), one.coordinates.index("slide.displacement")]] = 0.4, 0.7
    places = [one.coordinates.index(path) for path in other.coordinates]
    rows = [one.speeds.index(path) for path in other.speeds]
    assert other.mass_matrix(q[places]) == pytest.approx(one.mass_matrix(q)[np.ix_(rows, rows)], rel=1e-12, abs=1e-14)
    assert other.bias(q[places], u) == pytest.approx(one.bias(q, u)[rows], rel=1e-12, abs=1e-12)


def test_what_mjcf_has_not_is_refused_by_name(tmp_path: Path) -> None:
    scene = read_mjcf(model(tmp_path, f'<body name="b"><joint name="j"/>{BALL}</body>'))
    load = scene.add("load", PointMass(mass=1.0))
    scene.connect(scene["b"].frame, load.point)
    with pytest.raises(AtwoodError, match=r"no counterpart in MJCF: load \(PointMass\)"):
        write_mjcf(scene, tmp_path / "own.xml")
    scene = read_mjcf(tmp_path / "model.xml")
    scene["j"].stop_stiffness = 3.0
    scene["j"].upper_stop = 1.0
    with pytest.raises(AtwoodError, match=r"j: MJCF"):
        write_mjcf(scene, tmp_path / "own.xml")
    assert not (tmp_path / "own.xml").exists()
