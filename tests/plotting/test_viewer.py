"""The viewer's end in Python: what is set, what is refused, and what it runs."""

import sys

import pytest

from atwood import AtwoodError, UsageError, Viewer, simulate
from atwood_library.scenes import SCENES

pytest.importorskip("anywidget")


@pytest.fixture
def viewer() -> Viewer:
    return Viewer(simulate(SCENES["double-pendulum"](), t_end=0.5, outputs=11))


def test_what_is_set_is_run_and_shown(viewer: Viewer) -> None:
    before = viewer.widget.packets
    viewer.set("rod1.length", 0.7)
    viewer.widget.settings = {**viewer.widget.settings, "rod2.angle": 0.25}  # as a slider does
    viewer.widget.time = 0.125
    assert (viewer.parameters["rod1.length"], viewer.start["rod2.angle"], viewer.time) == (0.7, 0.25, 0.125)
    result = viewer.run(t_end=0.3)
    scene = SCENES["double-pendulum"]()
    scene.set("rod1.length", 0.7)
    scene.start["rod2.angle"] = 0.25
    wanted = simulate(scene, t_end=0.3)
    assert result["bob2.position.x"][-1] == pytest.approx(wanted["bob2.position.x"][-1], abs=1e-9)
    assert (viewer.parameters["rod1.length"], viewer.start["rod2.angle"]) == (0.7, 0.25)
    assert viewer.widget.settings == {}
    assert viewer.widget.packets["payload"] != before["payload"]
    assert viewer._repr_mimebundle_()


@pytest.mark.parametrize(
    ("name", "path"),
    [
        ("heavy-top", "top.moments[2]"),
        ("chain", "rod[3].length"),
        ("four-bar-row", "ground[1].position[0]"),
        ("overhead-crane", "rope.motion[hoist]"),
        ("foucault-pendulum", "gravity"),
    ],
)
def test_numbers_in_vectors_arrays_and_functions_are_set(name: str, path: str) -> None:
    viewer = Viewer(simulate(SCENES[name](), t_end=0.01, outputs=3))
    wanted = 1.01 * viewer.parameters[path]
    viewer.set(path, wanted)
    viewer.run(t_end=0.01, outputs=3)
    assert viewer.parameters[path] == wanted


def test_what_cannot_be_set_is_refused(viewer: Viewer, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(UsageError, match=r"rod1\.length"):
        viewer.set("rod1.lenght", 1.0)
    with pytest.raises(AtwoodError, match=r"rod1"):
        viewer.set("rod1.length", -1.0)
    assert viewer.widget.settings == {}
    with pytest.raises(UsageError, match=r"rod1\.angle"):
        Viewer(viewer.result, show="rod1.angel")
    monkeypatch.setitem(sys.modules, "anywidget", None)
    with pytest.raises(UsageError, match=r"pip install 'atwood\[notebook\]'"):
        Viewer(viewer.result)
