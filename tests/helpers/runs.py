"""What the tests of scenes, forms and mechanics do again and again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood import Model, Result, Scene
from atwood.arrays import FloatArray
from atwood.codegen import BoundKernel
from atwood.expr import Program
from atwood.forms.assembly import Assembly
from atwood.forms.quantities import to_maximal
from atwood.pipeline import assemble, simulate
from atwood.simulation.initialization.start import Start, find_start
from atwood.simulation.problem.preparation import make_problem, pack_state
from atwood.simulation.problem.problem import SceneProblem

FORMS = ("reduced", "dae")

EVERYDAY = (
    *("simple-pendulum", "double-pendulum", "pendulum-on-cart", "mass-spring-chain", "atwood", "double-atwood"),
    *("four-bar", "slider-crank", "chain", "driven-pendulum"),
)
"""Scenes on a line and in a plane to which every general test is put; the others have tests of their own."""

GENERAL = (
    *EVERYDAY,
    *(
        "bricard",
        "double-pendulum-3d",
        "flyball-governor",
        "foucault-pendulum",
        "four-bar-row",
        "free-body",
        "gyroscope",
    ),
    *("heavy-top", "intermediate-axis", "lagrange-top", "rolling-ball", "rolling-disc", "spatial-slider-crank"),
    *("spherical-pendulum", "stewart-platform", "universal-shaft"),
)
"""Scenes with every kind of motion, to which tests of the engine are put; the others have tests of their own."""

EVERY_FORM = (("reduced", "ggl"), ("dae", "ggl"), ("dae", "index1"), ("dae", "index1-projected"))


def run_both(make: Callable[[], Model], **options: Any) -> tuple[Result, Result]:
    """Return the results of a scene in the reduced form and in the dae form."""
    return simulate(make(), form="reduced", **options), simulate(make(), form="dae", **options)


def apart(a: Mapping[str, FloatArray], b: Mapping[str, FloatArray]) -> dict[str, float]:
    """Return how far two tables of quantities are apart, relative to the size of each quantity but at least to 1.

    Quantities that are not known (nan) in both are not apart.
    """
    return {
        path: 0.0
        if np.all(np.isnan(values)) and np.all(np.isnan(b[path]))
        else float(np.max(np.abs(values - b[path]))) / max(1.0, float(np.max(np.abs(values))))
        for path, values in a.items()
    }


def assert_agree(a: Result, b: Result, tolerance: float) -> None:
    """Check that two results hold the same paths, and at all of them the same values."""
    assert set(a.paths) == set(b.paths)
    assert np.allclose(a.time, b.time, rtol=1e-9, atol=1e-9)
    gaps = apart(a.table(), b.table())
    worst = max(gaps, key=lambda path: np.nan_to_num(gaps[path], nan=np.inf))
    assert gaps[worst] <= tolerance, worst


def free_scene(**settings: Any) -> Scene:
    """Return an empty scene without gravity."""
    return Scene(gravity=0.0, **settings)


@dataclass(frozen=True)
class Prepared:
    """A scene in one form with its start and its plan."""

    assembly: Assembly
    start: Start
    plan: SceneProblem
    q: FloatArray
    u: FloatArray

    @property
    def time(self) -> float:
        return self.start.time

    def bound(self, program: Program) -> BoundKernel:
        """Return a program of the form with its parameters."""
        return self.assembly.compiled(program).bind(self.plan.values)


def prepare(scene: Model, form: str, level: str = "ggl") -> Prepared:
    """Assemble a scene and find its start, as a run does."""
    assembly = assemble(scene, form=form, level=level)
    start = find_start(assembly)
    q, u = start.coordinates, start.speeds
    if form == "dae":
        q, u = (np.asarray(x, dtype=float) for x in assembly.kernel(to_maximal(assembly))([start.time], q, u))
    plan = make_problem(assembly, start.time, q, u, start.length, assembly.flat.t_end - start.time)
    return Prepared(assembly, start, plan, q, u)


def nearby_states(prepared: Prepared, count: int, size: float = 0.3) -> list[tuple[FloatArray, FloatArray]]:
    """Return admissible states around the start: random ones, projected onto the constraints."""
    random = np.random.default_rng(4711)
    plan, found = prepared.plan, []
    for _ in range(count):
        step = size * plan.sizes * random.uniform(-1.0, 1.0, len(prepared.u))
        q = plan.balance.kinematic_map.moved(prepared.time, prepared.q, step)
        u = prepared.u + plan.sizes * random.uniform(-1.0, 1.0, len(prepared.u))
        found.append(plan.balance.project(prepared.time, q, u, plan.sizes))
    return found


def moved(prepared: Prepared, q: FloatArray, u: FloatArray, a: FloatArray, h: float, t: float = 0.0) -> FloatArray:
    """Return where coordinates are a time later, at speeds that change by given accelerations: one step of order 4."""
    rates = prepared.plan.balance.kinematic_map.rates
    k1 = rates(t, q, u)
    k2 = rates(t, q + 0.5 * h * k1, u + 0.5 * h * a)
    k3 = rates(t, q + 0.5 * h * k2, u + 0.5 * h * a)
    k4 = rates(t, q + h * k3, u + h * a)
    found: FloatArray = q + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return found


def packed(prepared: Prepared, q: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the solver's vectors at an admissible state."""
    return pack_state(prepared.plan, prepared.time, q, u)


def dense(rows: NDArray[np.intp], columns: NDArray[np.intp], entries: Any, shape: tuple[int, int]) -> FloatArray:
    """Return a matrix from its entries."""
    matrix = np.zeros(shape)
    matrix[rows, columns] = entries
    return matrix


def difference_quotient(function: Callable[[FloatArray], Any], at: FloatArray, step: float = 1e-5) -> FloatArray:
    """Return the derivatives of a function by central differences of fourth order."""
    columns = []
    for i in range(len(at)):
        e = np.zeros(len(at))
        e[i] = step
        near = np.asarray(function(at + e)) - np.asarray(function(at - e))
        far = np.asarray(function(at + 2 * e)) - np.asarray(function(at - 2 * e))
        columns.append((8.0 * near - far) / (12.0 * step))
    return np.array(columns).T
