"""Mistakes in components are found, by `atwood.check` and by the command."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

import atwood as aw
from atwood.cli.app import main
from atwood_library import Ground, Spring
from atwood_library.scenes import DoublePendulum

from . import parts_of_mine as mine

HERE = Path(__file__).parent / "parts_of_mine.py"

WRONG = [
    (mine.WrongSign, "forces", "pull", "with the wrong sign"),
    (mine.Undone, "forces", "pull", "its loads undo the forces of the potential 'energy'"),
    (mine.Twice, "forces", "pull", "its loads are once more the forces"),
    (mine.Driving, "dissipation", "loss", "it is negative"),
    (mine.NotAnEnergy, "units", "energy", "it is said to be in N*m or J, and is in N"),
    (mine.WrongUnit, "units", "extension", "it is said to be in m, and is in m^2"),
    (mine.HiddenNumber, "units", "energy", "is in no unit at all"),
    (mine.Branching, "derivatives", "energy", "branch with atwood.select"),
    (mine.WrongDerivative, "derivatives", "energy", "external functions"),
    (mine.WrongJoint, "laws", "swing", "it says that it solves 'together'"),
    (mine.WrongName, "names", "level", "its target 'stopp' is no mode"),
    (mine.BadPicture, "outline", "outline", "it raises MissingNameError"),
    (mine.Uneven, "units", "together", "and is in m"),
    (mine.HalfTheForce, "forces", "pull", "its loads are 0.5 times the forces of the energy 'energy'"),
    (mine.Wordy, "updates", "step", "it returns 'full' where a number is wanted"),
    (mine.Generous, "updates", "step", "it returns 2 values where it sets 1"),
    (mine.Raising, "updates", "step", "it raises KeyError: 'gain'"),
]


@pytest.mark.parametrize(("cls", "test", "law", "text"), WRONG, ids=lambda value: getattr(value, "__name__", ""))
def test_each_mistake_is_found(cls: type[aw.Component], test: str, law: str, text: str) -> None:
    report = aw.check(cls, run=False)
    assert not report.ok
    found = [one for one in report.failures if (one.test, one.law) == (test, law)]
    assert found, report
    assert text in found[0].message
    assert text in str(report) == repr(report)


@pytest.mark.parametrize(
    ("cls", "text"),
    [
        (mine.NoReaction, "is a reaction missing?"),
        (mine.AgainstTheWorld, "when the whole scene is moved or turned"),
        (mine.PushingDamper, "give power to every motion that was tried: is a sign wrong?"),
    ],
)
def test_what_may_be_meant_is_a_note(cls: type[aw.Component], text: str) -> None:
    report = aw.check(cls, run=False)
    assert report.ok
    assert [one for one in report.notes if text in one.message], report


def test_a_sound_component_passes_and_runs_in_all_spaces() -> None:
    report = aw.check(mine.Sound)
    assert report.ok
    assert not report.notes
    assert report.spaces == ("line", "plane", "space")
    assert report.tests["both forms"] >= 9
    assert str(report).startswith("Sound: sound (")


def test_both_forms_of_what_no_single_law_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Even if laws are not compared, the test bench tells the forms apart."""
    from atwood.checking import conformance
    from atwood.consistency import check as looked

    monkeypatch.setattr(conformance, "contradictions", lambda part, space: ())
    monkeypatch.setattr(looked, "contradictions", lambda part, space: ())
    report = aw.check(mine.WrongJoint)
    assert "both forms" in {one.test for one in report.failures}


def test_an_object_is_checked_with_its_own_values() -> None:
    assert aw.check(Spring(stiffness=12.0, natural_length=0.3), run=False).ok


@pytest.mark.parametrize("given", [DoublePendulum, DoublePendulum(), 3, "Spring", int])
def test_what_is_no_component_is_refused(given: object) -> None:
    with pytest.raises(aw.UsageError, match=r"is no component|is a model"):
        aw.check(given)  # type: ignore[arg-type]


def test_the_ground_has_nothing_to_compare_and_passes() -> None:
    assert aw.check(Ground, run=False).ok


# -- the command -------------------------------------------------------------------------------------------------------


def test_the_command_says_what_is_wrong_and_fails() -> None:
    done = CliRunner().invoke(main, ["check", f"{HERE}:WrongSign", "--no-run"])
    assert done.exit_code == 1
    assert "1 wrong" in done.output or "2 wrong" in done.output
    assert "with the wrong sign" in done.output


def test_the_command_passes_what_is_sound() -> None:
    done = CliRunner().invoke(main, ["check", f"{HERE}:Sound", "--no-run"])
    assert done.exit_code == 0, done.output
    assert "sound" in done.output
    assert CliRunner().invoke(main, ["check", "Spring", "--no-run"]).exit_code == 0


def test_the_command_writes_json_of_a_whole_file() -> None:
    done = CliRunner().invoke(main, ["check", str(HERE), "--json", "--no-run"])
    assert done.exit_code == 1
    data = json.loads(done.stdout)
    by_name = {one["component"]: one for one in data["components"]}
    assert data["ok"] is False
    assert by_name["Sound"]["ok"] is True
    assert not any(name.startswith("_") for name in by_name)
    assert {cls.__name__ for cls, *_ in WRONG} == {name for name, one in by_name.items() if not one["ok"]}


@pytest.mark.parametrize(
    ("target", "text"),
    [
        ("nothing.py", "there is no such file"),
        (f"{HERE}:Sond", "Did you mean 'Sound'?"),
        ("Sprin", "Did you mean 'Spring' or"),
        ("no-such", "is no file"),
    ],
)
def test_a_wrong_target_is_an_error(target: str, text: str) -> None:
    done = CliRunner().invoke(main, ["check", target])
    assert done.exit_code == 1
    assert text in done.output
    assert "Traceback" not in done.output
    assert sys.exc_info() == (None, None, None)


class NoNumber(aw.Component):
    """An energy that is a list."""

    a: aw.Point = aw.connector(aw.Point, "Where it acts.")

    @aw.potential
    def energy(self) -> aw.Scalar:
        """Return nothing of use."""
        return []  # type: ignore[return-value]


def test_an_energy_that_is_an_empty_list_is_told() -> None:
    found = aw.check(NoNumber)
    assert not found.ok
    assert any("energy" in one.law and "list" in one.message for one in found.failures)
