import ctypes
from ctypes import byref, c_double, c_int, c_int32, c_void_p
from functools import partial

import numpy as np
import pytest

from atwood import expr as ex
from atwood.codegen import compile_ida_callbacks, compile_native
from atwood.codegen.sundials.layout import SundialsLayout, layout_for, sundials_layout
from atwood.errors import KernelEvaluationError, UsageError
from atwood.integrators.ida import library as sundials_library, native as ida_native
from atwood.integrators.ida.callbacks import JACOBIAN, RESIDUAL, WEIGHTS
from atwood.integrators.protocol import ImplicitProblem, NativeCallbacks, SolverOptions
from atwood.pipeline import assemble
from atwood_library.scenes import Chain, DoublePendulum, SimplePendulum

needs_sundials = pytest.mark.skipif(not sundials_library.available(), reason="the SUNDIALS libraries are not here")
compile_ida = partial(compile_ida_callbacks, cache=False)


def made_of(scene, form="reduced"):
    assembly = assemble(scene, form=form)
    program, values = assembly.form_program(None, ()), assembly.parameter_values
    return program, np.append(values, [1.0] * (len(program.residual.parameters) - len(values)))


def callbacks_of(program, sparse=False, step=1):
    [entries] = program.jacobian.outputs
    outputs = (ex.OutputGroup("entries", entries.expressions[::step]),)
    jacobian = ex.Program("Jacobian", program.jacobian.inputs, program.jacobian.parameters, outputs)
    return compile_ida(program.residual, jacobian, program.rows[::step], program.columns[::step], program.size, sparse)


@pytest.fixture
def sundials():
    library = sundials_library.library()
    context = c_void_p()
    assert library.SUNContext_Create(0, byref(context)) == 0
    yield library, context
    library.SUNContext_Free(byref(context))


def vectors_of(sundials, *arrays):
    library, context = sundials
    return [library.N_VMake_Serial(len(array), array.ctypes.data, context) for array in arrays]


def at(address, kind, count):
    return np.ctypeslib.as_array((kind * count).from_address(address))


@needs_sundials
@pytest.mark.parametrize("form", ["reduced", "dae"])
@pytest.mark.parametrize("scene", [DoublePendulum(), Chain(links=10)], ids=["double", "chain"])
def test_values_in_sundials_own_structures(sundials, scene, form):
    library, context = sundials
    program, parameters = made_of(scene, form)
    size, entries = program.size, len(program.rows)
    rng = np.random.default_rng(2)
    y, yp, out = rng.uniform(0.2, 1.0, size), rng.uniform(0.2, 1.0, size), np.empty(size)
    vectors = vectors_of(sundials, y, yp, out)
    [residual] = compile_native(program.residual, cache=False).bind(parameters)([0.3], y, yp)
    [values] = compile_native(program.jacobian, cache=False).bind(parameters)([0.3], y, yp, [7.0])
    expected = np.zeros((size, size))
    expected[program.rows, program.columns] = values

    for sparse, step in ((False, 1), (True, 1), (False, -1), (True, -1)):
        compiled = callbacks_of(program, sparse, step)
        data = compiled.bind(parameters)
        assert RESIDUAL(compiled.residual_address)(0.3, *vectors, data.address) == 0
        np.testing.assert_array_equal(out, residual)
        jacobian = JACOBIAN(compiled.jacobian_address)
        index = library.index_type
        if sparse:
            matrix = library.SUNSparseMatrix(size, size, entries, 0, context)
        else:
            matrix = library.SUNDenseMatrix(size, size, context)
        assert jacobian(0.3, 7.0, *vectors, matrix, data.address, None, None, None) == 0
        if sparse:
            found = np.zeros((size, size))
            starts = at(library.SUNSparseMatrix_IndexPointers(matrix), index, size + 1)
            rows = at(library.SUNSparseMatrix_IndexValues(matrix), index, entries)
            numbers = at(library.SUNSparseMatrix_Data(matrix), c_double, entries)
            assert starts[-1] == entries
            for column in range(size):
                inside = slice(starts[column], starts[column + 1])
                assert np.all(np.diff(rows[inside]) > 0)
                found[rows[inside], column] = numbers[inside]
        else:
            found = at(library.SUNDenseMatrix_Data(matrix), c_double, size * size).reshape(size, size).T
        np.testing.assert_array_equal(found, expected)
        library.SUNMatDestroy(matrix)
    for vector in vectors:
        library.N_VDestroy(vector)


@needs_sundials
def test_a_sparse_matrix_without_room_is_refused(sundials):
    library, context = sundials
    program, parameters = made_of(DoublePendulum())
    compiled = callbacks_of(program, sparse=True)
    data = compiled.bind(parameters)
    vectors = vectors_of(sundials, *np.ones((3, program.size)))
    matrix = library.SUNSparseMatrix(program.size, program.size, len(program.rows) - 1, 0, context)
    call = JACOBIAN(compiled.jacobian_address)
    assert call(0.0, 1.0, *vectors, matrix, data.address, None, None, None) == -1


def problem_of(program, parameters, counted):
    residual = compile_native(program.residual, cache=False).bind(parameters)
    jacobian = compile_native(program.jacobian, cache=False).bind(parameters)

    def native(linear_solver):
        compiled = callbacks_of(program, linear_solver == "sparse")
        data = compiled.bind(parameters)
        counted.append(linear_solver)
        return NativeCallbacks(
            compiled.residual_address,
            compiled.jacobian_address,
            data.address,
            compiled.weights_address,
            data.set_weights,
            keep=(compiled, data),
        )

    return ImplicitProblem(
        program.size,
        lambda t, y, yp: residual([t], y, yp)[0],
        lambda t, y, yp, cj: jacobian([t], y, yp, [cj])[0],
        (program.rows, program.columns),
        native=native,
    )


def start_of(program, parameters, angle):
    """Return a state at rest with consistent accelerations."""
    y, yp = np.full(program.size, angle), np.zeros(program.size)
    y[program.coordinates :] = 0.0
    residual = compile_native(program.residual, cache=False).bind(parameters)
    jacobian = compile_native(program.jacobian, cache=False).bind(parameters)
    slopes = [np.zeros((program.size, program.size)) for _ in range(2)]
    for slope, cj in zip(slopes, (0.0, 1.0), strict=True):
        slope[program.rows, program.columns] = jacobian([0.0], y, yp, [cj])[0]
    yp -= np.linalg.solve(slopes[1] - slopes[0], residual([0.0], y, yp)[0])
    return y, yp


@needs_sundials
@pytest.mark.parametrize("linear_solver", ["dense", "sparse"])
def test_ida_runs_on_compiled_functions_and_gets_where_python_gets(linear_solver):
    program, parameters = made_of(DoublePendulum())
    counted = []
    problem = problem_of(program, parameters, counted)
    y, yp = start_of(program, parameters, 0.7)
    options = SolverOptions(relative_tolerance=1e-8, absolute_tolerances=1e-10, linear_solver=linear_solver)
    found = []
    for native in (problem.native, None):
        chosen = ImplicitProblem(problem.size, problem.residual, problem.jacobian, problem.pattern, native=native)
        session = ida_native.open_session(chosen, options, 0.0, y, yp)
        for time in np.linspace(0.1, 1.0, 10):
            step_result = session.advance(time)
        found.append(step_result.y)
    assert counted == [linear_solver]
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)


class _Content(ctypes.Structure):
    _fields_ = (("length", c_int32), ("own", c_int), ("data", c_void_p))


class _Generic(ctypes.Structure):
    _fields_ = (("content", c_void_p), ("ops", c_void_p), ("context", c_void_p))


def by_hand(array, kept):
    content = _Content(len(array), 0, array.ctypes.data)
    vector = _Generic(ctypes.addressof(content), None, None)
    kept += [content, vector]
    return ctypes.addressof(vector)


def demo():
    graph = ex.Graph()
    t, y, yp, cj = (graph.symbol(name) for name in ("t", "y", "yp", "cj"))
    p = graph.parameter("p")
    inputs = (ex.InputGroup("t", (t,)), ex.InputGroup("y", (y,)), ex.InputGroup("yp", (yp,)))
    residual = ex.Program("demo", inputs, (p,), (ex.OutputGroup("residual", (yp + ex.sqrt(y) * p - t,)),))
    rates = (*inputs, ex.InputGroup("cj", (cj,)))
    jacobian = ex.Program("slope", rates, (p,), (ex.OutputGroup("entries", (cj + p / (2 * ex.sqrt(y)),)),))
    return residual, jacobian


def test_a_value_that_is_not_finite_is_recoverable():
    compiled = compile_ida(*demo(), [0], [0], 1, layout=layout_for(4))
    data = compiled.bind([3.0])
    kept = []
    y, yp, out, matrix = np.array([4.0]), np.array([1.0]), np.zeros(1), np.zeros(1)
    dense = (ctypes.c_int64 * 2)(0, matrix.ctypes.data)  # M and N, then the data
    holder = _Generic(ctypes.addressof(dense), None, None)
    vectors = [by_hand(array, kept) for array in (y, yp, out)]
    residual, jacobian = RESIDUAL(compiled.residual_address), JACOBIAN(compiled.jacobian_address)
    rest = (ctypes.addressof(holder), data.address, None, None, None)
    assert residual(0.5, *vectors, data.address) == 0
    assert out[0] == 6.5
    assert jacobian(0.5, 2.0, *vectors, *rest) == 0
    assert matrix[0] == 2.75
    y[0] = -1.0
    assert residual(0.5, *vectors, data.address) == 1
    assert jacobian(0.5, 2.0, *vectors, *rest) == 1


def test_error_weights():
    compiled = compile_ida(*demo(), [0], [0], 1, layout=layout_for(4))
    data = compiled.bind([3.0])
    kept = []
    y, weights = np.array([-4.0]), np.zeros(1)
    call = WEIGHTS(compiled.weights_address)
    vectors = by_hand(y, kept), by_hand(weights, kept)
    data.set_weights(0.5, 2.0)
    assert call(*vectors, data.address) == 0
    assert weights[0] == 0.25
    data.set_weights([1.0], [0.0])
    y[0] = 0.0
    assert call(*vectors, data.address) == -1


def test_what_does_not_fit_is_explained():
    residual, jacobian = demo()
    for arguments in (
        (jacobian, jacobian, [0], [0], 1),
        (residual, residual, [0], [0], 1),
        (residual, jacobian, [0, 0], [0, 0], 1),
        (residual, jacobian, [0], [0], 2),
        (residual, jacobian, [1], [0], 1),
        (residual, jacobian, [0], [-1], 1),
    ):
        with pytest.raises(UsageError):
            compile_ida(*arguments)
    with pytest.raises(KernelEvaluationError, match="needs 1 parameter values"):
        compile_ida(residual, jacobian, [0], [0], 1).bind([1.0, 2.0])


def test_the_cache_tells_dense_from_sparse_and_one_pattern_from_another(tmp_path, monkeypatch):
    monkeypatch.setenv("ATWOOD_CACHE_DIR", str(tmp_path))
    monkeypatch.delenv("ATWOOD_CACHE", raising=False)
    program, _ = made_of(SimplePendulum())
    for reused in (False, True):
        made = [
            compile_ida_callbacks(
                program.residual, program.jacobian, program.rows[::step], program.columns[::step], program.size, sparse
            )
            for step in (1, -1)
            for sparse in (False, True)
        ]
        assert [one.from_cache for one in made] == [reused] * 4


def test_layouts_by_the_rules_of_c():
    assert layout_for(4) == SundialsLayout(4, 8, 8, 16, 8, 32, 40)
    assert layout_for(8) == SundialsLayout(8, 16, 16, 32, 16, 48, 56)


@needs_sundials
def test_the_index_width_is_that_of_the_library():
    assert sundials_layout().index_bytes == ctypes.sizeof(sundials_library.library().index_type)
