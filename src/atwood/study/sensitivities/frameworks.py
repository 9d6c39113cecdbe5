"""A run as a differentiable function of other frameworks: values forwards, and cotangents back through its steps."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from atwood.arguments import PATHS, one_of, optional, takes
from atwood.arrays import FloatArray
from atwood.errors import SolveError, UsageError
from atwood.forms.assembly import Assembly
from atwood.lazy_modules import needed
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE, assembly_of, simulate
from atwood.result.result import Result
from atwood.simulation.problem.arguments import FORM, OUTPUTS, RTOL, T_END
from atwood.study.sensitivities.adjoint import Adjoint
from atwood.study.sensitivities.columns import find_columns
from atwood.study.sensitivities.inputs import HELD, INPUTS, LINEAR, Driven, with_inputs


class RunFunction:
    """Quantities of a run as a function of a vector.

    ``function(values)`` gives the quantities at the output times, shape (quantities, times).

    Parameters
    ----------
    make
        Makes it a function of the framework, from what gives values and what gives cotangents back.

    Attributes
    ----------
    by
        What the vector has, by path: parameters, start values, inputs at their nodes; in SI units.
    values
        The vector of the scene as it is.
    quantities, time
        Paths of the quantities, and output times, s.
    """

    def __init__(
        self,
        make: Callable[[RunFunction], Callable[[Any], Any]],
        assembly: Assembly,
        quantities: tuple[str, ...],
        parameters: tuple[str, ...],
        start: tuple[str, ...],
        inputs: Mapping[str, Any] | Iterable[str],
        between: str,
        t_end: float | None,
        outputs: Any,
        rtol: float,
    ) -> None:
        begin, end = assembly.flat.t_start, assembly.flat.t_end if t_end is None else t_end
        self.assembly, self.parameters, self.start = assembly, parameters, start
        self.between, self.end, self.rtol = between, end, rtol
        self.quantities = quantities
        self.time = np.linspace(begin, end, outputs) if isinstance(outputs, int) else np.asarray(outputs, dtype=float)
        driven, self.driven = with_inputs(assembly, inputs, between, end)
        self._last: tuple[bytes, Result, tuple[Driven, ...]] | None = None
        self._adjoint: tuple[bytes, Adjoint, FloatArray] | None = None
        result = self._run(driven)
        assert result.run.start is not None
        columns = self._columns(result, self.driven)
        self.by = tuple(one.path for one in columns)
        self.values = np.array([one.value for one in columns])
        self._call = make(self)

    def __call__(self, values: Any) -> Any:
        """Return the quantities at the output times, as an array of the framework."""
        return self._call(values)

    def _columns(self, result: Result, driven: tuple[Driven, ...]) -> Any:
        assert result.run.start is not None
        more = [one for some in driven for one in some.columns()]
        return find_columns(result.run.assembly, result.run.start, self.parameters, self.start, more)

    def _run(self, assembly: Assembly) -> Result:
        result = simulate(assembly, t_end=self.end, outputs=self.time, rtol=self.rtol)
        if result.status != "finished":
            raise SolveError(f"the run does not get to its end: {result.message}", where=assembly.flat.name)
        return result

    def _at(self, values: FloatArray) -> tuple[Result, tuple[Driven, ...]]:
        """Return the run with some values; the last one is kept."""
        known, last = values.tobytes(), self._last
        if last is None or last[0] != known:
            if values.shape != self.values.shape or not np.all(np.isfinite(values)):
                raise UsageError(
                    f"it is a function of {len(self.values)} finite numbers, and got {values!r}",
                    where=self.assembly.flat.name,
                    advice=f"Give {', '.join(self.by)}.",
                )
            named = dict(zip(self.by, values.tolist(), strict=True))
            parameters = {path: named[path] for path in self.parameters}
            start = dict(zip(self.start, values.tolist()[len(self.parameters) :], strict=False))
            other = self.assembly.with_values(parameters, start=start)
            cuts = np.cumsum([len(one.times) for one in self.driven])[:-1]
            own = np.split(values[len(self.parameters) + len(self.start) :], cuts)
            nodes: dict[str, Any] = {
                one.path: float(some[0]) if one.is_constant else np.column_stack([one.times, some])
                for one, some in zip(self.driven, own, strict=False)
            }
            assembly, driven = with_inputs(other, nodes, self.between, self.end)
            last = self._last = known, self._run(assembly), driven
        return last[1:]

    def _places(self, result: Result) -> Any:
        """Return where the output times are among those of a run, which are more where something happens."""
        return np.searchsorted(result.time, self.time, side="right") - 1

    def at(self, values: FloatArray) -> FloatArray:
        """Return the quantities at the output times, shape (quantities, times)."""
        result, _ = self._at(values)
        places = self._places(result)
        return np.array([result[path][places] for path in self.quantities])

    def back(self, values: FloatArray, weights: FloatArray) -> FloatArray:
        """Return the gradient of a weighted sum of the quantities; weights have the shape (quantities, times)."""
        result, driven = self._at(values)
        known, last = values.tobytes(), self._adjoint
        if last is None or last[0] != known:
            columns = self._columns(result, driven)
            made = Adjoint(result, columns, self.quantities, self.rtol, None)
            made.make()
            last = self._adjoint = known, made, np.array([one.scale for one in columns])
        _, adjoint, scales = last
        every = np.zeros((len(self.quantities), len(result.time)))
        every[:, self._places(result)] = weights
        return np.asarray(adjoint.gradient(every) / scales)


def _with_jax(one: RunFunction) -> Callable[[Any], Any]:
    jax = needed("jax", "jax", where="as_jax")
    shape = len(one.quantities), len(one.time)

    def called(function: Callable[..., FloatArray], like: tuple[int, ...], *given: Any) -> Any:
        def on_numbers(*some: Any) -> Any:
            return function(*(np.asarray(x, dtype=np.float64) for x in some)).astype(given[0].dtype)

        kind = jax.ShapeDtypeStruct(like, given[0].dtype)
        return jax.pure_callback(on_numbers, kind, *given, vmap_method="sequential")

    @jax.custom_vjp  # type: ignore[untyped-decorator]
    def run(values: Any) -> Any:
        return called(one.at, shape, values)

    def back(values: Any, weights: Any) -> Any:
        return (called(one.back, one.values.shape, values, weights),)

    run.defvjp(lambda values: (run(values), values), back)
    return lambda values: run(jax.numpy.asarray(values, dtype=float))


def _with_torch(one: RunFunction) -> Callable[[Any], Any]:
    torch = needed("torch", "torch", where="as_torch")

    def numbers(tensor: Any) -> FloatArray:
        return np.asarray(tensor.detach().cpu().numpy(), dtype=np.float64)

    class Run(torch.autograd.Function):  # type: ignore[name-defined,misc]
        @staticmethod
        def forward(context: Any, values: Any) -> Any:
            context.save_for_backward(values)
            return torch.as_tensor(one.at(numbers(values)), dtype=values.dtype, device=values.device)

        @staticmethod
        @torch.autograd.function.once_differentiable  # type: ignore[untyped-decorator]
        def backward(context: Any, weights: Any) -> Any:
            (values,) = context.saved_tensors
            found = one.back(numbers(values), numbers(weights))
            return torch.as_tensor(found, dtype=values.dtype, device=values.device)

    return lambda values: Run.apply(torch.as_tensor(values))


_KINDS: dict[str, Any] = {
    "scene": SCENE,
    "quantities": PATHS,
    "parameters": PATHS,
    "start": PATHS,
    "inputs": INPUTS,
    "between": one_of((LINEAR, HELD)),
    "t_end": T_END,
    "outputs": OUTPUTS,
    "form": optional(FORM),
    "rtol": RTOL,
}


@takes(**_KINDS)
def as_jax(
    scene: Model | Assembly,
    quantities: Iterable[str],
    *,
    parameters: Iterable[str] = (),
    start: Iterable[str] = (),
    inputs: Mapping[str, Any] | Iterable[str] = (),
    between: str = LINEAR,
    t_end: float | str | None = None,
    outputs: Any = 201,
    form: str | None = None,
    rtol: float = 1e-10,
) -> RunFunction:
    """Return a run as a function of JAX, with `grad`, `jit` and, one run after the other, `vmap`.

    Its derivatives are those of `sensitivities` with ``mode="adjoint"``: one way back for each sum of outputs. JAX
    counts in single precision unless told otherwise (``jax.config.update("jax_enable_x64", True)``); the run does not.

    Parameters
    ----------
    scene, quantities, parameters, start, inputs, between, t_end, outputs, form, rtol
        See `sensitivities`.

    Returns
    -------
    RunFunction
        ``function(values)`` of shape (quantities, times), of a vector whose parts `by` names and `values` has.

    Raises
    ------
    AtwoodError
        If JAX is not installed (``pip install jax``), or something has no derivative.
    """
    assembly = assembly_of(scene, form=form)
    end = None if t_end is None else float(t_end)
    about = tuple(quantities), tuple(parameters), tuple(start), inputs, between, end, outputs, rtol
    return RunFunction(_with_jax, assembly, *about)


@takes(**_KINDS)
def as_torch(
    scene: Model | Assembly,
    quantities: Iterable[str],
    *,
    parameters: Iterable[str] = (),
    start: Iterable[str] = (),
    inputs: Mapping[str, Any] | Iterable[str] = (),
    between: str = LINEAR,
    t_end: float | str | None = None,
    outputs: Any = 201,
    form: str | None = None,
    rtol: float = 1e-10,
) -> RunFunction:
    """Return a run as a function of PyTorch, whose derivatives its `backward` goes through.

    They are those of `sensitivities` with ``mode="adjoint"``: one way back for each sum of outputs. Its tensors are of
    the precision of the vector that it is given; the run counts in double precision.

    Parameters
    ----------
    scene, quantities, parameters, start, inputs, between, t_end, outputs, form, rtol
        See `sensitivities`.

    Returns
    -------
    RunFunction
        ``function(values)`` of shape (quantities, times), of a vector whose parts `by` names and `values` has.

    Raises
    ------
    AtwoodError
        If PyTorch is not installed (``pip install torch``), or something has no derivative.
    """
    assembly = assembly_of(scene, form=form)
    end = None if t_end is None else float(t_end)
    about = tuple(quantities), tuple(parameters), tuple(start), inputs, between, end, outputs, rtol
    return RunFunction(_with_torch, assembly, *about)
