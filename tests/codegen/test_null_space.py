"""The compiled rows of mechanisms with loops against the plain ones, for one choice of coordinates after another."""

from __future__ import annotations

from ctypes import byref, c_double, c_void_p
from itertools import combinations

import numpy as np
import pytest

from atwood.codegen.sundials.null_space import NullSpaceShape, compile_null_space_callbacks
from atwood.errors import KernelEvaluationError, UsageError
from atwood.forms.residuals import null_space_program
from atwood.integrators.ida import library as sundials_library
from atwood.integrators.ida.callbacks import JACOBIAN, RESIDUAL, WEIGHTS
from atwood.simulation.dynamics.redundancy import POOR, choose_dependent_coordinates
from atwood.simulation.problem.implicit_scene import choice_lists, null_space_shape
from atwood_library.scenes import FourBar, SliderCrank

from ..helpers.mechanisms import double_four_bar, two_four_bars
from ..helpers.runs import prepare

needs_sundials = pytest.mark.skipif(not sundials_library.available(), reason="the SUNDIALS libraries are not here")
SCENES = {
    "four-bar": FourBar,
    "slider-crank": SliderCrank,
    "double four-bar": double_four_bar,
    "two four-bars": two_four_bars,
}


def made_of(assembly):
    return null_space_program("loops", assembly.own_equations, assembly.parameters, assembly.rows)


def compiled_of(program, sparse=False):
    return compile_null_space_callbacks(
        program.stack,
        program.derivatives,
        (program.jacobian_rows, program.jacobian_columns),
        (program.rows, program.columns),
        null_space_shape(program),
        sparse=sparse,
        cache=False,
    )


@pytest.fixture
def sundials():
    library = sundials_library.library()
    context = c_void_p()
    assert library.SUNContext_Create(0, byref(context)) == 0
    yield library, context
    library.SUNContext_Free(byref(context))


class Caller:
    """Calls compiled functions as IDA does."""

    def __init__(self, sundials, compiled, data, size, sparse):
        self.library, self.context = sundials
        self.size, self.sparse, self.compiled, self.data = size, sparse, compiled, data
        self.arrays = np.zeros((3, size))
        self.vectors = [self.library.N_VMake_Serial(size, row.ctypes.data, self.context) for row in self.arrays]
        if sparse:
            self.matrix = self.library.SUNSparseMatrix(size, size, size * size, 0, self.context)
        else:
            self.matrix = self.library.SUNDenseMatrix(size, size, self.context)

    def residual(self, t, y, yp):
        self.arrays[0], self.arrays[1] = y, yp
        code = RESIDUAL(self.compiled.residual_address)(t, *self.vectors, self.data.address)
        return code, self.arrays[2].copy()

    def jacobian(self, t, y, yp, cj):
        self.arrays[0], self.arrays[1] = y, yp
        self.library.SUNMatZero(self.matrix)
        call = JACOBIAN(self.compiled.jacobian_address)
        code = call(t, cj, *self.vectors, self.matrix, self.data.address, None, None, None)
        if not self.sparse:
            entries = self._read(self.library.SUNDenseMatrix_Data, c_double, self.size**2)
            return code, entries.reshape(self.size, self.size).T
        numbers = self._read(self.library.SUNSparseMatrix_Data, c_double, self.size**2)
        rows = self._read(self.library.SUNSparseMatrix_IndexValues, self.library.index_type, self.size**2)
        starts = self._read(self.library.SUNSparseMatrix_IndexPointers, self.library.index_type, self.size + 1)
        found = np.full((self.size, self.size), np.nan)
        for column in range(self.size):
            inside = slice(starts[column], starts[column + 1])
            found[rows[inside], column] = numbers[inside]
        return code, found

    def _read(self, place, kind, count):
        return np.array((kind * count).from_address(place(self.matrix)))

    def weights(self, y):
        self.arrays[0] = y
        code = WEIGHTS(self.compiled.weights_address)(*self.vectors[:2], self.data.address)
        return code, self.arrays[1].copy()

    def free(self):
        self.library.SUNMatDestroy(self.matrix)
        for vector in self.vectors:
            self.library.N_VDestroy(vector)


def good_choices(slope, sizes):
    """Return the choices of dependent coordinates for which the constraints can be solved, the best first."""
    found = []
    for dependent in combinations(range(slope.shape[1]), slope.shape[0]):
        size = np.min(np.linalg.svd(slope[:, dependent] * sizes[list(dependent)], compute_uv=False))
        if size > 0.05:
            found.append((size, dependent))
    return [dependent for _, dependent in sorted(found, reverse=True)]


@needs_sundials
@pytest.mark.parametrize("sparse", [False, True])
@pytest.mark.parametrize("name", SCENES)
def test_one_kernel_gives_the_rows_of_every_choice(sundials, name, sparse):
    prepared = prepare(SCENES[name](), "reduced")
    assembly, plan = prepared.assembly, prepared.plan
    program = made_of(assembly)
    compiled = compiled_of(program, sparse)
    n = program.coordinates
    random = np.random.default_rng(5)
    y = np.concatenate([prepared.q, prepared.u]) + 0.1 * random.standard_normal(2 * n)
    yp = random.standard_normal(2 * n)
    slope = plan.balance.at(0.3, y[:n], y[n:]).jacobian
    choices = good_choices(slope, plan.sizes)[:6]
    assert len(choices) >= 2
    data = compiled.bind(assembly.parameter_values, choice_lists(program, choices[0]), plan.sizes, POOR)
    caller = Caller(sundials, compiled, data, 2 * n, sparse)
    for dependent in choices:
        data.choice[:] = choice_lists(program, dependent)
        form = assembly.form_program(None, dependent)
        expected = assembly.kernel(form.residual)([0.3], y, yp)[0]
        code, found = caller.residual(0.3, y, yp)
        assert code == 0
        np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-11 * np.max(np.abs(expected)))
        whole = np.zeros((2 * n, 2 * n))
        whole[form.rows, form.columns] = assembly.kernel(form.jacobian)([0.3], y, yp, [7.0])[0]
        code, matrix = caller.jacobian(0.3, y, yp, 7.0)
        assert code == 0
        np.testing.assert_allclose(matrix, whole, rtol=0.0, atol=1e-10 * np.max(np.abs(whole)))
        assert data.rate == 7.0
    caller.free()


@needs_sundials
def test_a_poor_choice_asks_for_attention_once(sundials):
    prepared = prepare(FourBar(), "reduced")
    plan, program = prepared.plan, made_of(prepared.assembly)
    compiled = compiled_of(program)
    y = np.concatenate([prepared.q, prepared.u])
    slope = plan.balance.at(0.0, prepared.q, prepared.u).jacobian
    n = program.coordinates
    best = choose_dependent_coordinates(slope, plan.sizes)
    data = compiled.bind(prepared.assembly.parameter_values, choice_lists(program, best), plan.sizes, POOR)
    data.set_weights(np.full(2 * n, 1e-3), np.full(2 * n, 1e-6))
    caller = Caller(sundials, compiled, data, 2 * n, False)
    assert caller.jacobian(0.0, y, np.zeros(2 * n), 1.0)[0] == 0
    code, weights = caller.weights(y)
    assert code == 0
    np.testing.assert_allclose(weights, 1.0 / (1e-3 * np.abs(y) + 1e-6), rtol=1e-15)
    assert not data.take_attention()
    largest = {
        dependent: np.max(
            np.abs(np.linalg.solve(slope[:, dependent], slope[:, [i for i in range(n) if i not in dependent]]))
        )
        for dependent in combinations(range(n), len(slope))
    }
    for dependent, size in largest.items():
        data.choice[:] = choice_lists(program, dependent)
        caller.jacobian(0.0, y, np.zeros(2 * n), 1.0)
        asks = caller.weights(y)[0] == -1
        assert asks == (size > POOR)
        assert data.take_attention() == asks
        assert caller.weights(y)[0] == 0
    assert {size > POOR for size in largest.values()} == {True, False} or max(largest.values()) < POOR
    data.set_weights(np.zeros(2 * n), np.zeros(2 * n))
    assert caller.weights(y)[0] == -1
    caller.free()


@needs_sundials
def test_what_is_not_finite_is_recoverable(sundials):
    prepared = prepare(FourBar(), "reduced")
    plan, program = prepared.plan, made_of(prepared.assembly)
    compiled = compiled_of(program)
    n = program.coordinates
    values = prepared.assembly.parameter_values
    data = compiled.bind(values, choice_lists(program, plan.dependent), plan.sizes, POOR)
    caller = Caller(sundials, compiled, data, 2 * n, False)
    y, yp = np.concatenate([prepared.q, prepared.u]), np.zeros(2 * n)
    for broken in (np.nan, np.inf):
        for at in (0, n):
            wrong = y.copy()
            wrong[at] = broken
            assert caller.residual(0.0, wrong, yp)[0] == 1
            assert caller.jacobian(0.0, wrong, yp, 1.0)[0] == 1
    assert caller.residual(0.0, y, yp)[0] == 0
    # all angles alike: the constraints cannot be solved for any choice
    y[:n] = 0.5
    assert caller.residual(0.0, y, yp)[0] == 1 or np.max(np.abs(caller.residual(0.0, y, yp)[1])) > 1e8
    caller.free()


def test_wrong_sizes_are_refused():
    prepared = prepare(FourBar(), "reduced")
    program = made_of(prepared.assembly)
    compiled = compiled_of(program)
    lists = choice_lists(program, prepared.plan.dependent)
    values, sizes = prepared.assembly.parameter_values, prepared.plan.sizes
    with pytest.raises(KernelEvaluationError, match="parameter values"):
        compiled.bind(values[:-1], lists, sizes, POOR)
    with pytest.raises(UsageError, match="another length"):
        compiled.bind(values, lists[:-1], sizes, POOR)
    with pytest.raises(UsageError, match="input groups"):
        compile_null_space_callbacks(
            program.stack,
            program.stack,
            (program.jacobian_rows, program.jacobian_columns),
            (program.rows, program.columns),
            null_space_shape(program),
        )


def test_counts_of_coordinates_and_speeds_are_apart():
    shape = NullSpaceShape(coordinates=7, speeds=6, values=3, rates=2)
    assert (shape.size, shape.stack, shape.free) == (13, 18, 4)
    assert shape.choice["end"] == 13 + 4 + 4 + 2 + 2 + 3 + 1
    assert shape.work["jacobian"] == 18
