"""Parameters and start values fitted to measurements, by least squares with derivatives of the runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from atwood.arguments import ANYTHING, BY_PATH, PATHS, Kind, Refused, number, one_of, optional, takes, whole
from atwood.arrays import FloatArray
from atwood.display import data_of
from atwood.errors import AtwoodError, SolveError, UsageError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import scipy
from atwood.model.compose.composite import Model
from atwood.model.values.units import parse_quantity, parse_unit
from atwood.numerics.rank import Decomposition, decompose
from atwood.pipeline import SCENE, assembly_of
from atwood.ranges import range_of
from atwood.simulation.initialization.start import find_start
from atwood.simulation.problem.arguments import FORM, RTOL
from atwood.study.sensitivities.columns import Column, find_columns
from atwood.study.sensitivities.measured import Measured, read_experiments
from atwood.study.sensitivities.sensitivities import derivatives_of
from atwood.table import Shown, Table, table
from atwood.tolerances import tolerances

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LOSSES = ("linear", "soft_l1", "huber", "cauchy", "arctan")


@dataclass(frozen=True, eq=False)
class Fit(Shown):
    """Values fitted to measurements.

    Attributes
    ----------
    scene
        Name of the scene.
    values, errors
        By path, in SI units; standard errors are infinite for what the data do not determine.
    units
        By path.
    covariance
        Of the values in the order of `values`, within the combinations that are determined, shape (values, values).
    undetermined
        Combinations that the data do not determine: by path the relative change of each value, for starts the change
        in the scene's sizes, with which nothing changes.
    experiments
        The data, with times and values.
    residuals
        For each experiment by path: data minus the run, SI units.
    weights
        By path of a quantity: what its residuals were multiplied by.
    deviation
        Standard deviation of weighted residuals.
    evaluations
        How many sets of values were tried.
    message
        Why it ended.
    assembly
        The scene with the fitted values.
    """

    scene: str
    values: Mapping[str, float]
    errors: Mapping[str, float]
    units: Mapping[str, str]
    covariance: FloatArray
    undetermined: tuple[Mapping[str, float], ...]
    experiments: tuple[Measured, ...] = field(repr=False)
    residuals: tuple[Mapping[str, FloatArray], ...] = field(repr=False)
    weights: Mapping[str, float]
    deviation: float
    evaluations: int
    message: str
    assembly: Assembly = field(repr=False)

    def product(self, powers: Mapping[str, float]) -> tuple[float, float]:
        """Return a product of powers of fitted values, such as a ratio, and its standard error.

        Parameters
        ----------
        powers
            By path: ``{"mass2": 1, "mass1": -1}`` is the ratio of two masses.

        Raises
        ------
        UsageError
            If a path was not fitted, or a value is zero.
        """
        paths = list(self.values)
        slopes = np.zeros(len(paths))
        result = 1.0
        for path, power in powers.items():
            if path not in self.values or self.values[path] == 0.0:
                raise UsageError("it was not fitted, or is zero", where=path, advice=f"There are {', '.join(paths)}.")
            slopes[paths.index(path)] = power / self.values[path]
            result *= float(self.values[path] ** power)
        relative = np.array([one * self.values[path] for one, path in zip(slopes, paths, strict=True)])
        for open_one in self.undetermined:
            along = np.array([open_one.get(path, 0.0) for path in paths])
            if abs(relative @ along) > tolerances.CLEAR * np.linalg.norm(relative) * np.linalg.norm(along):
                return result, np.inf
        square = float(slopes @ self.covariance @ slopes)
        return result, abs(result) * float(np.sqrt(max(0.0, square)))

    @cached_property
    def open_combinations(self) -> tuple[str, ...]:
        """The combinations that the data do not determine, in words."""
        return tuple(
            ", ".join(f"{path} by {100.0 * by:+.4g} %" for path, by in one.items()) + ": no run changes"
            for one in self.undetermined
        )

    def plot(self, file: Any = None) -> Figure:
        """Draw data, runs and residuals; see `atwood.plot_fit`."""
        from importlib import import_module

        figure: Figure = import_module("atwood.plotting.plots.fit").plot_fit(self, file)
        return figure

    def tables(self) -> Sequence[Table]:
        """Return values and errors, with the combinations that are not determined."""
        rows = [(path, value, self.errors[path], self.units[path]) for path, value in self.values.items()]
        samples = sum(len(one) for some in self.residuals for one in some.values())
        notes = [f"{samples} samples, weighted residuals of {self.deviation:.3g}"]
        notes += [f"not determined: {one}" for one in self.open_combinations]
        return [table(("path", "value", "error", "unit"), rows, title=f"Fit of {self.scene}", notes=notes)]

    def to_data(self) -> dict[str, Any]:
        """Return it as plain data, for JSON; infinite errors are None."""
        errors = {path: one if np.isfinite(one) else None for path, one in self.errors.items()}
        told = data_of(self, "units", "covariance", "undetermined", "deviation", "evaluations", "message")
        return {**data_of(self, "scene", "values"), "errors": errors, **told}


def _bounds(value: Any) -> dict[str, Any]:
    """Return what may be between which bounds, by path; None for what has none."""
    if isinstance(value, Mapping):
        return dict(BY_PATH.read(value))
    found: dict[str, Any] = {}
    for one in PATHS.read(value):
        path, sign, text = one.partition("=")
        if path.strip() in found:
            raise Refused(f"{path.strip()} is given twice.")
        found[path.strip()] = text if sign else None
    return found


VARY = Kind(
    "paths, such as ['bob.mass'], or bounds by path, such as {'bob.mass': (0.5, 2.0)}",
    _bounds,
    "PATH[=LOW:HIGH]",
    is_many=True,
)


@takes(
    scene=SCENE,
    data=ANYTHING,
    vary=optional(VARY),
    start=optional(VARY),
    quantities=optional(PATHS),
    weights=optional(BY_PATH),
    loss=one_of(_LOSSES),
    form=optional(FORM),
    rtol=RTOL,
    max_evaluations=whole("a number of evaluations", 1),
)
def fit(
    scene: Model | Assembly,
    data: Any,
    vary: Any = None,
    *,
    start: Any = None,
    quantities: Iterable[str] | None = None,
    weights: Mapping[str, float] | None = None,
    loss: str = "linear",
    form: str | None = None,
    rtol: float = 1e-9,
    max_evaluations: int = 100,
) -> Fit:
    """Fit parameters and start values of a scene to measurements.

    The sum of the squares of weighted residuals becomes least, by a trust region method with derivatives of the runs
    (`scipy.optimize.least_squares`; M. A. Branch, T. F. Coleman, Y. Li, SIAM J. Sci. Comput. 21, 1999). Standard
    errors follow from the residuals, as if these were independent.

    Parameters
    ----------
    scene
        The scene, or an assembly of it; where values start from is where it has them.
    data
        A table of pandas, a dataset of xarray, the path of a CSV file, a dictionary of arrays, or a result; or a list
        of several, each alone or with what was set for it, as ``(table, {"rod.angle": 0.3})``. Times are the index,
        the coordinate ``time``, or the first column; other columns are called by the paths of quantities, perhaps with
        a unit in brackets: ``bob.position.x [mm]``.
    vary, start
        Parameters and start values to be fitted: paths, or bounds by path. A parameter that is positive stays so,
        unless it has a lower bound below zero.
    quantities
        Which columns count; all when not given, and the coordinates of a result.
    weights
        By path, what residuals are multiplied by, such as one over their standard deviation, in SI units; one over the
        standard deviation of the data themselves when not given.
    loss
        How large residuals count: ``"linear"`` as they are, others less, so that outliers do not spoil the fit; they
        are measured by the weights.
    form
        See `atwood.assemble`.
    rtol
        Relative tolerance of the runs and their derivatives.
    max_evaluations
        So many sets of values are tried at most.

    Returns
    -------
    Fit
        Values, errors, and what the data do not determine.

    Raises
    ------
    UsageError
        If data or paths will not do; they are named.
    SolveError
        If no fit is found.
    """
    assembly = assembly_of(scene, form=form)
    experiments = read_experiments(assembly, data, quantities)
    return _Search(assembly, experiments, {**vary} if vary else {}, {**start} if start else {}, weights, rtol).go(
        loss, max_evaluations
    )


class _Search:
    """The search for the values."""

    def __init__(
        self,
        assembly: Assembly,
        experiments: tuple[Measured, ...],
        vary: Mapping[str, Any],
        start: Mapping[str, Any],
        weights: Mapping[str, float] | None,
        rtol: float,
    ) -> None:
        self.assembly, self.experiments, self.rtol = assembly, experiments, rtol
        self.parameters, self.starts = tuple(vary), tuple(start)
        self.columns = find_columns(assembly, find_start(assembly), self.parameters, self.starts)
        self.scales = np.array([one.scale for one in self.columns])
        given = [*vary.values(), *start.values()]
        ends = np.array([_ends(one, bounds) for one, bounds in zip(self.columns, given, strict=True)], dtype=float)
        # What is positive is searched for by its logarithm: combinations as a common factor are then straight lines.
        positive = [not one.is_start and one.value > 0.0 for one in self.columns]
        self.by_logarithm = np.array(positive) & ((ends[:, 0] >= 0.0) | np.isinf(ends[:, 0]))
        self.low, self.high = self.unknowns(ends[:, 0]), self.unknowns(ends[:, 1])
        self.weights = _weights(experiments, weights)
        self.samples = sum(len(one.place) * len(one.values) for one in experiments)
        if self.samples < len(self.columns):
            raise UsageError(
                f"{self.samples} samples cannot determine {len(self.columns)} values",
                where=assembly.flat.name,
                advice="Give more data, or vary less.",
            )
        for one in experiments:
            both = [path for path in one.given if path in (*self.parameters, *self.starts)]
            if both:
                raise UsageError("it is fitted, and set for an experiment", where=both[0], advice="Do one of both.")
        self.known: tuple[bytes, FloatArray, FloatArray] | None = None
        self.error: AtwoodError | None = None

    def unknowns(self, values: FloatArray) -> FloatArray:
        """Return what is searched for from values in SI units."""
        share = values / self.scales
        with np.errstate(divide="ignore"):
            return np.asarray(np.where(self.by_logarithm, np.log(np.maximum(share, 0.0)), share))

    def values(self, x: FloatArray) -> FloatArray:
        """Return values in SI units from what is searched for."""
        with np.errstate(over="ignore"):
            return np.asarray(self.scales * np.where(self.by_logarithm, np.exp(np.where(self.by_logarithm, x, 0.0)), x))

    def slopes(self, x: FloatArray) -> FloatArray:
        """Return the derivatives of the values by what is searched for."""
        return np.where(self.by_logarithm, self.values(x), self.scales)

    def changed(self, x: FloatArray, more: Mapping[str, Any] | None = None) -> Assembly:
        """Return the scene with some values, and what is set for an experiment."""
        found = self.values(x)
        values = dict(zip(self.parameters, found.tolist(), strict=False))
        starts = dict(zip(self.starts, found[len(self.parameters) :].tolist(), strict=True))
        for path, value in (more or {}).items():
            is_start = path in self.assembly.start_observables or path in self.assembly.flat.start
            (starts if is_start else values)[path] = value
        return self.assembly.with_values(values, start=starts)

    def look(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return weighted residuals and their derivatives."""
        if self.known is None or self.known[0] != x.tobytes():
            parts = [self._one(x, one) for one in self.experiments]
            self.known = x.tobytes(), np.concatenate([one for one, _ in parts]), np.vstack([one for _, one in parts])
        return self.known[1], self.known[2]

    def _one(self, x: FloatArray, one: Measured) -> tuple[FloatArray, FloatArray]:
        assembly, paths = self.changed(x, one.given), tuple(one.values)
        end = float(one.time[-1])
        found = derivatives_of(assembly, paths, self.parameters, self.starts, end, one.time, self.rtol, None)
        if len(found.time) != len(one.time):
            raise SolveError(
                f"the run ends at {found.time[-1]:g} s, and there are data until {end:g} s", where=one.name
            )
        weights = np.array([self.weights[path] for path in paths])
        measured = np.array([one.values[path] for path in paths])
        residuals = (found.values[:, one.place] - measured) * weights[:, None]
        slopes = found.derivatives[:, :, one.place] * weights[:, None, None] * self.slopes(x)[:, None]
        return residuals.ravel(), np.swapaxes(slopes, 1, 2).reshape(-1, len(x))

    def residuals(self, x: FloatArray) -> FloatArray:
        """Return weighted residuals, and what holds open combinations; infinite ones where the scene cannot run."""
        try:
            found, slopes = self.look(x)
        except AtwoodError as error:
            self.error = error
            return np.full(self.samples + len(x), np.inf)
        return np.concatenate([found, _held(slopes) @ (x - self.first)])

    def derivatives(self, x: FloatArray) -> FloatArray:
        """Return the derivatives of `residuals`."""
        slopes = self.look(x)[1]
        return np.vstack([slopes, _held(slopes)])

    def go(self, loss: str, most: int) -> Fit:
        """Return the fit."""
        first = np.clip(self.unknowns(np.array([one.value for one in self.columns])), self.low, self.high)
        self.first = first
        self.look(first)  # what keeps the scene from running at all is said
        made = scipy.optimize.least_squares(
            self.residuals,
            first,
            self.derivatives,
            bounds=(self.low, self.high),
            loss=loss,  # type: ignore[arg-type]  # one of its words
            xtol=1e-12,
            ftol=1e-12,
            gtol=1e-12,
            max_nfev=most,
        )
        if made.status == 0:
            raise SolveError(
                f"after {most} sets of values the fit still changes",
                where=self.assembly.flat.name,
                advice="Start nearer, give bounds, or more max_evaluations."
                + (f" One could not run: {self.error.message}." if self.error is not None else ""),
            )
        return self._finished(made)

    def _finished(self, made: Any) -> Fit:
        residuals, slopes = made.fun[: self.samples], made.jac[: self.samples]
        paths = [one.path for one in self.columns]
        inverse, open_directions = _determined(slopes)  # a robust loss has scaled them
        free = len(residuals) - (len(paths) - len(open_directions))
        # A robust loss has scaled what least_squares returns: its cost is half the sum of what counts.
        variance = 2.0 * made.cost / free if free > 0 else np.nan
        by_unknown, found = self.slopes(made.x), self.values(made.x)
        covariance = variance * inverse * np.outer(by_unknown, by_unknown)
        is_start = np.array([one.is_start for one in self.columns])
        sizes = np.where(is_start | (found == 0.0), self.scales, np.abs(found))
        undetermined = []
        for direction in open_directions:
            along = direction * by_unknown / sizes
            along = along / along[np.argmax(np.abs(along))]
            undetermined.append({path: float(one) for path, one in zip(paths, along, strict=True) if abs(one) > 1e-6})
        errors = np.sqrt(np.maximum(0.0, np.diag(covariance)))
        for one in undetermined:
            errors[[paths.index(path) for path in one]] = np.inf
        left = -residuals
        by_path, place = [], 0
        for experiment in self.experiments:
            own = {}
            for path, values in experiment.values.items():
                own[path] = left[place : place + len(values)] / self.weights[path]
                place += len(values)
            by_path.append(own)
        return Fit(
            scene=self.assembly.flat.name,
            values=dict(zip(paths, found.tolist(), strict=True)),
            errors=dict(zip(paths, errors.tolist(), strict=True)),
            units={one.path: one.unit for one in self.columns},
            covariance=covariance,
            undetermined=tuple(undetermined),
            experiments=self.experiments,
            residuals=tuple(by_path),
            weights=self.weights,
            deviation=float(np.sqrt(variance)),
            evaluations=int(made.nfev),
            message=str(made.message),
            assembly=self.changed(made.x),
        )


def _even(slopes: FloatArray) -> tuple[Decomposition, FloatArray, NDArray[np.bool_]]:
    """Return the decomposition of columns in units of their own size, these units, and which values are clear.

    A column that moves no datum is zero.
    """
    sizes = np.linalg.norm(slopes, axis=0)
    moves = sizes > tolerances.RANK * np.max(sizes, initial=0.0)
    units = np.where(moves, sizes, 1.0)
    found = decompose(np.where(moves, slopes / units, 0.0), is_whole=False)
    return found, units, found.values > tolerances.CLEAR * np.max(found.values, initial=0.0)


def _held(slopes: FloatArray) -> FloatArray:
    """Return rows that hold combinations that are not determined where they began, as firmly as data hold others."""
    found, units, clear = _even(slopes)
    across = np.linalg.qr((found.right[~clear] / units).T)[0]
    return np.asarray(np.max(units) * across @ across.T)


def _determined(slopes: FloatArray) -> tuple[FloatArray, list[FloatArray]]:
    """Return the inverse of ``J^T J`` where the data determine something, and the directions where they do not."""
    found, units, clear = _even(slopes)
    right = found.right[clear] / units
    inverse = (right.T / found.values[clear] ** 2) @ right
    basis = (found.right[~clear] / units).copy()
    for row in range(len(basis)):  # combinations of as few values as there can be
        pivot = int(np.argmax(np.abs(basis[row]) * units))
        basis[row] /= basis[row, pivot]
        for other in range(len(basis)):
            if other != row:
                basis[other] -= basis[other, pivot] * basis[row]
    return inverse, list(basis)


def _ends(one: Column, bounds: Any) -> tuple[float, float]:
    """Return the bounds of a value in SI units."""
    if bounds is None or bounds == "":
        return -np.inf, np.inf
    try:
        low, high = range_of(bounds) if isinstance(bounds, str) else bounds
        ends = tuple(
            parse_quantity(end, parse_unit(one.unit or "1"), one.path)
            if isinstance(end, str)
            else (side if end is None else number().read(end))
            for end, side in ((low, -np.inf), (high, np.inf))
        )
    except AtwoodError as error:
        raise UsageError(error.message, where=one.path, advice=error.advice) from None
    except Exception:
        raise UsageError(
            f"{bounds!r} are no bounds", where=one.path, advice="Give two numbers, low and high."
        ) from None
    if not ends[0] < ends[1]:
        raise UsageError(f"its bounds {ends[0]:g} and {ends[1]:g} leave nothing between them", where=one.path)
    return float(ends[0]), float(ends[1])


def _weights(experiments: tuple[Measured, ...], given: Mapping[str, float] | None) -> dict[str, float]:
    """Return the weight of each quantity."""
    every: dict[str, list[FloatArray]] = {}
    for one in experiments:
        for path, values in one.values.items():
            every.setdefault(path, []).append(values)
    stray = [path for path in given or {} if path not in every]
    if stray:
        raise UsageError("it has a weight and no data", where=stray[0], advice=f"There are {', '.join(every)}.")
    found = {}
    for path in every:
        if given is not None and path in given:
            found[path] = _positive(given[path], path)
            continue
        joined = np.concatenate(every[path])
        spread = float(np.std(joined)) or float(np.max(np.abs(joined))) or 1.0
        found[path] = 1.0 / spread
    return found


def _positive(value: Any, path: str) -> float:
    try:
        found: float = number(above=0.0).read(float(value) if isinstance(value, str) else value)
    except Exception:
        raise UsageError(f"{value!r} is no weight", where=path, advice="Give a number above 0.") from None
    return found
