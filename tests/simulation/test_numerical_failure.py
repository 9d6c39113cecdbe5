"""No error of a library reaches a person: what cannot be worked with is said with its part and its time."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import FrameType
from typing import Any

import numpy as np
import pytest

from atwood import AtwoodError, Scene, SolveError, StartError, assemble, simulate
from atwood.simulation.dynamics.kinematic_map import kinematic_map_of
from atwood.simulation.dynamics.numerical_failure import is_numerical, named
from atwood.simulation.initialization.start import find_start, own_state
from atwood.simulation.run import recorder as record
from atwood_library import Damper, Ground, PointMass, Rod, Rope
from atwood_library.scenes import DoublePendulum, FourBar, FreeBody, SliderCrank

from ..helpers.runs import FORMS

Break = Callable[..., list[int]]


@pytest.fixture
def break_down(monkeypatch: pytest.MonkeyPatch) -> Break:
    """Make a function of linear algebra fail where a module needs it, itself or by what numerics has."""

    def prepare(name: str, module: str) -> list[int]:
        works, calls = getattr(np.linalg, name), [0]

        def fails(*arguments: Any, **options: Any) -> Any:
            frame: FrameType | None = sys._getframe(1)
            while frame is not None and frame.f_globals["__name__"].startswith("atwood.numerics"):
                frame = frame.f_back
            if frame is not None and frame.f_globals["__name__"].endswith(module):
                calls[0] += 1
                raise np.linalg.LinAlgError("SVD did not converge")
            return works(*arguments, **options)

        monkeypatch.setattr(np.linalg, name, fails)
        return calls

    return prepare


def hung_from(part: Any, x: float, z: float = 0.0, mass: float = 1.0) -> Scene:
    """Return a bob at the end of a part whose other end is held."""
    scene = Scene(t_end=1.0)
    ground, between = scene.add("ground", Ground()), scene.add("between", part)
    bob = scene.add("bob", PointMass(mass=mass))
    scene.connect(ground.frame, between.a)
    scene.connect(between.b, bob.point)
    scene.start.update({"bob.position.x": x, "bob.position.z": z} if x else {})
    return scene


def test_a_start(break_down: Break) -> None:
    calls = break_down("lstsq", "initialization.system")
    with pytest.raises(StartError, match=r"at t = 0 its numbers could not be worked with \(") as caught:
        simulate(FourBar())
    assert calls[0] >= 1
    assert caught.value.where
    assert caught.value.advice
    assert isinstance(caught.value.__cause__, np.linalg.LinAlgError)


@pytest.mark.parametrize("form", FORMS)
def test_a_projection_in_the_middle_of_a_run(form: str, break_down: Break, monkeypatch: pytest.MonkeyPatch) -> None:
    project = record.project_rows

    def doubtful(plan: Any, t: Any, *given: Any) -> Any:
        made = project(plan, t, *given)
        made.doubtful[t > 0.5] = True
        if np.any(t > 0.5):
            break_down("lstsq", "dynamics.balance")
        return made

    monkeypatch.setattr(record, "project_rows", doubtful)
    with pytest.raises(SolveError, match="its numbers could not be worked with") as caught:
        simulate(SliderCrank(), form=form, t_end=1.0, solver="ida")  # formulas put states onto the constraints
    assert "what moves fastest there is" in caught.value.message
    assert caught.value.where


def test_an_impact(break_down: Break) -> None:
    calls = break_down("lstsq", "events.mode_change")
    with pytest.raises(SolveError, match="its numbers could not be worked with") as caught:
        simulate(hung_from(Rope(length=1.0, starts="slack"), 0.5))
    assert calls[0] == 1
    run = caught.value.run  # type: ignore[attr-defined]
    assert run.status == "failed"
    assert 0.3 < run.segments[-1].time[-1] < 0.6
    assert "bob" in caught.value.message


def test_eigenvalues_that_do_not_come_out_tell_nothing_of_stiffness(break_down: Break) -> None:
    scene = hung_from(Damper(damping=0.1), 1.0)
    plain = simulate(scene)
    calls = break_down("eigvals", "run.choice")
    assert simulate(scene)["bob.position.z"][-1] == plain["bob.position.z"][-1]
    assert calls[0] >= 1


def test_inertia_that_cannot_be_decomposed(break_down: Break) -> None:
    calls = break_down("eigh", "initialization.mobility")
    scene = hung_from(Rod(length=1.0), 0.0, mass=0.0)
    with pytest.raises(AtwoodError, match="could not be worked with"):
        simulate(scene)
    assert calls[0] == 1


def test_orientations_that_cannot_be_compared() -> None:
    assembly = assemble(FreeBody())
    start = find_start(assembly)
    q = start.coordinates
    with (
        pytest.raises(SolveError, match="could not be worked with"),
        named(assembly, start.time, *own_state(assembly, start)),
    ):
        kinematic_map_of(assembly, "regular").difference(start.time, np.full_like(q, np.nan), q)


def test_errors_of_others_pass_through() -> None:
    def progress(t: float) -> None:
        if t > 0.1:
            raise ZeroDivisionError("of whoever wrote this")

    for solver in ("ida", "explicit"):
        with pytest.raises(ZeroDivisionError, match="of whoever wrote this"):
            simulate(DoublePendulum(), progress=progress, solver=solver)
    with pytest.raises(ValueError, match="no number") as caught:
        int("no number")
    assert not is_numerical(caught.value)
