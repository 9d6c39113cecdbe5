"""What is asked for and does not apply is refused, and what is said is said once, in the words that were typed."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from atwood import (
    Component,
    Frame,
    Point,
    Scene,
    TopologyError,
    check,
    connector,
    parameter,
    potential,
    simulate,
)
from atwood.cli.app import main
from atwood_library import Ground


def ran(*arguments: str) -> Result:
    return CliRunner().invoke(main, list(arguments))


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (("run", "simple-pendulum", "--level", "index1"), "Add --form dae."),
        (("sweep", "simple-pendulum", "--vary", "rod.length=1,2", "--level", "index1"), "Add --form dae."),
        (("run", "simple-pendulum", "--orientation", "rodrigues"), "there are no orientations in a plane"),
    ],
)
def test_options_that_would_change_nothing_are_refused(command: tuple[str, ...], said: str) -> None:
    found = ran(*command)
    assert found.exit_code != 0
    assert said in found.output


def test_nothing_but_ground() -> None:
    scene = Scene()
    scene.add("ground", Ground())
    with pytest.raises(TopologyError, match="nothing in it but what is fixed") as caught:
        simulate(scene)
    assert "PointMass" in caught.value.advice


@pytest.mark.parametrize("typed", ["0:180:3", "0,90"])
def test_angles_that_look_like_degrees_are_said_as_typed(typed: str) -> None:
    said = ran("sweep", "simple-pendulum", "--vary-start", f"rod.angle={typed}", "--t-end", "0.1").output
    assert f"'{typed} deg'" in said
    assert (
        "deg" not in ran("sweep", "simple-pendulum", "--vary-start", f"rod.angle={typed} deg", "--t-end", "0.1").stderr
    )


class Bare(Component):
    """Nothing."""


class Reads(Component):
    """An energy of the angle of a point."""

    point: Point = connector(Point, "Where.")

    @potential
    def energy(self) -> object:
        return self.point.angle  # type: ignore[attr-defined]


class Asks(Component):
    """An energy with an if."""

    stiffness: float = parameter(1.0, unit="N", doc="How hard.")
    frame: Frame = connector(Frame, "Where.")

    @potential
    def energy(self) -> object:
        return self.stiffness * self.frame.position.x if self.frame.position.x > 0.0 else 0.0


def test_a_finding_is_said_once_for_all_spaces() -> None:
    (one,) = check(Asks, run=False).failures
    assert one.space == "line, plane, space"
    assert "select(condition, a, b)" in one.message
    assert not any(word in one.message for word in ("less(", "mul(", "symbol"))


def test_a_point_that_is_asked_for_its_angle() -> None:
    (one,) = check(Reads, run=False).failures
    assert "declare the connector as a Frame" in one.message


def test_a_component_without_laws_is_not_called_sound(tmp_path: Path) -> None:
    report = check(Bare, run=False)
    assert report.ok
    assert report.is_empty
    assert "nothing to check" in str(report)
    file = tmp_path / "parts.py"
    file.write_text("from atwood import Component\n\n\nclass Bare(Component):\n    pass\n")
    assert "nothing to check" in ran("check", str(file)).output
