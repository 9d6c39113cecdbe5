"""A reference that is far more accurate than what is compared with it, and how accurate it is itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from atwood.arrays import FloatArray
from atwood.errors import AtwoodError, SolveError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.model.compose.composite import Model
from atwood.model.local.flatten import FlatScene
from atwood.pipeline import simulate
from atwood.result.accuracy import compared_paths
from atwood.result.result import Result

Assembled = Callable[[str, str], Assembly]
"""Gives a scene in a form and at a level of the constraints."""


TIGHT = ((1e-12, "reduced"), (1e-11, "reduced"), (1e-11, "dae"), (1e-10, "reduced"))
"""Solutions that a reference is taken from: the first that succeeds, and the second to estimate its error."""

_BEFORE = 0.99
"""Where an event stops the scene, so much of the time before it is compared: less accurate runs meet it earlier."""

_COMPARED = ("m", "rad", "1")
"""Units of what is compared: positions, angles, axes."""

_FEW = 4
"""Up to so many speeds it is looked whether all coordinates but one are ignorable."""

_ROUNDING = 1e-14
"""Relative: the error of a quadrature in each period, at least."""

_HOLDS = 1e-6
"""A closed form that misses a tight solution by more belongs to another start."""


@dataclass(frozen=True, eq=False)
class Reference:
    """What runs are compared with.

    Attributes
    ----------
    kind
        ``"closed form"``, ``"quadrature"`` or ``"tight solution"``.
    description
        What it is, in words.
    time
        Output times, s.
    quantities
        Positions, angles and axes by path.
    scales
        Size of each: the extent of the scene for a length, one for an angle in radians or an axis.
    error
        Estimate of its own error, scaled like the errors of the rows.
    note
        What else there is to say about it; empty mostly.
    """

    kind: str
    description: str
    time: FloatArray
    quantities: Mapping[str, FloatArray]
    scales: Mapping[str, float]
    error: float
    note: str = ""


def find_reference(
    scene: Model,
    flat: FlatScene,
    assembled: Assembled,
    t_end: float,
    outputs: int,
    max_seconds: float | None,
    watch: Callable[[str], object],
) -> Reference:
    """Return the reference of a scene: its closed form where it has one that holds, a quadrature, or a solution."""
    tight, note = _tight_solutions(flat, assembled, t_end, outputs, max_seconds, watch)
    (best, said), (second, other) = tight
    paths = compared_paths(best.assembly)
    scales = {path: best.start.length if best.unit(path) == "m" else 1.0 for path in paths}
    time = np.linspace(best.time[0], best.time[-1], outputs)
    quantities = table_at(best, paths, time)
    error = scaled_difference(quantities, table_at(second, paths, time), scales)
    given = {path: values[_places(best, time)] for path, values in _closed_form(scene, best).items()}
    if given:
        known = {path: values for path, values in given.items() if path in best and best.unit(path) in _COMPARED}
        known_scales = {path: best.start.length if best.unit(path) == "m" else 1.0 for path in known}
        miss = scaled_difference(known, table_at(best, known, time), known_scales)
        if known and miss < max(_HOLDS, 100.0 * error):
            text = f"closed form of the scene; {said} agrees with it to {miss:.1e}"
            return Reference("closed form", text, time, known, known_scales, 1e-15, note)
        note = f"{note} The closed form of the scene belongs to another start and is not used.".strip()
    done = _by_quadrature(assembled, best, time, paths)
    if done is not None:
        known, own_error = done
        miss = scaled_difference(known, table_at(best, known, time), scales)
        if miss < max(_HOLDS, 100.0 * error):
            text = f"quadrature of its effective potential; {said} agrees with it to {miss:.1e}"
            return Reference("quadrature", text, time, known, {path: scales[path] for path in known}, own_error, note)
    text = f"{said}; its error is at most about {error:.1e}, by {other}"
    return Reference("tight solution", text, time, quantities, scales, error, note)


def _tight_solutions(
    flat: FlatScene,
    assembled: Assembled,
    t_end: float,
    outputs: int,
    max_seconds: float | None,
    watch: Callable[[str], object],
) -> tuple[list[tuple[Result, str]], str]:
    """Return two tight solutions of the scene and what each is, and why they end earlier than asked for if they do."""
    found: list[tuple[Result, str]] = []
    reasons: list[str] = []
    note = ""
    for rtol, form in TIGHT:
        said = f"the {form} form at rtol {rtol:g}"
        watch(f"reference: {said}")
        try:
            result = run_form(assembled, form, "ggl", rtol, t_end, outputs, max_seconds)
            if result.status == "stopped" and not found:  # compare what comes before the event
                note = f"The comparison ends earlier than asked for: {result.message}."
                t_end = flat.t_start + _BEFORE * (float(result.time[-1]) - flat.t_start)
                result = run_form(assembled, form, "ggl", rtol, t_end, outputs, max_seconds)
        except AtwoodError as error:
            reasons.append(f"{said}: {error.message}")
            continue
        if result.status != "finished":
            reasons.append(f"{said}: {result.message or result.status}")
            continue
        found.append((result, said))
        if len(found) == 2:
            return found, note
    raise SolveError(
        f"no reference could be found ({'; '.join(reasons)})", where=flat.name, advice="Try a shorter t_end."
    )


def run_form(
    assembled: Assembled,
    form: str,
    level: str,
    rtol: float,
    t_end: float,
    outputs: Any,
    max_seconds: float | None,
    solver: str = "auto",
    samples: int = 400,
) -> Result:
    """Run a scene in one form."""
    result = simulate(
        assembled(form, level),
        t_end=t_end,
        rtol=rtol,
        outputs=outputs,
        max_seconds=max_seconds,
        solver=solver,
        samples=samples,
    )
    if result.status == "interrupted":  # who interrupts one run of a comparison means all of it
        raise KeyboardInterrupt
    return result


def table_at(result: Result, paths: Iterable[str], times: FloatArray) -> dict[str, FloatArray]:
    """Return quantities at output times that were asked for; just after an event, where one happens then."""
    places = _places(result, times)
    return {path: values[places] for path, values in result.table(paths).items()}


def _places(result: Result, times: FloatArray) -> NDArray[np.intp]:
    return np.searchsorted(result.time, times, side="right") - 1


def scaled_difference(
    one: Mapping[str, FloatArray], other: Mapping[str, FloatArray], scales: Mapping[str, float]
) -> float:
    """Return the largest scaled difference of two sets of trajectories."""
    return max((float(np.max(np.abs(one[path] - other[path]))) / scales[path] for path in one), default=0.0)


def errors_by_part(reference: Reference, result: Result) -> dict[str, float]:
    """Return the largest scaled difference from a reference in the quantities of each part."""
    parts, found = result.assembly.mechanism.locals_, dict[str, float]()
    given = table_at(result, reference.quantities, reference.time)
    for path, known in reference.quantities.items():
        part = path.rpartition(".")[0]
        while part not in parts and "." in part:  # of a vector's component the vector is left out, too
            part = part.rpartition(".")[0]
        own = scaled_difference({path: known}, given, reference.scales)
        found[part] = float(np.maximum(found.get(part, 0.0), own))
    return found


def _by_quadrature(
    assembled: Assembled, best: Result, time: FloatArray, paths: Sequence[str]
) -> tuple[dict[str, FloatArray], float] | None:
    """Return quantities by quadrature and their error, where the motion is one of one coordinate; None elsewhere."""
    assembly = assembled("reduced", "ggl")
    e = assembly.reduced
    if assembly.modes or best.events or e.constraints or not 0 < len(e.speeds) <= _FEW:
        return None
    from atwood.theory.reduction.reduced import reduced

    try:
        motion = reduced(assembly)
        known = motion.table(time, paths)
    except AtwoodError:  # most motions are none of one coordinate
        return None
    if not known:
        return None
    turns = max(1.0, float(time[-1] - time[0]) / motion.period)
    return known, max(_ROUNDING, 10.0 * motion.error) * turns


def _closed_form(scene: Model, result: Result) -> dict[str, FloatArray]:
    """Return the closed form of a scene at the output times; empty if it has none."""
    closed_form = getattr(scene, "closed_form", None)
    if not callable(closed_form):
        return {}
    with np.errstate(all="ignore"):
        given = closed_form(result.time)
    return {path: np.asarray(values, dtype=float) for path, values in given.items()}
