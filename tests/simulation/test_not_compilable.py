"""Scenes that cannot become machine code: what is said, and that they run all the same."""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np
import pytest

import atwood as aw
from atwood import Component, ExternalFunction, Point, Scalar, Scene, connector, external, parameter, potential
from atwood.codegen.llvm import text as llvm_text
from atwood_library import Force, Ground, PointMass, Spring
from atwood_library.scenes import FourBar

_CUBE = ExternalFunction(
    "cube",
    lambda x: x**3,
    (ExternalFunction("cube'", lambda x: 3.0 * x**2, (ExternalFunction("cube''", lambda x: 6.0 * x),)),),
)


class Plain(Component):
    """A spring whose energy grows with the cube of its length."""

    stiffness: float = parameter(2.0, unit="N/m", minimum=0.0, doc="Stiffness.")
    a: Point = connector(Point, "One end.")
    b: Point = connector(Point, "The other end.")

    def cube(self, length: Scalar) -> Scalar:
        return length**3

    @potential
    def energy(self) -> Scalar:
        """Return the energy."""
        return self.stiffness * self.cube(self.distance(self.a, self.b))


class Odd(Plain):
    """The same by a function in Python."""

    def cube(self, length: Scalar) -> Scalar:
        return external(_CUBE, length)


def hanging(kind: type[Plain]) -> Scene:
    """Return a bob on a spring."""
    scene = Scene(t_end=1.0)
    ground, odd, bob = scene.add("ground", Ground()), scene.add("odd", kind()), scene.add("bob", PointMass())
    scene.connect(ground.frame, odd.a)
    scene.connect(odd.b, bob.point)
    scene.start.update({"bob.position.x": 0.3, "bob.position.z": -1.2})
    return scene


def looped(kind: type[Plain]) -> Scene:
    """Return a four-bar with such a spring between the ends of its coupler and its frame."""
    scene = FourBar()
    odd = scene.add("odd", kind())
    scene.connect(scene.left.frame, odd.a)
    scene.connect(odd.b, scene.coupler.b)
    return scene


@pytest.mark.sample(2)
@pytest.mark.parametrize("solver", ["ida", "ida-sundae", "auto"])
@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("make", [hanging, looped])
def test_a_function_in_python_is_announced_and_runs(make: Any, form: str, solver: str) -> None:
    with (
        pytest.warns(UserWarning, match=r"is evaluated in Python.*odd\.energy calls the function 'cube'"),
        pytest.warns(UserWarning, match=r"nothing is known of cube.* but samples"),
    ):
        found = aw.simulate(make(Odd), form=form, solver=solver, rtol=1e-8, t_end=0.4, outputs=5)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        expected = aw.simulate(make(Plain), form=form, solver=solver, rtol=1e-8, t_end=0.4, outputs=5)
    for path in found.paths:
        if path.endswith(("position.x", "position.z", ".angle")):
            assert np.max(np.abs(found.array(path) - expected.array(path))) < 1e-5


def test_the_part_that_is_named_is_the_one_that_calls() -> None:
    scene = hanging(Plain)
    wind = ExternalFunction("wind", math.sin, (ExternalFunction("slope of wind", math.cos),))
    scene.add("push", Force(value=lambda t: aw.cos(t)))
    scene.add("blow", Force(value=lambda t: external(wind, t)))
    for name in ("push", "blow"):
        scene.connect(getattr(scene, name).point, scene.bob.point)
    with (
        pytest.warns(UserWarning, match=r"blow\.value calls the function 'wind'"),
        pytest.warns(UserWarning, match="nothing is known of wind but samples"),
    ):
        aw.simulate(scene, t_end=0.1)


def test_an_operation_without_code_names_component_and_law(monkeypatch: pytest.MonkeyPatch) -> None:
    library = {name: call for name, call in llvm_text.OWN_FUNCTIONS.items() if name != "tanh"}
    monkeypatch.setattr(llvm_text, "OWN_FUNCTIONS", library)

    class Soft(Component):
        a: Point = connector(Point, "One end.")
        b: Point = connector(Point, "The other end.")

        @potential
        def energy(self) -> Scalar:
            """Return the energy."""
            return aw.tanh(self.distance(self.a, self.b))

    scene = hanging(Plain)
    soft = scene.add("soft", Soft())
    scene.connect(scene.ground.frame, soft.a)
    scene.connect(soft.b, scene.bob.point)
    spring = scene.add("spring", Spring())
    scene.connect(scene.ground.frame, spring.a)
    scene.connect(spring.b, scene.bob.point)
    with pytest.warns(
        UserWarning, match=r"soft\.energy needs the operation 'tanh', for which there is no machine code"
    ):
        found = aw.simulate(scene, t_end=0.5, rtol=1e-8, solver="ida")
    assert found.statistics.steps > 10
    assert isinstance(found.energy.max_drift, float)
    assert found.energy.max_drift < 1e-5
