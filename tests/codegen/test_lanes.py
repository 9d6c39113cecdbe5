"""Programs that compute several runs side by side: each lane has the bits of the program for one run."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

from atwood import expr as ex
from atwood.arrays import FloatArray
from atwood.codegen.llvm.build import build_code
from atwood.codegen.llvm.module import CodeOptions, Part
from atwood.codegen.llvm.text import OWN_FUNCTIONS, has_code
from atwood.errors import UnsupportedError
from atwood.expr.core.program import Program

from .test_llvm_backend import _OPERATIONS

_CALL = ctypes.CFUNCTYPE(ctypes.c_int, *[ctypes.c_void_p] * 4)
_PROLOGUE = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 3)


def program() -> Program:
    """Return a program with every operation that has code in lanes, of one parameter and one group of inputs."""
    graph = ex.Graph()
    a, b, p = (graph.symbol(name) for name in ("a", "b", "p"))
    results = [one(a * p, b + ex.sin(p)) for one in _OPERATIONS[:-1]]
    results += [ex.select((a < b) & ~(a < 0), a, ex.floor(b)), -a, ex.log(a), ex.cos(a * 1e9)]
    return Program("all", (ex.InputGroup("x", (a, b)),), (p,), (ex.OutputGroup("y", tuple(results)),))


def values(
    made: Program, runs: int, x: FloatArray, p: FloatArray, chunk: int, least_in_loops: int = 1_500
) -> tuple[FloatArray, list[bool]]:
    """Return results of as many runs, one row each, and which are not finite; arrays hold one number of each run."""
    built = build_code([Part("one", made)], CodeOptions(chunk, least_in_loops, runs=runs))
    x, p = np.ascontiguousarray(x.T), np.ascontiguousarray(p)
    y = np.empty((len(made.outputs[0].expressions), runs))
    derived, scratch = np.empty(len(made.prologue) * runs), np.empty(built.scratch)
    inputs, outputs = (np.array([one.ctypes.data], dtype=np.int64) for one in (x, y))
    places = [one.ctypes.data for one in (inputs, derived, scratch, outputs)]
    _PROLOGUE(built.code.addresses["one_prologue"])(p.ctypes.data, *places[1:3])
    code = _CALL(built.code.addresses["one"])(*places)
    return y.T.copy(), [bool(code >> k & 1) for k in range(runs)]


@pytest.mark.parametrize("runs", [2, 4, 8])
@pytest.mark.parametrize("chunk", [20, 1000])
def test_each_lane_has_the_bits_of_a_run_alone(runs: int, chunk: int) -> None:
    made = program()
    assert {node.operation for node in made.nodes} >= {*OWN_FUNCTIONS, "solve", "select", "sign", "minimum", "floor"}
    rng = np.random.default_rng(runs)
    x, p = rng.uniform(-2.0, 2.0, (runs, 2)), rng.uniform(0.5, 2.0, runs)
    x[0, 0] = -1.0  # a logarithm without a value, in one lane
    x[1:, 0] = np.abs(x[1:, 0])
    wide, undefined = values(made, runs, x, p, chunk)
    for k in range(runs):
        alone, (is_undefined,) = values(made, 1, x[k : k + 1], p[k : k + 1], chunk)
        assert wide[k].tobytes() == alone.tobytes()
        assert undefined[k] == is_undefined == (k == 0)


@pytest.mark.parametrize("operation", _OPERATIONS[-1:])
def test_what_has_no_code_in_lanes_is_said(operation: object) -> None:
    graph = ex.Graph()
    a, b = graph.symbol("a"), graph.symbol("b")
    made = Program("few", (ex.InputGroup("x", (a, b)),), (), (ex.OutputGroup("y", (operation(a, b),)),))  # type: ignore[operator]
    assert all(has_code(node.operation) for node in made.nodes)
    with pytest.raises(UnsupportedError, match="no machine code in lanes"):
        build_code([Part("one", made)], CodeOptions(runs=4))
