"""Pictures: that they can be made, and that what is in them is what was asked for."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from atwood import ResultError, UsageError
from atwood.pipeline import simulate
from atwood.result.files import load_result
from atwood.result.result import Result
from atwood_library.scenes import SCENES

pytest.importorskip("matplotlib")

from atwood.plotting import animate, plot, plot_comparison, plot_mechanism
from atwood.plotting.planar.columns import spread_columns
from atwood.plotting.planar.geometry import make_picture
from atwood.study import compare

from ..helpers.runs import GENERAL

DRAWN = (*GENERAL, "charged-particle", "trebuchet", "oscillators", "strandbeest", "andrews-squeezer", "n-body")


@pytest.fixture(scope="module")
def results() -> dict[str, Result]:
    return {name: simulate(kind(), t_end=0.5, rtol=1e-6, outputs=41) for name, kind in SCENES.items() if name in DRAWN}


@pytest.mark.sample(8)
@pytest.mark.parametrize("name", DRAWN)
def test_every_scene_can_be_drawn(results: dict[str, Result], name: str, tmp_path: Path) -> None:
    file = tmp_path / "picture.png"
    plot_mechanism(results[name], file)
    assert file.stat().st_size > 3000
    assert [one.name for one in tmp_path.iterdir()] == ["picture.png"]


def test_shapes_are_found_from_laws(results: dict[str, Result]) -> None:
    def kinds(name: str) -> dict[str, str]:
        return {shape.part: shape.kind for shape in make_picture(results[name]).shapes}

    assert kinds("double-pendulum") == {
        "ground": "ground",
        "rod1": "rod",
        "rod2": "rod",
        "bob1": "mass",
        "bob2": "mass",
    }
    assert set(kinds("four-bar").values()) == {"ground", "link", "pivot"}
    assert kinds("pendulum-on-cart")["rail"] == "rail"
    assert kinds("mass-spring-chain")["spring1"] == "spring"
    assert {kinds("double-atwood")[part] for part in ("pulley1", "pulley2")} == {"pulley"}


def test_places_are_where_the_masses_are(results: dict[str, Result]) -> None:
    for name, path in (("double-pendulum", "bob2"), ("pendulum-on-cart", "cart")):
        picture = make_picture(results[name])
        (node,) = next(shape.nodes for shape in picture.shapes if shape.part == path and shape.kind == "mass")
        for column, axis in enumerate("xz"):
            expected = results[name].array(f"{path}.position.{axis}")
            np.testing.assert_allclose(picture.points[node][:, column], expected, atol=1e-12)


def test_on_a_vertical_line_things_stand_side_by_side(results: dict[str, Result]) -> None:
    picture = make_picture(results["double-atwood"])
    assert picture.direction == "up"
    columns = {
        shape.part: float(picture.points[shape.nodes[0]][0, 0]) for shape in picture.shapes if shape.kind == "mass"
    }
    assert len({round(column, 9) for column in columns.values()}) == 3


def test_ropes_hang_straight_down() -> None:
    columns, places, radii = spread_columns([(1, 2, 3)], [(3, 4)], {1: 1, 2: 0, 3: 2, 4: 3}, 0.5)
    assert places == {2: 0.0}
    assert radii == {2: 0.5}
    assert columns == {0: 0.0, 1: -0.5, 2: 0.5, 3: 0.5}


def test_plot_groups_by_unit_and_shows_the_energy(results: dict[str, Result]) -> None:
    figure = plot(results["double-pendulum"])
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert labels == ["angle, rad", "tension, N", "energy drift / exchanged"]
    assert figure.axes[-1].get_xlabel() == "time, s"
    assert [line.get_label() for line in figure.axes[0].get_lines()] == ["rod1", "rod2"]


def test_plot_of_chosen_quantities(results: dict[str, Result], tmp_path: Path) -> None:
    result = results["double-pendulum"]
    figure = result.plot(["bob1.position", "rod1.tension"], tmp_path / "plot.pdf")
    assert [axes.get_ylabel() for axes in figure.axes] == ["position, m", "tension, N"]
    assert (tmp_path / "plot.pdf").read_bytes().startswith(b"%PDF")
    line = figure.axes[1].get_lines()[0]
    np.testing.assert_array_equal(line.get_ydata(), result.array("rod1.tension"))
    with pytest.raises(ResultError):
        result.plot(["rod1.tensoin"])
    with pytest.raises(ResultError, match="units"):
        result.plot(["rod1", "bob1"])


def test_a_saved_result_can_be_plotted(results: dict[str, Result], tmp_path: Path) -> None:
    saved = load_result(results["double-pendulum"].save(tmp_path / "run.npz"))
    assert [axes.get_ylabel() for axes in plot(saved).axes] == ["angle, rad", "tension, N"]


def test_many_curves_are_thinned_out(results: dict[str, Result]) -> None:
    figure = plot(results["chain"])
    names = [line.get_label() for line in figure.axes[0].get_lines()]
    assert len(names) == 8
    assert names[0] == "rod[0]"


def test_work_precision_diagram(tmp_path: Path) -> None:
    found = compare(SCENES["simple-pendulum"](), t_end=0.5, rtols=(1e-4, 1e-6))
    figure = plot_comparison(found, tmp_path / "compare.svg")
    assert [axes.get_xlabel() for axes in figure.axes] == ["time, ms", "steps"]
    assert len(figure.axes[0].get_lines()) >= 4
    assert "<svg" in (tmp_path / "compare.svg").read_text(encoding="utf-8")


def test_animation(results: dict[str, Result], tmp_path: Path) -> None:
    from PIL import Image

    file = animate(results["simple-pendulum"], tmp_path / "run.gif", seconds=0.3, frames_per_second=10)
    with Image.open(file) as picture:
        assert picture.n_frames == 3  # type: ignore[attr-defined]


def test_a_notebook_plays_an_animation(results: dict[str, Result], tmp_path: Path) -> None:
    played = animate(results["simple-pendulum"], seconds=0.2, frames_per_second=10)
    assert played.content.startswith(b"GIF8")
    assert 'src="data:image/gif;base64,R0lGOD' in played._repr_html_()
    with pytest.raises(TypeError, match="was not saved"):
        os.fspath(played)
    saved = animate(results["simple-pendulum"], tmp_path / "run.gif", seconds=0.2, frames_per_second=10)
    assert Path(saved).read_bytes() == saved.content
    assert len(repr(saved)) < 300


def test_a_notebook_shows_a_figure_without_a_word(results: dict[str, Result]) -> None:
    for figure in (plot(results["simple-pendulum"]), plot_mechanism(results["simple-pendulum"])):
        assert figure._repr_png_().startswith(b"\x89PNG")  # what IPython asks for where no backend was chosen


@pytest.mark.parametrize("name", ["picture", "picture.xyz", "missing/picture.png"])
def test_pictures_that_cannot_be_saved(results: dict[str, Result], tmp_path: Path, name: str) -> None:
    with pytest.raises(UsageError):
        plot(results["simple-pendulum"], file=tmp_path / name)
    with pytest.raises(UsageError):
        plot_mechanism(results["simple-pendulum"], tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_times_outside_the_run_are_refused(results: dict[str, Result]) -> None:
    with pytest.raises(UsageError, match="outside the run"):
        plot_mechanism(results["simple-pendulum"], times=[0.1, 3.0])


def test_without_matplotlib_there_is_advice(results: dict[str, Result], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(UsageError, match=r"pip install 'atwood\[plot\]'"):
        plot(results["simple-pendulum"])


def test_views_import_matplotlib_late() -> None:
    import os

    root = Path(__file__).resolve().parents[2]
    path = os.pathsep.join([str(root / "src"), str(root / "library")])
    code = "import sys, atwood.plotting; print('matplotlib' in sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": path},
    )
    assert done.stdout.strip() == "False", done.stderr
