"""The mechanism report."""

import json

import pytest

from atwood import Scene, StartError, connect
from atwood.reporting import MechanismReport, report
from atwood.reporting.text import shorten
from atwood_library import Damper, Ground, Link, Pivot, PointMass, PositionSensor, Rod, Spring, Weld
from atwood_library.scenes import SCENES

from ..helpers.runs import GENERAL

DESCRIBED = (*GENERAL, "charged-particle", "bead-on-wire", "rigid-bodies", "trebuchet", "wilberforce-pendulum")


@pytest.fixture(scope="module")
def reports() -> dict[str, MechanismReport]:
    return {name: report(kind(), name) for name, kind in SCENES.items() if name in DESCRIBED}


@pytest.mark.parametrize(
    ("name", "freedom", "reduced_states", "loops"),
    [
        ("simple-pendulum", 1, 2, 0),
        ("double-pendulum", 2, 4, 0),
        ("pendulum-on-cart", 2, 4, 0),
        ("mass-spring-chain", 2, 4, 0),
        ("atwood", 1, 2, 0),
        ("double-atwood", 2, 4, 0),
        ("driven-pendulum", 1, 2, 0),
    ],
)
def test_freedom(reports: dict[str, MechanismReport], name: str, freedom: int, reduced_states: int, loops: int) -> None:
    found = reports[name]
    assert found.degrees_of_freedom == freedom
    assert found.states["reduced"] == reduced_states
    assert found.loops == loops


@pytest.mark.parametrize("name", ["four-bar", "slider-crank"])
def test_loops_are_found(reports: dict[str, MechanismReport], name: str) -> None:
    found = reports[name]
    assert found.degrees_of_freedom == 1
    assert found.loops == 1
    assert len(found.loop_joints) == 1
    assert not found.redundant
    assert set(found.dependent) < set(found.coordinates)


def test_no_trigonometry_on_a_line(reports: dict[str, MechanismReport]) -> None:
    for counts in reports["double-atwood"].operations.values():
        assert not {"sin", "cos", "tan", "atan2"} & counts.keys()
    assert reports["double-atwood"].eliminated == ("pulley2.position.z", "m3.position.z")
    assert reports["double-atwood"].massless == ("pulley2",)
    assert reports["double-atwood"].ties == ("rope1", "rope2")


def test_every_report_is_text_and_data(reports: dict[str, MechanismReport]) -> None:
    for name, found in reports.items():
        assert str(found).startswith(f"{name}: a mechanism ")
        assert max(map(len, str(found).splitlines())) <= 100
        data = json.loads(json.dumps(found.to_dict(), allow_nan=False))
        assert data["constraints"] == len(found.constraints)


class Parallelogram(Scene):
    """A bar on three equal cranks, one more than it needs, and parts that leave nothing."""

    left: Ground = Ground()
    middle: Ground = Ground(position=(1.0, 0.0, 0.0))
    right: Ground = Ground(position=(2.0, 0.0, 0.0))
    foot1: Pivot = Pivot()
    foot2: Pivot = Pivot()
    foot3: Pivot = Pivot()
    head1: Pivot = Pivot()
    head2: Pivot = Pivot()
    head3: Pivot = Pivot()
    crank1: Link = Link()
    crank2: Link = Link()
    crank3: Link = Link()
    bar: Link = Link()
    extension: Link = Link()
    weld: Weld = Weld()
    weight: PointMass = PointMass(mass=2.0)
    anvil: PointMass = PointMass(mass=5.0)
    spring: Spring = Spring(stiffness=0.0)
    damper: Damper = Damper()
    sensor: PositionSensor = PositionSensor()
    connections = [
        connect(left.frame, foot1.a),
        connect(foot1.b, crank1.a),
        connect(middle.frame, foot2.a),
        connect(foot2.b, crank2.a),
        connect(right.frame, foot3.a),
        connect(foot3.b, crank3.a),
        connect(crank1.b, head1.a),
        connect(head1.b, bar.a),
        connect(crank2.b, head2.a),
        connect(head2.b, bar.b),
        connect(crank3.b, head3.a),
        connect(head3.b, extension.b),
        connect(bar.b, weld.a),
        connect(weld.b, extension.a),
        connect(extension.b, weight.point),
        connect(left.frame, anvil.point),
        connect(left.frame, spring.a),
        connect(extension.b, spring.b),
        connect(left.frame, damper.a),
        connect(right.frame, damper.b),
        connect(extension.b, sensor.point),
    ]
    start = {"crank1.angle": 1.0}
    guess = {"crank2.angle": 1.0, "crank3.angle": 1.0, "bar.angle": 0.0}


def test_redundant_merged_and_dropped() -> None:
    found = report(Parallelogram())
    assert found.degrees_of_freedom == 1
    assert found.loops == 2
    assert len(found.redundant) == 1
    assert "foot1.force.x" in found.not_unique
    assert {one.path for one in found.merged} == {"extension", "weld", "weight"}
    assert {one.into for one in found.merged} == {"bar"}
    dropped = {one.path: one.why for one in found.dropped}
    assert set(dropped) == {"anvil", "spring", "damper", "sensor"}
    assert "fixed" in dropped["anvil"]
    assert "zero" in dropped["spring"]
    assert "fixed" in dropped["damper"]
    assert "measures" in dropped["sensor"]
    assert {one.path: one.mass for one in found.bodies} == {"crank1": 1.0, "crank2": 1.0, "crank3": 1.0, "bar": 4.0}
    text = str(found)
    assert "not unique" in text
    assert "anvil (it is fixed in the world)" in text


def test_a_rod_with_mass_is_a_body_and_a_free_start_is_said() -> None:
    scene = Scene()
    ground = scene.add("ground", Ground())
    rod = scene.add("rod", Rod(length=2.0, mass=3.0))
    scene.connect(ground.frame, rod.a)
    found = report(scene)
    assert [(one.path, pytest.approx(one.mass)) for one in found.bodies] == [("rod", 3.0)]
    assert found.free_coordinates == ("rod.angle",)
    assert found.free_speeds == ("rod.angle",)
    assert "no start value for" in str(found)


def test_a_loop_that_cannot_close_is_refused() -> None:
    with pytest.raises(StartError, match="cannot be closed"):
        report(SCENES["four-bar"](coupler_length=9.0))


def test_long_lists_are_shortened() -> None:
    names = [f"rod[{i}]" for i in range(40)]
    assert shorten(names) == "rod[0..39]"
    assert shorten([f"{name}.angle" for name in ["a", *names[3:9], "b"]]) == "a.angle, rod[3..8].angle, b.angle"
    assert shorten(names[:2]) == "rod[0], rod[1]"
    assert shorten("abcdefgh", 4) == "a, b, ... h (8 in all)"
    assert shorten(names[:2], least=2) == "rod[0..1]"


def test_vectors_in_space_are_written_as_one() -> None:
    assert shorten(f"bob.force.{axis}" for axis in "xyz") == "bob.force.x/y/z"
    assert shorten(f"top.quaternion.{axis}" for axis in "wxyz") == "top.quaternion.w/x/y/z"
    assert shorten(f"bob.position.{axis}'" for axis in "xyz") == "bob.position.x'/y'/z'"
    assert shorten(["a.x", "a.z"]) == "a.x, a.z"
    assert shorten(["a.x", "a.y", "b.z"]) == "a.x, a.y, b.z"
    assert shorten(f"bob[{i}].position.{axis}" for i in range(9) for axis in "xyz") == "bob[0..8].position.x/y/z"


def test_constraints_of_one_law_have_names_of_their_own() -> None:
    found = report(SCENES["four-bar-row"](space="space"))
    assert {"right[0].bearing[0]", "right[0].bearing[1]"} <= set(found.redundant)
    assert len(set(found.constraints)) == len(found.constraints)
