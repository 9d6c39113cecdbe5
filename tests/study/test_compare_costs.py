"""What a comparison says beside errors: estimates, costs one by one, on what it was measured, files and pages."""

from __future__ import annotations

import csv
import json
from html.parser import HTMLParser

import pytest
from click.testing import CliRunner

from atwood import Comparison, UsageError, compare
from atwood.cli.app import main
from atwood.cli.scenes import bundled_scenes
from atwood.integrators.protocol import Statistics
from atwood.plotting.comparison_page import _cost, write_page
from atwood.plotting.plots.precision import plot_comparison, style_of
from atwood.study.comparison.found import ComparisonRow
from atwood.study.comparison.reference import Reference
from atwood_library.scenes import Chain, FourBar, SimplePendulum


@pytest.fixture(scope="module")
def found() -> Comparison:
    return compare(FourBar(), rtols=(1e-5, 1e-7), t_end=1.0)


def test_runs_estimate_their_own_errors(found):
    """The estimates need no reference, and agree with it."""
    for row in found.rows:
        assert row.estimate is not None
        assert row.error / 10.0 < row.estimate < 10.0 * row.error, row.label


def test_costs_are_told_apart(found):
    for row in found.rows:
        assert 0 < row.steps <= row.residuals
        assert (row.jacobians > 0) is (row.solver == "SUNDIALS IDA")
        assert row.monitor_s >= 0.0
        assert row.outputs_s >= 0.0
        assert row.wall_s > 0.0


def test_time_and_error_are_told_by_kind_of_work_and_by_part(found, tmp_path):
    """The kinds add up to the time of the integration; the largest error of a part is that of the row."""
    for row in found.rows:
        works = (row.equations_s, row.jacobians_s, row.linear_s, row.projections_s, row.own_s)
        is_implicit = row.solver == "SUNDIALS IDA"
        assert (row.jacobians_s is not None, row.linear_s is not None) == (is_implicit, is_implicit)
        assert (row.projections_s is not None) is ((row.form, row.level) == ("dae", ""))
        assert row.equations_s > 0.0
        total = sum(one for one in works if one is not None)
        assert total == pytest.approx(row.wall_s, rel=1e-9) or (row.own_s == 0.0 and total < 2.0 * row.wall_s)
        assert set(row.errors) <= {"crank", "coupler", "rocker", "ground", "pivot_a", "pivot_b", "hinge_a", "hinge_b"}
        assert max(row.errors.values()) == row.error
    _, shares = found.tables()
    assert [row[-1] for row in shares.rows] == [max(one.errors, key=one.errors.get) for one in found.rows]
    lines = list(csv.DictReader(found.save(tmp_path / "rows.csv").read_text().splitlines()))
    assert float(lines[0]["linear_s"]) == found.rows[0].linear_s
    assert found.to_dict()["rows"][0]["errors"] == found.rows[0].errors


def test_larger_matrices_are_factorised_as_they_are_in_runs():
    row = compare(Chain(), rtols=(1e-4,), forms=("dae",), levels=("index1",), t_end=0.1).rows[0]
    assert 0.0 < row.linear_s < row.wall_s


def test_looking_out_for_singular_positions_is_no_cost_of_a_form(monkeypatch):
    """A look-out that takes a second changes what it took itself, and no time by which forms are ranked."""
    from importlib import import_module

    module = import_module("atwood.study.comparison.compare")
    inner, spent = module.run_form, []

    def slow(*given):
        result = inner(*given)
        cost = result.statistics
        spent.append(cost.seconds)
        object.__setattr__(cost, "seconds", cost.seconds + 1.0)
        object.__setattr__(cost, "monitor_seconds", cost.monitor_seconds + 1.0)
        return result

    monkeypatch.setattr(module, "run_form", slow)
    row = compare(SimplePendulum(), rtols=(1e-5,), forms=("dae",), levels=("ggl",), t_end=0.5).rows[0]
    assert row.monitor_s >= 1.0
    assert row.wall_s <= max(spent)
    assert sum(Statistics(monitor_seconds=1.0).__add__(Statistics()).monitor_seconds for _ in range(2)) == 2.0


def test_figures_come_with_what_they_were_measured_on(found, tmp_path):
    assert set(found.environment) == {"processor", "system", "python", "versions", "blas", "threads", "load", "date"}
    assert "sundials" in found.environment["versions"]
    assert json.loads(json.dumps(found.to_dict()))["environment"] == dict(found.environment)
    rows = list(csv.DictReader(found.save(tmp_path / "rows.csv").read_text(encoding="utf-8").splitlines()))
    beside = json.loads((tmp_path / "rows.csv.json").read_text(encoding="utf-8"))
    assert beside["contents"][0]["about"]["environment"] == dict(found.environment)
    assert len(rows) == len(found.rows)
    assert [float(row["error"]) for row in rows] == [row.error for row in found.rows]
    with pytest.raises(UsageError, match="csv"):
        found.save(tmp_path / "rows.xls")


def test_forms_keep_their_colours_whatever_else_is_shown():
    labels = ["dae (ggl), IDA", "reduced, IDA", "reduced, explicit", "something else"]
    assert style_of("reduced, IDA", labels) == style_of("reduced, IDA", ["reduced, IDA"])
    assert len({style_of(label, labels) for label in labels}) == 4
    reference = Reference("closed form", "one", [0.0], {}, {}, 0.0)
    rows = [ComparisonRow("dae", "ggl", "SUNDIALS IDA", 1e-4, error=1e-4, wall_s=1e-3, steps=10)]
    alone = plot_comparison(Comparison("one", 1.0, reference, tuple(rows))).axes[0].lines[0].get_color()
    rows.insert(0, ComparisonRow("reduced", "", "SUNDIALS IDA", 1e-4, error=1e-4, wall_s=1e-3, steps=10))
    both = plot_comparison(Comparison("one", 1.0, reference, tuple(rows))).axes[0].lines
    assert both[1].get_color() == alone != both[0].get_color()


def test_time_for_all_runs_is_limited():
    rows = compare(SimplePendulum(), rtols=(1e-5,), t_end=0.5, total_seconds=1e9).rows
    assert not [row.reason for row in rows if row.reason]


def test_time_that_went_into_compiling_is_given_again(monkeypatch):
    from importlib import import_module

    module = import_module("atwood.study.comparison.compare")
    inner, calls = module.run_form, []

    def late(assembled, form, level, rtol, t_end, outputs, *rest):
        result = inner(assembled, form, level, rtol, t_end, outputs, *rest)
        calls.append(result)
        if len(calls) == 1:
            object.__setattr__(result.run, "status", "time_limit")
            object.__setattr__(result.statistics, "steps", 0)
        return result

    monkeypatch.setattr(module, "run_form", late)
    row = compare(SimplePendulum(), rtols=(1e-5,), forms=("dae",), levels=("ggl",), t_end=0.5).rows[0]
    assert not row.reason
    assert row.error is not None


def test_costs_of_errors_between_runs_and_beyond_them():
    points = [(1e-4, 1.0), (1e-6, 2.0)]
    assert _cost(points, 1e-5) == pytest.approx(2.0**0.5)
    assert _cost(points, 1e-2) == 1.0  # more accurate is no worse
    assert _cost(points, 1e-9) is None
    assert _cost([], 1e-2) is None


class _Page(HTMLParser):
    """Notes tags that are left open, what a page loads, and its text."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.sources: list[str] = []
        self.text = ""

    def handle_starttag(self, tag, attrs):
        self.sources += [value for name, value in attrs if name in ("src", "href") and not value.startswith("#")]
        if tag not in ("meta", "img"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


def test_page_needs_nothing_but_itself(found, tmp_path):
    page = _Page()
    page.feed(write_page([found], {"<odd>": "it failed & stopped"}, tmp_path / "page").read_text(encoding="utf-8"))
    assert not page.open
    assert all(source.startswith("data:image/svg+xml;base64,") for source in page.sources)
    assert len(page.sources) == 1
    assert found.verdict in page.text
    assert "<odd>" in page.text
    assert found.environment["processor"] in page.text
    assert (tmp_path / "page" / "comparisons.csv").is_file()


@pytest.mark.sample(0)
def test_all_scenes_make_one_page(monkeypatch, tmp_path):
    """Scenes that fail are on it with the reason, and the others are not lost."""
    wanted = ["simple-pendulum", "free-symmetric-body"]
    assert set(wanted) < set(bundled_scenes())
    import atwood.cli.comparing as comparing

    monkeypatch.setattr(comparing, "bundled_scenes", lambda: dict.fromkeys([*wanted, "no-such-scene"]))
    asked = ["compare", "--all", "--html", str(tmp_path / "all"), "--rtol", "1e-5", "--t-end", "0.2"]
    done = CliRunner().invoke(main, asked, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    page = (tmp_path / "all" / "index.html").read_text(encoding="utf-8")
    assert all(f"id='{name}'" in page for name in wanted)
    assert "there is no such scene" in page
    assert "3 of 3, no-such-scene" in done.output


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "which scene?"),
        (["simple-pendulum", "--all"], "all scenes as they are"),
        (["--all", "--plot", "one.png"], "--html DIR"),
        (["simple-pendulum", "--save", "rows.xls"], "Use .csv"),
        (["simple-pendulum", "--html", "no/such/place"], "Make it first"),
        (["simple-pendulum", "--long", "10", "--rtol", "1e-4"], "many periods"),
        (["falling-with-drag", "--long", "10"], "air"),
    ],
)
def test_what_contradicts_is_refused(arguments, said):
    done = CliRunner().invoke(main, ["compare", *arguments], catch_exceptions=False)
    assert done.exit_code != 0
    assert said in done.output
