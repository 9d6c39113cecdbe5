"""Exported modules of Python: scipy finds the same motion, or the export is refused by name."""

import types
import warnings
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from atwood import Scene, UnsupportedError, assemble, equations, simulate

from ...helpers.smooth import SMOOTH as SCENES

REFUSED = {"cart-pole": r"regulator\.y"}
"""Scenes with values that are held from sample to sample."""


def exported(assembly: Any) -> Any:
    module = types.ModuleType("exported")
    exec(compile(equations(assembly).python(), "exported", "exec"), module.__dict__)
    return module


def check(scene: Scene, form: str, share: float = 0.02) -> None:
    """Compare the end of a short run with what scipy makes of the module."""
    assembly = assemble(scene, form=form)
    module = exported(assembly)
    result = simulate(assembly, t_end=min(0.1, share * scene.t_end), rtol=1e-10, outputs=3)
    first = result.run.segments[0]
    states = np.concatenate([first.coordinates, first.speeds])
    span = float(first.time[0]), float(first.time[-1])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = solve_ivp(module.derivative, span, states[:, 0], method="DOP853", rtol=1e-9, atol=1e-10)
    assert found.success
    assert found.y[:, -1] == pytest.approx(states[:, -1], rel=2e-6, abs=2e-6)


@pytest.mark.sample(2)
@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("name", [name for name in SCENES if name not in REFUSED])
def test_a_module_is_what_runs(name: str, form: str) -> None:
    check(SCENES[name](), form)


@pytest.mark.parametrize(("name", "form"), [("universal-shaft", "dae"), ("double-cardan-twice", "reduced")])
def test_redundant_constraints_leave_the_motion_as_it_is(name: str, form: str) -> None:
    check(SCENES[name](), form, 0.01)


@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("name", REFUSED)
def test_what_is_held_between_samples_is_refused_by_name(name: str, form: str) -> None:
    with pytest.raises(UnsupportedError, match=REFUSED[name]):
        equations(SCENES[name](), form=form).python()


@pytest.mark.parametrize("name", ["four-bar", "bricard"])
def test_multipliers_are_the_smallest_that_hold_the_constraints(name: str) -> None:
    assembly = assemble(SCENES[name](), form="dae")
    module, first = exported(assembly), simulate(assembly, t_end=1e-3, outputs=2).run.segments[0]
    state = 0.0, first.coordinates[:, 0], first.speeds[:, 0]
    a, multipliers = module.accelerations(*state)
    mass, slopes = module.mass_matrix(*state[:2]), module.constraint_jacobian(*state[:2])
    missed = mass @ a + module.bias(*state) - slopes.T @ multipliers
    assert missed == pytest.approx(0.0, abs=1e-9 * np.max(np.abs(mass @ a)) + 1e-9)
    assert slopes @ a == pytest.approx(-module.constraint_bias(*state), abs=1e-9)
    assert np.all(np.abs(multipliers) < 1e4)
