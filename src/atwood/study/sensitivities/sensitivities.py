"""Derivatives of the quantities of a run by parameters and start values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from itertools import product
from typing import Any

import numpy as np

from atwood.arguments import PATHS, one_of, optional, takes, whole
from atwood.arrays import FloatArray
from atwood.errors import SolveError, UnsupportedError, UsageError
from atwood.forms.assembly import Assembly
from atwood.forms.quantities import find_observables
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import Model
from atwood.model.values.units import parse_unit, unit_of
from atwood.pipeline import SCENE, assembly_of, simulate
from atwood.result.result import Result
from atwood.simulation.events.sampling import refuse_updates
from atwood.simulation.problem.arguments import FORM, OUTPUTS, RTOL, T_END
from atwood.study.sensitivities.adjoint import Adjoint
from atwood.study.sensitivities.columns import find_columns
from atwood.study.sensitivities.inputs import HELD, INPUTS, LINEAR, Driven, with_inputs
from atwood.study.sensitivities.passage import Passage
from atwood.table import Shown, Table, table


@dataclass(frozen=True, eq=False)
class Sensitivities(Shown):
    """Derivatives of quantities of a run by what was varied.

    ``found["bob.position.x", "rod.length"]`` is an array over the output times, and ``found["bob.position.x",
    "push.value"]`` one of shape (nodes, times) where the input ``push.value`` has nodes.

    Attributes
    ----------
    result
        The run.
    time
        Output times, s, shape (times,).
    quantities, by
        Paths of what is differentiated, and of what by: parameters, then start values, then inputs at their nodes.
    values
        The quantities, shape (quantities, times).
    derivatives
        In SI units, shape (quantities, columns, times). At an event they are those after it.
    units
        Of each derivative, by the two paths.
    inputs
        Inputs with the times and values of their nodes.
    """

    result: Result = field(repr=False)
    time: FloatArray
    quantities: tuple[str, ...]
    by: tuple[str, ...]
    values: FloatArray
    derivatives: FloatArray
    units: dict[tuple[str, str], str]
    inputs: tuple[Driven, ...] = ()

    def __getitem__(self, pair: tuple[str, str]) -> FloatArray:
        if len(pair) != 2:
            advice = "Give both: found['bob.position.x', 'rod.length']."
            raise UsageError("a derivative is of a quantity by a parameter", advice=advice)
        places = []
        nodes = next((one for one in self.inputs if one.path == pair[1] and not one.is_constant), None)
        if nodes is not None:
            return np.array([self[pair[0], nodes.name(k)] for k in range(len(nodes.times))])
        for path, known, what in zip(pair, (self.quantities, self.by), ("of", "by"), strict=True):
            if path not in known:
                raise UsageError(f"there are no derivatives {what} it; there are {', '.join(known)}", where=str(path))
            places.append(known.index(path))
        found: FloatArray = self.derivatives[places[0], places[1]]
        return found

    def at_end(self) -> FloatArray:
        """Return the derivatives at the end, shape (quantities, columns)."""
        found: FloatArray = self.derivatives[:, :, -1]
        return found

    def tables(self) -> Sequence[Table]:
        """Return the derivatives at the end and their largest size along the run."""
        rows = []
        for quantity, path in product(self.quantities, self.by):
            found = self[quantity, path]
            rows.append((quantity, path, found[-1], float(np.max(np.abs(found))), self.units[quantity, path]))
        title = f"Derivatives of {self.result.assembly.flat.name}, at t = {self.time[-1]:g} s"
        return [table(("quantity", "by", "at the end", "largest", "unit"), rows, title=title)]


def unit_by(quantity: str, parameter: str) -> str:
    """Return the unit of the derivative of a quantity by something, from both units."""
    above, below = (parse_unit(one or "1").exponents for one in (quantity, parameter))
    m, l, t, i = (a - b for a, b in zip(above, below, strict=True))
    return str(unit_of((m, l, t, i)).text)


@takes(
    scene=SCENE,
    quantities=PATHS,
    parameters=PATHS,
    start=PATHS,
    inputs=INPUTS,
    between=one_of((LINEAR, HELD)),
    t_end=T_END,
    outputs=OUTPUTS,
    form=optional(FORM),
    mode=one_of(("auto", "forward", "adjoint")),
    rtol=RTOL,
    max_steps=optional(whole("a number of steps", 1)),
)
def sensitivities(
    scene: Model | Assembly,
    quantities: Iterable[str] = (),
    *,
    parameters: Iterable[str] = (),
    start: Iterable[str] = (),
    inputs: Mapping[str, Any] | Iterable[str] = (),
    between: str = LINEAR,
    t_end: float | str | None = None,
    outputs: Any = 201,
    form: str | None = None,
    mode: str = "auto",
    rtol: float = 1e-10,
    max_steps: int | None = None,
) -> Sensitivities:
    """Return the derivatives of quantities along a run by parameters, start values and inputs.

    The variational equations come from derivatives of the expression graph and are integrated together with the
    motion; no runs are compared.

    Parameters
    ----------
    scene
        The scene, or an assembly of it.
    quantities
        What is differentiated, by path; the coordinates when not given.
    parameters, start
        Paths of parameters and of start values. A parameter that shapes the equations, or is exactly zero, is refused.
        By a start value that the scene does not give, derivatives are as if it gave the one that it has.
    inputs
        Inputs (signals) of parts, each with its values at nodes: ``{"push.value": [(0.0, 6.0), (1.0, -6.0)]}``, rows of
        time, s, and value, which cover the run. The run has these, and there is one derivative by the value at each
        node, called ``"push.value[0]"`` and so on; ``found[quantity, "push.value"]`` has all, shape (nodes, times).
        With a number, or with paths alone, an input is constant, and there is one. Zero is a value as any other.
    between
        What an input is between two nodes: ``"linear"``, or ``"held"``, as what a computer puts out is.
    t_end, outputs, form
        See `atwood.simulate`.
    mode
        ``"forward"`` integrates one column for each parameter, start value and node, with the motion. ``"adjoint"``
        goes back through the steps of the motion, once for each quantity and output time: a few times the cost of a
        run, however many columns there are. Ask for few `outputs`, as ``[t_end]``. ``"auto"`` takes what costs less.
    rtol
        Relative tolerance of the motion, and of each derivative. An adjoint is exact for the steps taken, whose errors
        are those of the motion alone.
    max_steps
        Limit of the steps of each stretch; a hundred times those of the run when not given, since a stiff motion would
        need very many.

    Returns
    -------
    Sensitivities
        The derivatives with their units.

    Raises
    ------
    UsageError
        If something has no derivative, by its path; so have runs with updates that may remember what they were called
        with.
    SolveError
        If the run does not get to its end, or has no derivative at an event, with time and part.
    """
    assembly = assembly_of(scene, form=form)
    end = assembly.flat.t_end if t_end is None else float(t_end)
    assembly, driven = with_inputs(assembly, inputs, between, end)
    about = tuple(quantities), tuple(parameters), tuple(start)
    return derivatives_of(assembly, *about, t_end, outputs, rtol, max_steps, driven, mode)


def derivatives_of(
    assembly: Assembly,
    quantities: tuple[str, ...],
    parameters: tuple[str, ...],
    starts: tuple[str, ...],
    t_end: float | str | None,
    outputs: Any,
    rtol: float,
    max_steps: int | None,
    driven: tuple[Driven, ...] = (),
    mode: str = "forward",
) -> Sensitivities:
    """Return the derivatives along a run; see `sensitivities`."""
    from atwood.study.sweeps.runs import expand_paths

    refuse_updates(assembly, "derivatives", "")
    result = simulate(assembly, t_end=t_end, outputs=outputs, rtol=rtol, max_steps=max_steps)
    run = result.run
    if result.status not in ("finished", "stopped"):
        raise SolveError(f"the run does not get to its end: {result.message}", where=assembly.flat.name)
    assert run.start is not None
    columns = find_columns(
        run.assembly, run.start, parameters, starts, [one for some in driven for one in some.columns()]
    )
    paths = tuple(expand_paths(assembly, quantities or None))
    goes_back = mode == "adjoint" or (mode == "auto" and _DEARER * len(paths) * len(result.time) < len(columns))
    about = result, columns, paths, rtol, max_steps
    try:
        values, found = (Adjoint if goes_back else Passage)(*about).go()
    except UnsupportedError:
        if mode != "auto" or not goes_back:
            raise
        values, found = Passage(*about).go()
    scales = np.array([one.scale for one in columns])
    units = {one.path: one.unit for one in find_observables(assembly, paths)}
    return Sensitivities(
        result=result,
        time=result.time,
        quantities=paths,
        by=tuple(one.path for one in columns),
        values=values,
        derivatives=found / scales[:, None],
        units={(path, one.path): unit_by(units[path], one.unit) for path in paths for one in columns},
        inputs=driven,
    )


_DEARER = 2
"""A way back costs as much as so many columns."""
