"""Kernels in plain Python and NumPy: the reference for machine code, and what runs where there is none."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property, lru_cache
from types import CodeType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from atwood.clock import check_time
from atwood.codegen.python.source import Flavour, write_function
from atwood.codegen.python.walk import LONG, LONG_WALKS, WALKS, operations_of, walk
from atwood.errors import KernelEvaluationError
from atwood.expr.core import elementary
from atwood.expr.core.analysis import evaluate, live
from atwood.expr.core.graph import Expression
from atwood.expr.core.operations import BINARY, UNARY, ExternalFunction, solve_floats, solve_or_nan
from atwood.expr.core.program import Program
from atwood.lazy_dataclasses import dataclass
from atwood.stages import stage

_LARGEST_PLAIN_SOLVE = 3


def compile_program(program: Program, *, vectorized: bool = False) -> CompiledProgram:
    """Turn a program into Python code.

    Parameters
    ----------
    program
        What to compute.
    vectorized
        Whether to compute many samples at once, with arrays of shape ``(size, samples)``.

    Returns
    -------
    CompiledProgram
        Call its ``bind`` with the parameter values to get a function.
    """
    return CompiledProgram(program, vectorized)


@dataclass(frozen=True)
class CompiledProgram:
    """A program as Python code, for any parameter values.

    Attributes
    ----------
    program
        What it computes.
    vectorized
        Whether it works on arrays of samples.
    """

    program: Program
    vectorized: bool = False

    def bind(self, parameter_values: ArrayLike) -> BoundKernel:
        """Compute once what depends on parameters alone.

        Parameters
        ----------
        parameter_values
            The values in the order of ``program.parameters``; for a vectorized program, rows of samples are
            possible as well.

        Raises
        ------
        KernelEvaluationError
            If the number of values is wrong.
        """
        values = np.asarray(parameter_values, dtype=float)
        count = len(self.program.parameters)
        if values.ndim == 0 or values.shape[0] != count or (values.ndim > 1 and not self.vectorized):
            raise KernelEvaluationError(
                f"needs {count} parameter values but got an array of shape {values.shape}", where=self.program.name
            )
        if self.vectorized:
            with np.errstate(all="ignore"):
                return BoundKernel(self, values, self._known(list(values)))
        return BoundKernel(self, values, self._known(values.tolist()))

    @cached_property
    def source(self) -> str:
        """The generated code of the main function."""
        return self._written("vectorized" if self.vectorized else "fast")[0]

    @cached_property
    def main(self) -> Callable[..., tuple[list[Any], ...]]:
        """The function of the prologue values and the input groups."""
        return self._function("vectorized" if self.vectorized else "fast")

    def run(self, known: Sequence[Any], *groups: Any) -> tuple[list[Any], ...]:
        """Return what `main` does of the prologue values and the input groups."""
        program = self.program
        if self._is_compiled("main"):
            return self.main(known, *groups)
        given = [program.prologue, *(group.symbols for group in program.inputs)]
        values: dict[int, Any] = {}
        for symbols, several in zip(given, (known, *groups), strict=True):
            values.update(zip((one.index for one in symbols), several, strict=True))
        walk(self._between, values, _OPERATIONS["vectorized" if self.vectorized else "fast"])
        return tuple([values[one.index] for one in group.expressions] for group in program.outputs)

    def _known(self, parameters: Sequence[Any]) -> list[Any]:
        """Return the prologue values."""
        program = self.program
        if self._is_compiled("_prologue"):
            return list(self._prologue(parameters)[0])
        values = {one.index: value for one, value in zip(program.parameters, parameters, strict=True)}
        walk(self.program.once, values, _OPERATIONS["vectorized" if self.vectorized else "careful"])
        return [values[one.index] for one in program.prologue]

    def _is_compiled(self, name: str) -> bool:
        """Return whether a function is compiled, or is to be: it has run a few times, or calls what walks would not."""
        return name in vars(self) or self.program.calls_python or next(self._walks[name], None) is None

    @cached_property
    def _walks(self) -> dict[str, Iterator[int]]:
        return self._patience()

    def _patience(self) -> dict[str, Iterator[int]]:
        """Return what counts how often functions are walked through before they are compiled."""
        count = WALKS if self.program.size < LONG else LONG_WALKS
        return {"main": iter(range(count)), "_prologue": iter(range(count))}

    @cached_property
    def _between(self) -> list[Expression]:
        """What is computed in every call, arguments before users."""
        return _between(self.program.nodes, self.program.prologue, self.program.results)

    @cached_property
    def careful(self) -> Callable[..., tuple[list[Any], ...]]:
        """The same function, with nan and infinities where the fast one raises."""
        return self._function("careful")

    def _written(self, flavour: Flavour) -> tuple[str, list[object]]:
        program = self.program
        given = [program.prologue, *(group.symbols for group in program.inputs)]
        return write_function("kernel", flavour, given, self._between, [group.expressions for group in program.outputs])

    def _function(self, flavour: Flavour) -> Callable[..., tuple[list[Any], ...]]:
        with stage("code"):
            return _execute("kernel", *self._written(flavour), flavour, self.program.name)

    @cached_property
    def _prologue(self) -> Callable[..., tuple[list[Any], ...]]:
        flavour: Flavour = "vectorized" if self.vectorized else "careful"
        program = self.program
        source, externals = write_function("prologue", flavour, [program.parameters], program.once, [program.prologue])
        return _execute("prologue", source, externals, flavour, program.name)


def _between(
    nodes: Sequence[Expression], known: Sequence[Expression], results: Sequence[Expression]
) -> list[Expression]:
    """Return what the results need beyond the known values, arguments before users."""
    have, wanted = set(known), set(results)
    for node in reversed(nodes):
        if node in wanted and node not in have:
            wanted.update(node.arguments)
    wanted -= have
    return [node for node in nodes if node in wanted]


@dataclass(frozen=True, eq=False)
class BoundKernel:
    """A program with its parameter values: a function of the input groups.

    Attributes
    ----------
    compiled
        The code.
    parameter_values
        The values of the parameters.
    prologue_values
        The values of what depends on parameters alone, in the order of ``program.prologue``.
    """

    compiled: CompiledProgram
    parameter_values: NDArray[np.float64]
    prologue_values: list[Any]

    def __call__(self, *groups: Any) -> tuple[Any, ...]:
        """Evaluate the program."""
        check_time()
        compiled = self.compiled
        if len(groups) != len(compiled.program.inputs):
            self._check_sizes(groups)
        if compiled.vectorized:
            return self._call_vectorized([np.asarray(group, dtype=float) for group in groups])
        lists = [group.tolist() if isinstance(group, np.ndarray) else group for group in groups]
        try:
            if self._has_gaps:
                return self._call_carefully(lists)
            return compiled.run(self.prologue_values, *lists)
        except (ArithmeticError, ValueError):
            self._check_sizes(lists)
            return self._call_carefully(lists)

    @cached_property
    def _has_gaps(self) -> bool:
        """Whether something that depends on parameters alone has no finite value."""
        return not all(map(math.isfinite, self.prologue_values))

    def _call_carefully(self, lists: Sequence[Sequence[float]]) -> tuple[list[float], ...]:
        """Evaluate with nan outside domains: that is well as long as it does not reach an output."""
        program = self.compiled.program
        try:
            results = self.compiled.careful(self.prologue_values, *lists)
        except Exception as error:
            self._check_sizes(lists)
            raise KernelEvaluationError(f"an external function failed: {error}", where=program.name) from error
        for group, values in zip(program.outputs, results, strict=True):
            for position, value in enumerate(values):
                if not math.isfinite(value):
                    raise self._undefined(group.name, position, group.expressions[position], lists)
        return results

    def _undefined(
        self, group: str, position: int, output: Expression, lists: Sequence[Sequence[float]]
    ) -> KernelEvaluationError:
        """Return the error that says which operation left its domain first, and at what values."""
        program = self.compiled.program
        known: dict[Expression | str, float] = dict(
            zip(program.parameters, self.parameter_values.tolist(), strict=True)
        )
        for inputs, values in zip(program.inputs, lists, strict=True):
            known.update(zip(inputs.symbols, values, strict=True))
        nodes = live([output])
        values_of = dict(zip(nodes, evaluate(nodes, known), strict=True))
        culprit = next((node for node in nodes if not math.isfinite(values_of[node])), output)
        at = ", ".join(f"{values_of.get(argument, math.nan):.6g}" for argument in culprit.arguments)
        detail = f"{culprit!r} is {culprit.operation} of ({at})" if culprit.arguments else f"{culprit!r} is not finite"
        return KernelEvaluationError(
            f"the output {group}[{position}] has no finite value: {detail}",
            where=program.name,
            advice="The state has left the domain of an operation: look at the start values, or at a division by zero.",
        )

    def _call_vectorized(self, arrays: Sequence[NDArray[np.float64]]) -> tuple[NDArray[np.float64], ...]:
        self._check_sizes(arrays)
        shapes = [array.shape[1:] for array in (*arrays, self.parameter_values)]
        (samples,) = np.broadcast_shapes(*shapes) or (1,)
        with np.errstate(all="ignore"):
            results = self.compiled.run(self.prologue_values, *arrays)
        filled = [np.empty((len(values), samples)) for values in results]
        for target, values in zip(filled, results, strict=True):
            for row, value in enumerate(values):
                target[row] = value
        return tuple(filled)

    def _check_sizes(self, groups: Sequence[Any]) -> None:
        program = self.compiled.program
        expected = [len(group.symbols) for group in program.inputs]
        found = [len(group) for group in groups]
        if expected != found:
            names = ", ".join(f"{group.name} of {len(group.symbols)}" for group in program.inputs)
            raise KernelEvaluationError(f"takes the groups {names}; got groups of {found}", where=program.name)


def _execute(
    name: str, source: str, externals: Sequence[object], flavour: Flavour, program: str
) -> Callable[..., tuple[list[Any], ...]]:
    """Compile generated source and return one function of it."""
    namespace = dict(_NAMESPACES[flavour])
    for position, function in enumerate(externals):
        assert isinstance(function, ExternalFunction)
        call = function.function
        namespace[f"e{position}"] = np.vectorize(call, otypes=[float]) if flavour == "vectorized" else call
    exec(_code_of(source, f"<{name} of {program}>"), namespace)
    found: Callable[..., tuple[list[Any], ...]] = namespace[name]
    return found


@lru_cache(maxsize=512)
def _code_of(source: str, name: str) -> CodeType:
    """Return compiled source; scenes that are made again write the same."""
    return compile(source, name, "exec")


def _solve(size: int, entries: Sequence[float], right: Sequence[float]) -> Sequence[float]:
    """Solve a linear system of floats, by whichever of two ways is faster for its size."""
    if size == 2:
        a, b, c, d = entries
        p, q = right
        if abs(a) < abs(c):
            a, b, p, c, d, q = c, d, q, a, b, p
        factor = c / a
        y = (q - factor * p) / (d - factor * b)
        return (p - b * y) / a, y
    if size <= _LARGEST_PLAIN_SOLVE:
        return solve_floats(size, entries, right)
    matrix = np.array(entries).reshape(size, size)
    try:
        solution: list[float] = np.linalg.solve(matrix, np.array(right)).tolist()
    except np.linalg.LinAlgError:
        raise ZeroDivisionError("singular matrix") from None
    return solution


def _solve_samples(size: int, entries: Sequence[Any], right: Sequence[Any]) -> Sequence[Any]:
    """Solve one linear system for each sample; all nan for a sample with a singular matrix."""
    shapes = [getattr(one, "shape", ()) for one in (*entries, *right)]
    shape = np.broadcast_shapes(*{*shapes})
    matrices, sides = (np.empty((*shape, len(some))) for some in (entries, right))
    for whole, some, own in ((matrices, entries, shapes), (sides, right, shapes[len(entries) :])):
        whole[...] = [0.0 if many else one for one, many in zip(some, own, strict=False)]  # most are zeros of a pattern
        for i, one in enumerate(some):
            if own[i]:
                whole[..., i] = one
    matrices, sides = matrices.reshape(*shape, size, size), sides[..., None]
    try:
        solution = np.linalg.solve(matrices, sides)
    except np.linalg.LinAlgError:
        flat = [
            solve_or_nan(size, matrix.ravel().tolist(), side.ravel().tolist())
            for matrix, side in zip(matrices.reshape(-1, size, size), sides.reshape(-1, size), strict=True)
        ]
        solution = np.array(flat).reshape(sides.shape)
    return [solution[..., i, 0] for i in range(size)]


_LIMITS = {"inf": math.inf, "nan": math.nan}
_SAME_IN_NUMPY = ("sqrt", "absolute", "sign", "floor", "where", "logical_and", "logical_or", "logical_not")
_NAMESPACES: dict[Flavour, dict[str, Any]] = {
    "fast": _LIMITS
    | {**elementary.STRICT, "sqrt": math.sqrt, "absolute": abs, "sign": UNARY["sign"], "floor": UNARY["floor"]}
    | {"solve": _solve},
    "careful": {**_LIMITS, **UNARY, **BINARY, "solve": solve_or_nan},
    "vectorized": _LIMITS
    | {name: getattr(np, name) for name in _SAME_IN_NUMPY}
    | {**elementary.ON_ARRAYS, "solve": _solve_samples},
}
"""What the names in generated code mean."""

_OPERATIONS = {flavour: operations_of(flavour, names) for flavour, names in _NAMESPACES.items()}
"""What the operations mean where a program is walked through."""
