"""progress=True: one line on standard error, which is gone at the end."""

import sys

import pytest

from atwood import UsageError, compare, progress, simulate, sweep
from atwood_library.scenes import DoublePendulum


@pytest.fixture
def every(monkeypatch: pytest.MonkeyPatch) -> None:
    """The line is written each time."""
    monkeypatch.setattr(progress, "_PAUSE", 0.0)


def lines(capsys: pytest.CaptureFixture[str]) -> list[str]:
    told = capsys.readouterr()
    assert not told.out
    assert "\n" not in told.err
    return [line for line in told.err.split("\r") if line]


def gone(written: list[str]) -> bool:
    """Whether nothing is left of the longest line."""
    return not written[-1].strip() and len(written[-1]) == len(written[-2].rstrip())


@pytest.mark.parametrize("solver", ["ida", "explicit"])
def test_of_a_run(every: None, capsys: pytest.CaptureFixture[str], solver: str) -> None:
    simulate(DoublePendulum(), t_end=2.0, progress=True, solver=solver)
    written = lines(capsys)
    assert written[0].startswith("DoublePendulum [")
    assert "of 2 s" in written[0]
    shares = [int(line.partition("]")[2].split()[0]) for line in written[:-1]]
    assert shares == sorted(shares)
    assert shares[-1] == 100
    assert gone(written)


def test_of_a_sweep_and_of_a_comparison(every: None, capsys: pytest.CaptureFixture[str]) -> None:
    sweep(DoublePendulum(), {"rod1.length": [1.0, 2.0, 3.0]}, t_end=0.1, progress=True)
    written = lines(capsys)
    assert "3 of 3 runs" in written[-2]
    assert gone(written)
    compare(DoublePendulum(), rtols=[1e-6], t_end=0.1, forms=["reduced"], progress=True)
    written = lines(capsys)
    assert any("rtol 1e-06" in line for line in written)
    assert gone(written)


def test_a_run_that_fails_leaves_no_line(every: None, capsys: pytest.CaptureFixture[str]) -> None:
    def failing() -> None:
        with progress.told(True, "x", lambda t: (t, "here")) as watch:
            watch(0.5)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        failing()
    assert gone(lines(capsys))


@pytest.mark.parametrize("quiet", [False, None])
def test_nothing_is_said_unless_asked_for(quiet: bool | None, capsys: pytest.CaptureFixture[str]) -> None:
    simulate(DoublePendulum(), t_end=0.1, progress=quiet)
    assert lines(capsys) == []


def test_a_program_without_a_console(every: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", None)
    assert simulate(DoublePendulum(), t_end=0.1, progress=True).status == "finished"


def test_other_values_are_refused() -> None:
    with pytest.raises(UsageError, match=r"progress cannot be 3.*True or False or a function"):
        simulate(DoublePendulum(), progress=3)
