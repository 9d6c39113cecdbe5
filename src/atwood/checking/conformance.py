"""The conformance test: a component against all that it says, in every space, with several sets of values."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, get_args

from atwood.arguments import ANYTHING, FLAG, show, takes
from atwood.checking.expressions import wrong_on_expressions
from atwood.checking.forces import wrong_forces
from atwood.checking.report import CheckReport, Finding
from atwood.checking.runs import wrong_runs
from atwood.checking.samples import as_part, in_space, samples_of
from atwood.checking.units import wrong_units
from atwood.checking.updates import wrong_updates
from atwood.consistency.check import contradictions
from atwood.consistency.draws import make_trial
from atwood.consistency.names import wrong_names
from atwood.errors import AtwoodError, UsageError
from atwood.late import replace
from atwood.model.compose.composite import Model
from atwood.model.declare.component import Component
from atwood.model.declare.law import Kind
from atwood.model.local.flatten import Part
from atwood.model.values.outline import Outline
from atwood.model.values.space import Space, make_space

__all__ = ["check"]

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
