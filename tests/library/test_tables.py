"""Tables are functions of time like any: read from files, estimated, swept, and as drives that stop."""

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import interpolate

from atwood import Component, ParameterError, Scene, discrete_state, observable, report, simulate, sweep, update
from atwood.errors import UsageError
from atwood_library import Drive, Ground, PointMass, Pulley, Rope, SampleAndHold, Spring, Table

from ..helpers.runs import FORMS

T = np.array([0.0, 0.4, 0.7, 1.3, 2.0, 2.5])
Y = np.array([0.0, 0.3, -0.2, 0.5, 0.1, 0.4])
G = 9.81
STOPS = ((0.0, 0.0), (1.0, -0.5), (3.0, -0.5))
"""What is wound in at 0.5 m/s for one second."""


# -- files -----------------------------------------------------------------------------------------------------------

WRITTEN = {
    "commas": "time,value\n0,1.5\n0.5,-2e-1\n",
    "semicolons": "time;value\n0;1.5\n0.5;-2e-1\n",
    "decimal commas": "# measured\nZeit;Weg\n0;1,5\n0,5;-2e-1\n",
    "decimal commas, quoted": '"Zeit";"Weg"\n"0";"1,5"\n"0,5";"-0,2"\n',
    "tabs": "0\t1.5\n0.5\t-0.2\n",
    "tabs and decimal commas": "0\t1,5\n0,5\t-0,2\n",
    "spaces": "t y\n 0   1.5\n 0.5  -0.2\n",
    "a mark of byte order": "\ufefftime,value\r\n0,1.5\r\n\r\n0.5,-0.2\r\n",
    "more columns": "a;b;c\n0;1,5;9\n0,5;-0,2;9\n",
}


@pytest.mark.parametrize("name", WRITTEN)
def test_files_as_programs_write_them_are_read(name: str, tmp_path: Path) -> None:
    file = tmp_path / "rows.csv"
    file.write_text(WRITTEN[name], encoding="utf-8")
    assert Table(table=file).table == ((0.0, 1.5), (0.5, -0.2))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("time,value\n0,0,1,5\n0,5,2,5\n", "line 2 .* has 4 cells.*semicolons"),
        ("0,1\n0,5,2,5\n", "line 2 .* has 4 cells.*semicolons"),
        ("t;y\n0;1.234,5\n1;2\n", "no row of numbers"),
        ("t;y\n0;x\n1;y\n", "line 2 .* is no row of numbers"),
        ("t;y\na;x\nb;y\n", "no rows of numbers"),
    ],
)
def test_files_that_cannot_be_read_are_told_by_their_lines(text: str, said: str, tmp_path: Path) -> None:
    file = tmp_path / "rows.csv"
    file.write_text(text)
    with pytest.raises(ParameterError, match=said):
        Table(table=file)
    file.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(ParameterError, match="is no text"):
        Table(table=file)


# -- accuracy --------------------------------------------------------------------------------------------------------


def shaken(interpolation: str) -> Scene:
    """A mass of 1 kg on a spring of 40 N/m, whose other end a table moves."""
    scene = Scene(space="line", line_axis=(1.0, 0.0, 0.0), t_end=2.5)
    ground, spring = scene.add("ground", Ground()), scene.add("spring", Spring(stiffness=40.0, natural_length=1.0))
    mass, drive = scene.add("mass", PointMass()), scene.add("drive", Drive())
    table = scene.add("table", Table(table=np.column_stack([T, 0.25 * Y]), interpolation=interpolation))
    scene.connect(table.output("value"), drive.input("motion"))
    scene.connect(ground.frame, drive.a)
    scene.connect(drive.b, spring.a)
    scene.connect(spring.b, mass.point)
    scene.start["mass.position.x"], scene.start["mass.velocity.x"] = 1.0, 0.0
    return scene


def where_shaken(interpolation: str, times: np.ndarray, mass: float = 1.0) -> np.ndarray:
    """Return the convolution of the force with the response to an impulse, by Gauss's quadrature on each piece."""
    kinds = {"akima": interpolate.Akima1DInterpolator, "cubic": interpolate.CubicSpline}
    push = kinds[interpolation](T, 10.0 * Y) if interpolation in kinds else lambda t: np.interp(t, T, 10.0 * Y)
    omega, (nodes, weights) = math.sqrt(40.0 / mass), np.polynomial.legendre.leggauss(40)
    found = []
    for t in times:
        total = 0.0
        for a, b in pairwise([*T[t > T], t]):
            s = 0.5 * (a + b) + 0.5 * (b - a) * nodes
            total += 0.5 * (b - a) * float(np.sum(weights * push(s) * np.sin(omega * (t - s))))
        found.append(1.0 + total / (mass * omega))
    return np.array(found)


@pytest.mark.sample(4)
@pytest.mark.parametrize("interpolation", ["linear", "akima", "cubic"])
@pytest.mark.parametrize(
    ("form", "solver"),
    [
        ("reduced", "auto"),
        ("reduced", "ida"),
        ("reduced", "taylor"),
        ("reduced", "gauss"),
        ("dae", "ida"),
        ("dae", "auto"),
    ],
)
def test_the_error_of_a_run_with_a_table_is_estimated(interpolation: str, form: str, solver: str) -> None:
    result = simulate(shaken(interpolation), form=form, solver=solver, rtol=1e-6, outputs=21,
                      **({"step": 0.02} if solver == "gauss" else {}))  # fmt: skip
    true = np.abs(result["mass.position.x"] - where_shaken(interpolation, result.time))
    estimate = result.error("mass.position.x")
    assert float(np.max(true)) <= 3.0 * float(np.max(estimate)) + 1e-12
    assert float(np.max(estimate)) < 1e-3


@pytest.mark.parametrize("form", FORMS)
def test_an_accuracy_can_be_asked_for_with_a_table(form: str) -> None:
    result = simulate(shaken("akima"), form=form, accuracy=1e-9, outputs=21)
    assert_allclose(result["mass.position.x"], where_shaken("akima", result.time), atol=1e-9)
    assert result.energy.max_drift < 1e-6


def test_the_table_of_a_sweep_has_no_memory_of_other_runs() -> None:
    found = sweep(shaken("cubic"), {"mass.mass": [2.0, 1.0, 2.0]}, quantities=["mass.position.x"], accuracy=1e-8)
    expected = [where_shaken("cubic", np.array([2.5]), mass)[0] for mass in (2.0, 1.0, 2.0)]
    assert [row[-1] for row in found["mass.position.x"]] == pytest.approx(expected, abs=1e-8)


class Counting(Component):
    """It gives how often it was called."""

    y: float = discrete_state(0.0, doc="A count.")

    @update(every=0.1, sets="y", reads=())
    def count(self) -> float:
        """Return one more."""
        return self.y + 1.0

    @observable(unit="1", doc="The count.")
    def value(self) -> float:
        """Return the count."""
        return self.y


def test_only_what_may_remember_is_not_solved_twice() -> None:
    scene = shaken("linear")
    held = scene.add("held", SampleAndHold(period=0.25))
    scene.connect(scene["mass"].output("position.x"), held.input("u"))
    assert float(np.max(simulate(scene).error("held.y"))) < 1e-5
    scene.add("count", Counting())
    with pytest.raises(UsageError, match=r"count: it calls functions.*pure=True"):
        simulate(scene, accuracy=1e-6)


# -- ropes -----------------------------------------------------------------------------------------------------------


def hoisted(space: str, rows: Any = STOPS, when_slack: str = "slack", part: Component | None = None) -> Scene:
    """A mass of 2 kg on a rope of 2 m, or another such part, that a table lets out."""
    scene = Scene(space=space, gravity=G, **({"line_axis": (0.0, 0.0, 1.0)} if space == "line" else {}))
    ground, rope = scene.add("ground", Ground()), scene.add("rope", part or Rope(length=2.0, when_slack=when_slack))
    mass, winch = scene.add("mass", PointMass(mass=2.0)), scene.add("winch", Table(table=rows, at_end="hold"))
    scene.connect(ground.frame, rope.a)
    scene.connect(rope.b, mass.point)
    scene.connect(winch.output("value"), rope.input("paid_out"))
    scene.guess["mass.position.z"] = -2.0
    return scene


@pytest.mark.sample(2)
@pytest.mark.parametrize("space", ["line", "plane", "space"])
@pytest.mark.parametrize("form", FORMS)
def test_a_load_goes_on_where_its_rope_is_no_longer_wound_in(space: str, form: str) -> None:
    result = simulate(hoisted(space), t_end=1.3, form=form, rtol=1e-10, outputs=261)
    slack = 2.0 * 0.5 / G  # up and down again
    assert [(one.part, one.target, one.impact) for one in result.events] == [
        ("rope", "slack", False), ("rope", "taut", True),
    ]  # fmt: skip
    assert [one.time for one in result.events] == pytest.approx([1.0, 1.0 + slack], abs=1e-9)
    t = result.time
    flown = np.where((t > 1.0) & (t < 1.0 + slack), 0.5 * (t - 1.0) - 0.5 * G * (t - 1.0) ** 2, 0.0)
    assert_allclose(result["mass.position.z"], -2.0 + 0.5 * np.minimum(t, 1.0) + flown, atol=1e-8)
    inside = (t > 1.0) & (t < 1.0 + slack - 1e-6)
    assert np.max(np.abs(result["rope.tension"][inside])) < 1e-9
    assert result["rope.tension"][-1] == pytest.approx(2.0 * G, rel=1e-7)
    # The jerk takes all of 2 kg at 0.5 m/s; the winch has lifted by 0.5 m and given the speed.
    assert result.energy.max_drift < 1e-7
    assert float(np.max(result.error("mass.position.z"))) < 1e-7


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("rows", [STOPS, lambda t: None])
def test_a_rope_that_may_not_be_slack_ends_the_run_where_its_winch_stops(form: str, rows: Any) -> None:
    scene = hoisted("plane", when_slack="stop")
    if rows is not STOPS:  # the same by a formula
        scene = Scene(gravity=G)
        ground, mass = scene.add("ground", Ground()), scene.add("mass", PointMass(mass=2.0))
        rope = scene.add("rope", Rope(length=2.0, paid_out="max(-0.5*t, -0.5)"))
        scene.connect(ground.frame, rope.a)
        scene.connect(rope.b, mass.point)
        scene.guess["mass.position.z"] = -2.0
    result = simulate(scene, t_end=2.0, form=form)
    assert result.status == "stopped"
    assert [(one.part, one.law, one.time) for one in result.events] == [("rope", "goes_slack", pytest.approx(1.0))]
    assert result.time[-1] == pytest.approx(1.0)
    assert result["mass.position.z"][-1] == pytest.approx(-1.5, abs=1e-7)
    assert result["mass.velocity.z"][-1] == pytest.approx(0.5, abs=1e-7)


@pytest.mark.parametrize("form", FORMS)
def test_a_rope_let_out_at_once_leaves_its_load_falling(form: str) -> None:
    result = simulate(hoisted("plane", [(0, 0), (1, 0), (2, 0.5)]), t_end=1.2, form=form, rtol=1e-10, outputs=121)
    caught = 1.0 + 2.0 * 0.5 / G
    assert [one.time for one in result.events] == pytest.approx([1.0, caught], abs=1e-9)
    t = result.time
    place = np.where(t < caught, -0.5 * G * np.maximum(t - 1.0, 0.0) ** 2, -0.5 * (t - 1.0))
    assert_allclose(result["mass.position.z"], -2.0 + place, atol=1e-8)
    assert result.energy.max_drift < 1e-7


@pytest.mark.parametrize("form", FORMS)
def test_a_rope_wound_in_at_once_jerks_its_load(form: str) -> None:
    result = simulate(hoisted("plane", [(0, 0), (1, 0), (2, -0.5)]), t_end=1.5, form=form, rtol=1e-10)
    assert [(one.time, one.impact) for one in result.events] == [(pytest.approx(1.0), True)]
    assert result["mass.velocity.z"][-1] == pytest.approx(0.5, abs=1e-8)
    assert result.energy.work[-1] == pytest.approx(0.5 * 2.0 * 0.25 + 2.0 * G * 0.25, rel=1e-6)


@pytest.mark.parametrize("form", FORMS)
def test_two_winches_that_stop_at_once_leave_two_ropes_slack(form: str) -> None:
    scene = hoisted("plane")
    ground, rope, mass = scene["ground"], scene.add("rope_2", Rope(length=1.0, when_slack="slack")), PointMass(mass=3.0)
    scene.add("mass_2", mass)
    scene.connect(scene["mass"].point, rope.a)
    scene.connect(rope.b, mass.point)
    beside, other = scene.add("beside", Rope(length=1.5, when_slack="slack")), scene.add("other", PointMass())
    scene.connect(ground.frame, beside.a)
    scene.connect(beside.b, other.point)
    scene.connect(scene["winch"].output("value"), beside.input("paid_out"))
    scene.guess.update({"mass_2.position.z": -3.0, "other.position.z": -1.5})
    result = simulate(scene, t_end=1.05, form=form, rtol=1e-9, outputs=22)
    events = sorted((one.part, one.target) for one in result.events if one.part != "rope_2")  # which bears nothing
    assert events == [("beside", "slack"), ("rope", "slack")]
    flown = 0.5 * 0.05 - 0.5 * G * 0.05**2
    for part, began in (("mass", -2.0), ("mass_2", -3.0), ("other", -1.5)):
        assert result[f"{part}.position.z"][-1] == pytest.approx(began + 0.5 + flown, abs=1e-7)
    assert abs(result["rope_2.tension"][-1]) < 1e-6  # both fall alike


@pytest.mark.parametrize("form", FORMS)
def test_a_drive_that_stops_at_the_same_moment_jerks_what_else_is_held(form: str) -> None:
    """A hook that goes to one side at 0.3 m/s and winds in at 0.5 m/s stops in both at once."""
    scene = Scene(gravity=G)
    ground, drive = scene.add("ground", Ground()), scene.add("drive", Drive())
    rope = scene.add("rope", Rope(length=2.0, when_slack="slack"))
    mass, carried = scene.add("mass", PointMass(mass=2.0)), scene.add("carried", PointMass(mass=5.0))
    scene.connect(ground.frame, drive.a)
    scene.connect(drive.b, carried.point)
    scene.connect(drive.b, rope.a)
    scene.connect(rope.b, mass.point)
    wound, moved = scene.add("wound", Table(table=STOPS)), scene.add("moved", Table(table=[(0, 0), (1, 0.3), (3, 0.3)]))
    scene.connect(wound.output("value"), rope.input("paid_out"))
    scene.connect(moved.output("value"), drive.input("motion"))
    scene.start.update({"mass.position.x": 0.0, "mass.velocity.x": 0.3})
    scene.guess["mass.position.z"] = -2.0
    result = simulate(scene, t_end=1.05, form=form, rtol=1e-9, outputs=22)
    assert ("rope", "slack") in [(one.part, one.target) for one in result.events]
    assert result["carried.velocity.x"][-1] == pytest.approx(0.0, abs=1e-9)
    assert result["mass.velocity.x"][-1] == pytest.approx(0.3, abs=1e-7)
    assert result["mass.position.z"][-1] == pytest.approx(-1.5 + 0.5 * 0.05 - 0.5 * G * 0.05**2, abs=1e-7)
    assert result.energy.max_drift < 1e-6


@pytest.mark.sample(1)
@pytest.mark.parametrize("space", ["plane", "space"])
def test_a_start_with_a_table_on_a_rope_is_reported(space: str) -> None:
    scene = hoisted(space)
    scene.guess.clear()
    scene.guess["mass.position.z"] = -1.0
    assert "rope" in str(report(scene))
    assert simulate(scene, t_end=0.5)["mass.position.z"][-1] == pytest.approx(-1.75, abs=1e-7)
    scene.start["mass.position.z"] = -1.0
    assert "rope" in str(report(scene))


@pytest.mark.parametrize("form", FORMS)
def test_a_winch_on_an_atwood_machine_stops(form: str) -> None:
    scene = Scene(gravity=G)
    ground, pulley = scene.add("ground", Ground()), scene.add("pulley", Pulley())
    rope, winch = Rope(length=4.0, pulleys=1, when_slack="slack"), scene.add("winch", Table(table=STOPS))
    scene.add("rope", rope)
    one, two = scene.add("one", PointMass(mass=1.0)), scene.add("two", PointMass(mass=1.0))
    scene.connect(ground.frame, pulley.center)
    scene.connect(one.point, rope.a)
    scene.connect(rope.over[0], pulley.groove)
    scene.connect(rope.b, two.point)
    scene.connect(winch.output("value"), rope.input("paid_out"))
    scene.start.update({"one.position.x": -0.1, "two.position.x": 0.1, "one.position.z": -2.0})
    scene.start.update({"one.velocity.x": 0.0, "two.velocity.x": 0.0, "one.velocity.z": 0.25})
    scene.guess["two.position.z"] = -2.0
    result = simulate(scene, t_end=1.04, form=form, rtol=1e-9, outputs=53)
    assert [(e.part, e.target, round(e.time, 9)) for e in result.events] == [("rope", "slack", 1.0)]
    speed = {name: result[f"{name}.velocity.z"] for name in ("one", "two")}
    at = int(np.flatnonzero(result.time >= 1.0)[0])
    for name in speed:
        assert speed[name][-1] == pytest.approx(speed[name][at] - G * (result.time[-1] - 1.0), abs=1e-6)
        assert speed[name][at] > 0.2
