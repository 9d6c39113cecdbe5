"""Other values for an assembled scene: what is compiled stays, what must change does, and the answers are the same."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from atwood import (
    Component,
    ParameterError,
    Point,
    Scalar,
    Scene,
    StartError,
    TopologyError,
    UsageError,
    connector,
    constraint,
    dot,
    parameter,
)
from atwood.codegen.llvm import engine as llvm_engine
from atwood.codegen.python import backend as python_backend
from atwood.expr.core.graph import Graph
from atwood.expr.core.program import Program
from atwood.forms.assembly import Assembly
from atwood.pipeline import assemble, assemble_flat, simulate
from atwood_library import Ground, Link, Pivot, PointMass, Rod, Rope, Spring
from atwood_library.scenes import SCENES, Atwood, Chain, DoublePendulum

from ..helpers.runs import GENERAL


@pytest.fixture(autouse=True)
def compiled_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compile programs at their first call, so that what is compiled later is new."""
    monkeypatch.setattr(python_backend, "WALKS", 0)
    monkeypatch.setattr("atwood.simulation.problem.problem._MANY_STATES", -1)


@contextmanager
def counting(monkeypatch: pytest.MonkeyPatch) -> Iterator[dict[str, int]]:
    """Count what is compiled or loaded, programs that are made, and graphs of expressions."""
    counts = {"Python": 0, "machine code": 0, "loaded": 0, "programs": 0, "graphs": 0}

    def counted(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **options: Any) -> Any:
            counts[name] += 1
            return function(*arguments, **options)

        return call

    with monkeypatch.context() as patch:
        patch.setattr(python_backend, "_execute", counted("Python", python_backend._execute))
        for module in ("atwood.codegen.llvm.build", "atwood.codegen.llvm.engine"):
            patch.setattr(f"{module}.compile_text", counted("machine code", llvm_engine.compile_text))
            patch.setattr(f"{module}.load_code", counted("loaded", llvm_engine.load_code))
        patch.setattr(Program, "__post_init__", counted("programs", Program.__post_init__))
        patch.setattr(Graph, "__init__", counted("graphs", Graph.__init__))
        yield counts


def numbers(scene: Scene) -> dict[str, float]:
    """Return the parameters of a scene itself that are numbers other than zero."""
    own = {name: getattr(scene, name) for name in type(scene).parameter_specs()}
    skipped = ("t_start", "t_end")
    return {k: v for k, v in own.items() if isinstance(v, float) and v != 0.0 and k not in skipped}


def moved(scene: Scene) -> dict[str, float]:
    return {name: 1.03 * value for name, value in numbers(scene).items()}


@pytest.mark.sample(8)
@pytest.mark.parametrize("solver", ["ida", "explicit", "auto"])
@pytest.mark.parametrize("name", GENERAL)
@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_other_values_compile_nothing(name: str, form: str, solver: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = SCENES[name]()
    first = assemble(scene, form=form)
    options = {"t_end": 0.05, "solver": solver, "outputs": 3}
    paths = [one.name for one in first.reduced.names if one.name in first.observables]
    simulate(first, **options).table(paths)
    start = {path: value + 1e-3 for path, value in first.flat.start.items() if "velocity" in path}
    with counting(monkeypatch) as counts:
        other = first.with_values(moved(scene), start=start)
        simulate(other, **options).table(paths)
    assert other.why_new == ""
    assert counts == dict.fromkeys(counts, 0)
    assert other.shared is first.shared


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", GENERAL)
@pytest.mark.parametrize("form", ["reduced", "dae"])
def test_answers_are_those_of_a_scene_made_so(name: str, form: str) -> None:
    scene = SCENES[name]()
    other = assemble(scene, form=form).with_values(moved(scene))
    fresh = simulate(SCENES[name](**moved(scene)), form=form, t_end=0.2, outputs=5)
    found = simulate(other, t_end=0.2, outputs=5)
    assert found.statistics.steps == fresh.statistics.steps
    for path, values in fresh.table().items():
        size = max(1.0, float(np.nanmax(np.abs(values), initial=0.0)))
        assert_allclose(found.array(path), values, rtol=0.0, atol=1e-9 * size, err_msg=path)
    assert found.energy.max_drift < 3e-3


def test_the_scene_itself_stays_as_it_was() -> None:
    scene = DoublePendulum()
    first = assemble(scene)
    other = first.with_values({"mass1": 3.0}, start={"rod1.angle": "10 deg"})
    again = other.with_values({"mass2": "500 g"})
    assert (scene.mass1, scene.start["rod1.angle"]) == (1.0, pytest.approx(np.pi / 2))
    assert [one.mechanism.table.values[one.parameters[k]] for one in (first, other, again) for k in masses(first)] == [
        1.0, 1.0, 3.0, 1.0, 3.0, 0.5,
    ]  # fmt: skip
    assert again.flat.start["rod1.angle"] == pytest.approx(np.pi / 18)
    scene.mass1 = 7.0  # what happens to the scene later is its own affair
    assert first.with_values({"mass2": 2.0}).flat.parts["bob1"].values["mass"] == 1.0


def masses(assembly: Assembly) -> list[int]:
    return [[one.name for one in assembly.parameters].index(f"bob{k}.mass") for k in (1, 2)]


def test_start_values_come_and_go() -> None:
    first = assemble(DoublePendulum())
    other = first.with_values(start={"rod1.angle": None, "bob1.position.x": 0.25, "rod1.angular_velocity": 1.0})
    assert simulate(other, t_end=0.1)["bob1.position.x"][0] == pytest.approx(0.25)
    with pytest.raises(UsageError, match="no such start value"):
        other.with_values(start={"rod1.angle": None})
    guessed = other.with_values(guess={"rod1.angle": 3.0})
    assert simulate(guessed, t_end=0.1)["bob1.position.z"][0] == pytest.approx(np.sqrt(1.0 - 0.25**2))


@pytest.mark.parametrize(
    ("values", "start", "kind", "message"),
    [
        ({"mas1": 1.0}, {}, ParameterError, "mass1"),
        ({"rod3.length": 1.0}, {}, UsageError, "rod2"),
        ({"mass1": "3 m"}, {}, ParameterError, "kg"),
        ({"length1": -1.0}, {}, ParameterError, "length1"),
        ({}, {"rod1.angel": 1.0}, StartError, "rod1.angle"),
        ({}, {"rod1.angle": "1 m"}, StartError, "rad"),
        ({}, {"rod1.angle": float("nan")}, StartError, "finite"),
    ],
)
def test_bad_values_are_refused(values: Any, start: Any, kind: Any, message: str) -> None:
    with pytest.raises(kind) as caught:
        assemble(DoublePendulum()).with_values(values, start=start)
    assert message in str(caught.value)


def test_leaves_alone_have_no_values_to_change() -> None:
    first = assemble(DoublePendulum())
    with pytest.raises(UsageError, match="assembled from leaves"):
        assemble_flat(first.flat).with_values({"mass1": 2.0})


# -- structure -----------------------------------------------------------------------------------------------------


def test_a_count_assembles_anew() -> None:
    first = assemble(Chain(links=2))
    other = first.with_values({"links": 3})
    assert other.why_new == "it has other parts"
    assert len(other.reduced.coordinates) == 3
    assert other.with_values({"links": 2}).why_new


def pendulum(mass: float = 0.0) -> Scene:
    scene = Scene()
    scene.add("ground", Ground())
    scene.add("rod", Rod(length=1.0, mass=mass))
    scene.add("bob", PointMass(mass=1.0))
    scene.connect(scene["ground"].frame, scene["rod"].a)
    scene.connect(scene["rod"].b, scene["bob"].point)
    scene.start["rod.angle"] = 1.0
    return scene


@pytest.mark.parametrize(("before", "after"), [(0.0, 0.6), (0.6, 0.0)])
def test_an_exact_zero_assembles_anew(before: float, after: float) -> None:
    other = assemble(pendulum(before)).with_values({"rod.mass": after})
    assert "rod.mass" in other.why_new
    found, fresh = (simulate(one, t_end=0.5) for one in (other, pendulum(after)))
    assert_allclose(found["rod.angle"], fresh["rod.angle"], rtol=1e-12)


def test_a_choice_assembles_anew() -> None:
    scene = Scene()
    scene.add("ground", Ground())
    scene.add("rope", Rope(length=1.0))
    scene.add("bob", PointMass(mass=1.0))
    scene.connect(scene["ground"].frame, scene["rope"].a)
    scene.connect(scene["rope"].b, scene["bob"].point)
    scene.start["bob.position.z"] = -1.0
    other = assemble(scene).with_values({"rope.when_slack": "slack"})
    assert other.why_new == "rope.when_slack was stop and is slack"


def hanging(side: float) -> Scene:
    scene = Scene(space="line", line_axis=(0.0, 0.0, 1.0))
    scene.add("ground", Ground())
    scene.add("spring", Spring(stiffness=50.0, natural_length=1.0))
    scene.add("bob", PointMass(mass=1.0))
    scene.connect(scene["ground"].frame, scene["spring"].a)
    scene.connect(scene["spring"].b, scene["bob"].point)
    scene.start["bob.position.z"] = side
    return scene


def test_the_other_side_on_a_line_assembles_anew() -> None:
    first = assemble(hanging(-1.0))
    assert first.with_values(start={"bob.position.z": -0.8}).why_new == ""
    other = first.with_values(start={"bob.position.z": 1.1})
    assert "sides" in other.why_new
    fresh = simulate(hanging(1.1), t_end=0.3)
    assert_allclose(simulate(other, t_end=0.3)["bob.position.z"], fresh["bob.position.z"], rtol=1e-10)


class Lever(Component):
    """Two ends whose displacements stand in a ratio."""

    ratio: float = parameter(1.0, unit="1", doc="Of the displacements.")
    a: Point = connector(Point, "One end.")
    b: Point = connector(Point, "The other end.")

    @constraint(reaction="force", unit="N", doc="Force.")
    def follows(self) -> Scalar:
        """Return what must be zero."""
        return self.ratio * dot(self.a.position, self.line) - dot(self.b.position, self.line)


def lever(ratio: float) -> Scene:
    scene = Scene(space="line", line_axis=(0.0, 0.0, 1.0))
    scene.add("lever", Lever(ratio=ratio))
    for end in ("a", "b"):
        scene.add(end, PointMass(mass=1.0))
        scene.connect(scene[end].point, getattr(scene["lever"], end))
    scene.start["a.position.z"] = 0.1
    scene.start["a.velocity.z"] = 0.0
    return scene


@pytest.mark.parametrize(("ratio", "is_new"), [(0.5, False), (3.0, False), (1e-3, False), (30.0, True)])
def test_another_pivot_assembles_anew(ratio: float, is_new: bool) -> None:
    """Nothing is divided by a coefficient that is small beside the others."""
    first = assemble(lever(2.0))
    other = first.with_values({"lever.ratio": ratio})
    assert bool(other.why_new) == is_new
    found, fresh = (simulate(one, t_end=0.2) for one in (other, lever(ratio)))
    for path in ("a.position.z", "b.position.z"):
        assert_allclose(found[path], fresh[path], rtol=1e-9)


def closed(length: float) -> Scene:
    scene = Scene()
    scene.add("ground", Ground())
    scene.add("post", Link(length=2.0))
    scene.add("far", Ground(position=(length, 0.0, 0.0)))
    scene.connect(scene["ground"].frame, scene["post"].a)
    scene.connect(scene["post"].b, scene["far"].frame)
    scene.add("pivot", Pivot())
    scene.add("arm", Link(length=1.0, mass=1.0))
    scene.connect(scene["post"].b, scene["pivot"].a)
    scene.connect(scene["pivot"].b, scene["arm"].a)
    return scene


def test_rigid_parts_must_fit_with_other_values_too() -> None:
    first = assemble(closed(2.0))
    with pytest.raises(TopologyError, match="contradict"):
        assemble(closed(2.5))
    with pytest.raises(TopologyError, match="contradict"):
        first.with_values({"post.length": 2.5})


def test_modes_are_assembled_once_for_all_values() -> None:
    scene = Scene()
    scene.add("ground", Ground())
    scene.add("rope", Rope(length=1.0, when_slack="slack"))
    scene.add("bob", PointMass(mass=1.0))
    scene.connect(scene["ground"].frame, scene["rope"].a)
    scene.connect(scene["rope"].b, scene["bob"].point)
    scene.start.update({"bob.position.x": 0.0, "bob.position.z": -1.0, "bob.velocity.x": 5.8})
    first = assemble(scene)
    run = simulate(first, t_end=1.5).run
    assert len(run.segments) > 1
    other = first.with_values({"bob.mass": 2.0}, start={"bob.velocity.x": 5.9})
    again = simulate(other, t_end=1.5)
    for old, new in zip(run.segments, again.run.segments, strict=False):
        assert new.assembly.shared is old.assembly.shared
    scene["bob"].mass = 2.0
    scene.start["bob.velocity.x"] = 5.9
    fresh = simulate(scene, t_end=1.5)
    assert_allclose(again["bob.position.z"], fresh["bob.position.z"], rtol=1e-9, atol=1e-9)
    assert [one.time for one in again.events] == pytest.approx([one.time for one in fresh.events])


def test_ropes_over_pulleys() -> None:
    first = assemble(Atwood())
    other = first.with_values({"mass1": 5.0, "rope_length": 6.0})
    assert other.why_new == ""
    result = simulate(other, t_end=1.0)
    closed_form = Atwood(mass1=5.0, rope_length=6.0).closed_form(result.time)
    for path, values in closed_form.items():
        assert_allclose(result.array(path), values, rtol=1e-6, atol=1e-9, err_msg=path)
