"""The conformance test: a component against all that it says, in every space, and run in both forms on a test bench."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Iterator
from typing import Any, get_args

import numpy as np

from atwood.arguments import ANYTHING, FLAG, show, takes
from atwood.checking.bench import on_bench
from atwood.checking.forces import in_motion, wrong_forces, wrong_on_expressions
from atwood.checking.samples import CheckReport, Finding, as_part, in_space, samples_of
from atwood.checking.units import wrong_units
from atwood.consistency.check import contradictions, wrong_names
from atwood.consistency.trials import Trial, make_trial
from atwood.errors import AtwoodError, ParameterError, SolveError, StartError, TopologyError, UsageError
from atwood.lazy_dataclasses import replace
from atwood.model.compose.composite import Model
from atwood.model.declare.component import Component
from atwood.model.declare.connectors import Frame, Shaft
from atwood.model.declare.laws import Kind, numbers_in
from atwood.model.local.flatten import Part
from atwood.model.values.outline import Outline
from atwood.model.values.space import Space, make_space
from atwood.model.values.units import parse_unit
from atwood.pipeline import simulate
from atwood.result.result import Result

STATES = 3
"""At how many random states laws are looked at, for each set of values."""


class _Book:
    """Takes down what was compared and what was found; the same thing is taken down once."""

    def __init__(self) -> None:
        self.counts: dict[str, int] = {}
        self.found: dict[tuple[str, ...], Finding] = {}

    def add(self, test: str, results: Iterable[Finding | None]) -> None:
        """Count comparisons, and keep what they found."""
        for one in results:
            self.counts[test] = self.counts.get(test, 0) + 1
            if one is not None:
                self.found.setdefault((one.gravity, one.test, one.law, one.space), one)


@takes(component=ANYTHING, run=FLAG)
def check(component: Component | type[Component], *, run: bool = True) -> CheckReport:
    """Test a component as the parts of the library are tested.

    Its laws are evaluated at random states, with its own values and with others within their bounds, in each space that
    it exists in and in each mode: units of what laws return; joints against the constraints that they solve;
    observables against coordinates and rates; forces against energies; Rayleigh functions, which must not drive; laws
    on expressions against laws on numbers; updates, which must give numbers; outlines. Then it runs on a bench, with
    a body on each connector, in both forms, which have to say the same and to balance energy.

    Parameters
    ----------
    component
        A component, or a class of which one can be made: then missing values are guessed.
    run
        Whether to run it on a test bench, which takes most of the time: about a second.

    Returns
    -------
    CheckReport
        What is wrong (`failures`), and what may be meant (`notes`).

    Raises
    ------
    UsageError
        If it is no component, or a model, whose parts are to be checked one by one.

    Examples
    --------
    >>> import atwood
    >>> from atwood_library import Spring
    >>> atwood.check(Spring).ok
    True
    """
    cls = component if isinstance(component, type) else type(component)
    if not issubclass(cls, Component):
        raise UsageError(f"{show(component)} is no component", advice="Give a Component, or a class of them.")
    if issubclass(cls, Model):
        raise UsageError(f"{cls.__name__} is a model", advice="Check the classes of its parts, one by one.")
    book = _Book()
    runs, fully = 0, 0
    try:
        samples = list(samples_of(component))
    except AtwoodError:
        raise
    except Exception as error:  # an __init__ of its own
        advice = "Check an instance of it; parameters need no __init__."
        raise UsageError(f"{cls.__name__} cannot be made ({error})", where=cls.__name__, advice=advice) from error
    for sample in samples:
        names = [_failure("names", error) for error in wrong_names(sample.component, cls.__name__)]
        book.add("names", names or [None])
        if names:
            break  # everything else goes by names
        book.add("outline", _wrong_outline(sample.component))
        measured = sample.full or not any(one.full for one in samples)
        runs, fully = runs + 1, fully + sample.full
        for space_name in cls.spaces:
            placed = in_space(sample.component, space_name)
            with_runs = run and (runs == 1 or (sample.full and fully == 1))
            _look(as_part(placed), _space_for(placed, space_name), book, measured, with_runs)
    if not any(cls.laws(kind) for kind in get_args(Kind)):
        book.add("content", [Finding("note", "content", "", "", "it has no law, so that there is nothing to check")])
    findings = sorted(_merged(book.found.values()), key=lambda one: (one.gravity, one.test, one.law, one.space))
    return CheckReport(cls.__name__, tuple(cls.spaces), dict(book.counts), tuple(findings))


def _merged(findings: Iterable[Finding]) -> list[Finding]:
    """Return findings of which each is said once, with all spaces that it was made in."""
    spaces: dict[Finding, list[str]] = {}
    for one in findings:
        spaces.setdefault(replace(one, space=""), []).append(one.space)
    return [replace(one, space=", ".join(name for name in names if name)) for one, names in spaces.items()]


def _look(part: Part, space: Space, book: _Book, measured: bool, with_runs: bool) -> None:
    """Look at a component with one set of values in one space."""
    component = part.component
    wrong = [_failure("laws", error, space.name) for error in contradictions(part, space)]
    book.add("laws", wrong or [None])
    try:
        trials = [make_trial(part, space, seed) for seed in range(STATES)]
        for mode in component.modes or ("",):
            for trial in trials:
                if measured:  # with all that can be left out, which may stand for a number with a unit
                    book.add("units", wrong_units(trial, mode))
                book.add("forces", wrong_forces(trial, mode))
                book.add("updates", wrong_updates(trial, mode))
            book.add("derivatives", wrong_on_expressions(trials[0], mode))
    except AtwoodError as error:
        book.add("laws", [_failure("laws", error, space.name)])
        return
    if with_runs and not wrong and (component.connectors()):
        book.add("both forms", wrong_runs(trials))


def _failure(test: str, error: AtwoodError, space: str = "") -> Finding:
    law = error.where.rpartition(".")[2] if "." in error.where else ""
    text = f"{error.message}. {error.advice}" if error.advice else error.message
    return Finding("failure", test, law, space, text)


def _wrong_outline(component: Component) -> Iterable[Finding | None]:
    """Yield an error if a component cannot say what it looks like."""
    if type(component).outline is Component.outline:
        return
    try:
        made: Any = component.outline()
    except Exception as error:  # whatever a method of somebody's own can raise
        yield Finding("failure", "outline", "outline", "", f"it raises {type(error).__name__}: {error}")
        return
    if made is None or isinstance(made, Outline):
        yield None
    else:
        yield Finding("failure", "outline", "outline", "", f"it returns {made!r} instead of an Outline")


def _space_for(component: Component, name: str) -> Space:
    """Return a space for a component: a line along one of its directions, or any line."""
    for spec in component.parameter_specs().values():
        value = component.parameters()[spec.name]
        if spec.direction and not spec.turning and value is not None:
            return make_space(name, value)
    return make_space(name, (0.6, 0.0, 0.8))


TOLERANCE = 1e-4
"""Relative: runs at 1e-9 of both forms differ by less, also where what is on the bench is nearly unstable."""
LENGTH_OF_RUN = 0.05
"""In seconds, with speeds of about a length, or a radian, a second."""


def wrong_runs(trials: list[Trial]) -> Iterator[Finding | None]:
    """Yield what is wrong with a run in both forms, or None; a note where no start was found."""
    space, reason = trials[0].space.name, ""
    if space == "line" and any(isinstance(one, Shaft) for one in trials[0].component.connectors().values()):
        return  # on a line nothing turns
    for trial in trials:
        results: list[Result] = []
        try:
            for form in ("reduced", "dae"):
                results.append(_run(trial, form))
        except (StartError, SolveError) as error:
            if results:
                message = f"it runs in the reduced form, and not in the dae form: {error}"
                yield Finding("failure", "both forms", "", space, message)
                return
            reason = reason or str(error)
            continue
        except TopologyError as error:
            if all(isinstance(one, Frame) for one in trial.component.connectors().values()) and _is_rigid(trial):
                return  # what stands still
            yield Finding("failure", "both forms", "", space, str(error))
            return
        except ParameterError:
            return  # values within their bounds, which do not go together
        except AtwoodError as error:
            yield Finding("failure", "both forms", "", space, str(error))
            return
        yield from _compared(results[0], results[1], space, trial.length)
        return
    yield Finding("note", "both forms", "", space, f"it could not be run on the test bench: {reason}")


def _run(trial: Trial, form: str) -> Result:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return simulate(on_bench(trial), form=form, t_end=LENGTH_OF_RUN, outputs=3, rtol=1e-9)


def _compared(one: Result, other: Result, space: str, length: float) -> Iterator[Finding | None]:
    wrong = False
    for path in one.paths:
        if path not in other:
            continue
        a, b = np.asarray(one[path]), np.asarray(other[path])
        count = min(len(a), len(b))
        a, b = a[:count], b[:count]
        off = a - b
        if one.unit(path) == "rad":
            off = np.remainder(off + np.pi, 2.0 * np.pi) - np.pi
        size = float(np.nanmax(np.abs(np.concatenate([a, b])), initial=0.0))
        size = max(size, length ** parse_unit(one.unit(path)).exponents[1])  # masses and times are some kg and s
        bad = (np.isnan(a) != np.isnan(b)) | (np.abs(np.nan_to_num(off)) > TOLERANCE * size)
        if bad.any():
            i = int(np.argmax(bad))
            name = path.removeprefix("part.")
            law = name if name != path else ""  # another one is of a body on the bench
            message = f"{name} is {a[i]:.6g} {one.unit(path)} in the reduced form, and {b[i]:.6g} in the dae form"
            yield Finding("failure", "both forms", law.split(".")[0], space, message)
            wrong = True
    if not wrong:
        yield None
    for result in (one, other):
        ledger = result.energy
        drift = float(np.ptp(ledger.kinetic + ledger.potential - ledger.work))
        drift /= max(*(float(np.ptp(part)) for part in (ledger.kinetic, ledger.potential, ledger.work)), length**2)
        if not drift < 1e-3 and not result.events:
            message = f"energy and work differ by {drift:.2g} of what the scene exchanges ({result.form} form)"
            yield Finding("failure", "power", "", space, message)
        else:
            yield None


def _is_rigid(trial: Trial) -> bool:
    """Return whether a component is a rigid joint, which may hold all there is."""
    return any(law.options.rigid for law in trial.component.laws("joint") if law.holds_in(trial.space.name))


def wrong_updates(trial: Trial, mode: str) -> Iterator[Finding | None]:
    """Yield, for each update law, what is wrong with what it returns, or None."""
    for law in trial.component.laws("update"):
        if law.holds_in(trial.space.name) and law.acts_in(mode):
            specs = trial.component.state_specs()
            count = sum(len(specs[name].names(trial.part.values)) for name in law.options.sets)
            text = _wrong(trial, law.name, count)
            yield Finding("failure", "updates", law.name, trial.space.name, text) if text else None


def _wrong(trial: Trial, name: str, count: int) -> str:
    """Return what is wrong, in words, or nothing."""
    try:
        given = getattr(in_motion(trial), name)()
    except Exception as error:  # whatever a law of somebody's own can raise
        return f"it raises {type(error).__name__}: {error}"
    values = list(numbers_in(given))
    if len(values) != count:
        return f"it returns {len(values)} values where it sets {count}"
    for value in values:
        try:
            if math.isfinite(float(value)):
                continue
        except (TypeError, ValueError):
            return f"it returns {value!r} where a number is wanted"
        return f"it returns {float(value)!r}, which no state can be"
    return ""
