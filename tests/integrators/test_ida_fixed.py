"""IDA with fixed pivots: the same answers as with any other linear solver, and a way out where pivots are no good."""

from collections.abc import Sequence
from ctypes import CFUNCTYPE, c_double, c_int, c_void_p
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from atwood.codegen.sundials.fixed_pivots import SLOTS, fixed_pivots_addresses
from atwood.integrators.ida import library as sundials_library, native as ida_native
from atwood.integrators.ida.callbacks import Record
from atwood.integrators.ida.library import library
from atwood.integrators.ida.linear_solvers import FixedSolver, table_layout
from atwood.integrators.protocol import ChoosePivots, ImplicitProblem, SolverOptions, Status, choose_linear_solver
from atwood.numerics.body_order import Stage
from atwood.numerics.fixed_pivots import FixedPivots, fix_pivots
from atwood_library import scenes

from ..helpers.runs import Prepared, packed, prepare

pytestmark = pytest.mark.skipif(not sundials_library.available(), reason=sundials_library.why_not() or "available")

SETUP = CFUNCTYPE(c_int, c_void_p, c_void_p)
SOLVE = CFUNCTYPE(c_int, c_void_p, c_void_p, c_void_p, c_void_p, c_double)
RNG = np.random.default_rng(11)


class Bench:
    """A fixed solver by itself, for full matrices of a size."""

    def __init__(self, choose: ChoosePivots, size: int) -> None:
        self.sundials, self.context, self.record = library(), c_void_p(), Record()
        self.sundials.SUNContext_Create(0, self.context)
        self.solver = FixedSolver(self.sundials, choose, self.context, self.record, np.ones(size))
        self.size = size

    def solve(self, matrix: Any, right: Any) -> Any:
        """Return the flag of the setup and the solution."""
        addresses, solver = fixed_pivots_addresses(), self.solver
        values = np.ascontiguousarray(matrix.T.ravel())  # by columns
        places = (c_double * len(values)).from_address(self.sundials.SUNDenseMatrix_Data(solver.matrix))
        places[:] = values.tolist()
        flag = SETUP(addresses["setup"])(solver.solver, solver.matrix)
        given, found = np.array(right, dtype=float), np.zeros(self.size)
        vectors = [self.sundials.N_VMake_Serial(self.size, one.ctypes.data, self.context) for one in (found, given)]
        if flag == 0:
            assert SOLVE(addresses["solve"])(solver.solver, solver.matrix, *vectors, 0.0) == 0
        for vector in vectors:
            self.sundials.N_VDestroy(vector)
        return flag, found


def full_pattern(size: int) -> tuple[Any, Any]:
    columns, rows = np.divmod(np.arange(size * size), size)
    return rows, columns


def bench(size: int, mends: bool = True) -> Bench:
    """Return a solver whose pivots are on the diagonal unless the numbers of a matrix are asked."""
    equations = np.arange(size)

    def choose(samples: Sequence[Any]) -> FixedPivots | None:
        if samples and not mends:
            return None
        return fix_pivots(*full_pattern(size), equations, [Stage((i,), ()) for i in range(size)], samples)

    return Bench(choose, size)


def test_a_matrix_with_good_pivots_is_solved_without_help():
    made = bench(7)
    for _ in range(3):
        matrix = RNG.normal(size=(7, 7)) + 10.0 * np.eye(7)
        right = RNG.normal(size=7)
        flag, found = made.solve(matrix, right)
        assert flag == 0
        assert_allclose(matrix @ found, right, atol=1e-13)
    assert made.solver.fallbacks == 0


@pytest.mark.parametrize("mends", [True, False])
@pytest.mark.parametrize("small", [0.0, 1e-300, 1e-20, 1e-12])
def test_a_pivot_that_is_too_small_is_noticed_whoever_helps(small: float, mends: bool) -> None:
    made = bench(4, mends)
    matrix = np.array([[small, 1.0, 0.3, 0.1], [1.0, 1.0, 0.2, 0.5], [0.4, 0.1, 2.0, 0.3], [0.2, 0.6, 0.1, 3.0]])
    right = np.array([1.0, 2.0, 3.0, 4.0])
    for times in (1, 2):
        flag, found = made.solve(matrix, right)
        assert flag == 0
        assert_allclose(found, np.linalg.solve(matrix, right), rtol=1e-13)
        assert made.solver.fallbacks == (1 if mends else times)
    good = matrix + 5.0 * np.eye(4)
    assert_allclose(made.solve(good, right)[1], np.linalg.solve(good, right), rtol=1e-13)


def test_growth_on_the_way_is_noticed_too():
    # Each pivot is of size 1, but the last column doubles from row to row (Higham, Accuracy and Stability, 9.3).
    size = 60
    made = bench(size, mends=False)
    matrix = np.eye(size) - 1.5 * np.tril(np.ones((size, size)), -1)
    matrix[:, -1] = 1.0
    right = RNG.normal(size=size)
    _, found = made.solve(matrix, right)
    assert made.solver.fallbacks == 1
    assert_allclose(matrix @ found, right, atol=1e-9 * np.max(np.abs(matrix) @ np.abs(found)))


@pytest.mark.parametrize("bad", ["singular", "nan", "inf"])
def test_what_cannot_be_solved_asks_for_a_smaller_step(bad: str) -> None:
    made = bench(3)
    matrix = np.ones((3, 3))
    if bad != "singular":
        matrix = np.eye(3)
        matrix[1, 1] = float(bad)
    flag, _ = made.solve(matrix, np.ones(3))
    assert flag > 0
    assert made.record.error is None
    flag, found = made.solve(2.0 * np.eye(3), np.ones(3))
    assert flag == 0
    assert_allclose(found, 0.5)


def test_an_error_in_python_ends_the_run_and_is_raised_again():
    def choose(samples: Sequence[Any]) -> FixedPivots | None:
        if samples:
            raise KeyboardInterrupt
        return fix_pivots(*full_pattern(2), np.arange(2), [Stage((0, 1), ())])

    made = Bench(choose, 2)
    flag, _ = made.solve(np.array([[0.0, 1.0], [1.0, 0.0]]), np.ones(2))
    assert flag < 0
    assert isinstance(made.record.error, KeyboardInterrupt)


def test_pivots_stay_good_for_all_matrices_that_have_been_met():
    made = bench(2)
    first, second = np.array([[0.0, 1.0], [1.0, 0.5]]), np.array([[1.0, 0.5], [0.5, 1.0]])
    for matrix in (first, second, first, second):
        assert_allclose(made.solve(matrix, np.ones(2))[1], np.linalg.solve(matrix, np.ones(2)))
    assert made.solver.fallbacks == 1


def test_sundials_table_is_found():
    layout = table_layout(library())
    assert len(set(layout.slots.values())) == 3
    assert library().has_fixed_solvers
    assert len(set(SLOTS)) == len(SLOTS)


def of_scene(name: str, level: str = "ggl") -> tuple[Prepared, Any, Any, ImplicitProblem]:
    prepared = prepare(getattr(scenes, name)(), "dae", level)
    y, yp = packed(prepared, prepared.q, prepared.u)
    return prepared, y, yp, prepared.plan.problem()


@pytest.mark.sample(6)
@pytest.mark.parametrize("level", ["ggl", "index1"])
@pytest.mark.parametrize(
    "name",
    [
        "Chain",
        "FourBar",
        "SliderCrank",
        "HeavyTop",
        "Strandbeest",
        "SwingingAtwood",
        "FurutaPendulum",
        "UniversalShaft",
    ],
)
def test_runs_end_where_they_do_with_a_dense_matrix(name: str, level: str) -> None:
    prepared, y, yp, problem = of_scene(name, level)
    options = SolverOptions(1e-8, prepared.plan.tolerances(1e-8, {}))
    ends, sizes = [], slice(len(prepared.q))
    for linear_solver in ("fixed", "dense"):
        for functions in (problem, replace(problem, native=None)) if linear_solver == "fixed" else (problem,):
            with ida_native.open_session(
                functions, replace(options, linear_solver=linear_solver), 0.0, y, yp
            ) as session:
                end = session.advance(0.05)
                assert end.status is Status.REACHED
                ends.append(end.y[sizes])
    for end in ends[:-1]:
        assert_allclose(end, ends[-1], atol=1e-6 * max(1.0, float(np.max(np.abs(ends[-1])))))


def test_pivots_that_a_scene_needs_are_found_once_and_again_alike():
    # The rope's end and the pulley's have no mass of their own, which the pattern does not tell.
    prepared, y, yp, problem = of_scene("SwingingAtwood")
    options = SolverOptions(1e-6, prepared.plan.tolerances(1e-6, {}), linear_solver="fixed")
    ends = []
    for _ in range(2):
        with ida_native.open_session(problem, options, 0.0, y, yp) as session:
            ends.append(session.advance(1.0).y)
            fixed = session._memory._parts.fixed
            assert fixed is not None
            assert fixed.fallbacks == 1
    assert np.array_equal(*ends)


def test_what_is_small_or_full_stays_dense():
    for name, expected in (("SimplePendulum", "dense"), ("Chain", "fixed"), ("FourBar", "fixed")):
        *_, problem = of_scene(name)
        assert choose_linear_solver(problem, SolverOptions(), has_fixed=True) == expected
        assert choose_linear_solver(problem, SolverOptions()) == "dense"
        assert choose_linear_solver(problem, SolverOptions(linear_solver="sparse"), has_fixed=True) == "sparse"
