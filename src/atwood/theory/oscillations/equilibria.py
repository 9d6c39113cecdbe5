"""States of rest of a scene in symbols: V' = 0 solved in closed form, where each exists, and where it is stable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

from atwood.display import data_of, fitted
from atwood.errors import UnsupportedError, UsageError
from atwood.forms.assembly import Assembly
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy
from atwood.table import Shown, Table, table
from atwood.theory.formulas.page import aligned
from atwood.theory.formulas.printers import Sympy
from atwood.theory.formulas.reading import latex_of, text_of
from atwood.theory.oscillations.bifurcations import Bifurcation, State, find_bifurcations
from atwood.theory.oscillations.conditions import NoClosedFormError, Solution, solve_conditions
from atwood.theory.oscillations.rest import PlainEquations, expand, is_singular, plain_equations
from atwood.theory.oscillations.stability import stability_of


@dataclass(frozen=True, eq=False)
class SymbolicEquilibrium:
    """A state of rest as formulas of the parameters, which have the sign of their value.

    Attributes
    ----------
    values
        Coordinates by path, as expressions of sympy in the symbols of `equations`; a coordinate that may be anything is
        its own symbol.
    exists
        Where in the parameters it exists: a relation of sympy, or true.
    stable
        Where in the parameters no small deviation grows: a relation of sympy, true, or false; None if that is not
        decided to first order.
    free
        Paths of the coordinates that may be anything.
    numbers
        Coordinates with the values of the scene, m or rad; empty if the state does not exist with these.
    stability
        With the values of the scene: ``"stable"``, ``"unstable"``, ``"undecided"``, or ``"does not exist"``.
    """

    values: Mapping[str, Sympy]
    exists: Sympy
    stable: Sympy | None
    free: tuple[str, ...]
    numbers: Mapping[str, float]
    stability: str

    def to_data(self) -> dict[str, Any]:
        """Return it as plain data, formulas in the words of Python."""
        return data_of(self, "values", "exists", "stable", "free", "numbers", "stability")

    def __repr__(self) -> str:
        state = ", ".join(f"{path} = {text_of(value)}" for path, value in self.values.items())
        return fitted(f"<SymbolicEquilibrium {state}; stable: {said(self.stable)}; with these values {self.stability}>")


class SymbolicEquilibria(Shown, list[SymbolicEquilibrium]):
    """The states of rest of a scene as formulas."""

    def __init__(self, found: Sequence[tuple[SymbolicEquilibrium, State]], plain: PlainEquations) -> None:
        super().__init__(one for one, _ in found)
        self.scene, self._plain, self._states = plain.name, plain, [state for _, state in found]

    @cached_property
    def bifurcations(self) -> tuple[Bifurcation, ...]:
        """Where in the parameters states meet, appear, or begin to oscillate, by kind."""
        return tuple(find_bifurcations(self._plain, self._states))

    def to_data(self) -> list[dict[str, Any]]:
        """Return them as plain data, for JSON."""
        return [one.to_data() for one in self]

    def latex(self) -> str:
        """Return them and where they meet as an aligned block of LaTeX, a line for each."""
        rows = []
        for one in self:
            held = ((self._plain.letter(path), value) for path, value in one.values.items() if path not in one.free)
            state = r",\ ".join(latex_of(sympy.Eq(*pair, evaluate=False)) for pair in held)
            rows.append(rf"{state} &\quad {_where(one.exists, 0)} &\quad {_where(one.stable, 1)}")
        rows += [rf"\text{{{one.kind}}} &\quad {latex_of(one.condition)}" for one in self.bifurcations]
        return aligned(rows)

    def tables(self) -> tuple[Table, ...]:
        """Return each state, where it exists and where it is stable, and what it is with the values of the scene."""
        rows = [(state_of(self._plain, one), said(one.exists), said(one.stable), one.stability) for one in self]
        title = f"{self.scene}: {len(self)} state{'s' if len(self) != 1 else ''} of rest in closed form"
        headings = ("state", "exists where", "stable where", "with these values")
        first = table(headings, rows, title, [_SIGNS])
        change = [
            (f"{one.sense} {one.kind}".strip(), text_of(one.condition), ", ".join(str(k + 1) for k in one.states))
            for one in self.bifurcations
        ]
        return (first, table(("bifurcation", "where", "states"), change)) if change else (first,)

    __str__ = Shown.as_text


_SIGNS = "Parameters have the sign that they have in the scene; stable: no small deviation grows."


def state_of(plain: PlainEquations, one: SymbolicEquilibrium) -> str:
    """Return where a state of rest is as plain text, coordinates that may be anything last."""
    told = [f"{text_of(plain.letter(path))} = {text_of(v)}" for path, v in one.values.items() if path not in one.free]
    return ", ".join([*told, *(f"any {text_of(plain.letter(path))}" for path in one.free)])


def said(condition: Sympy | None) -> str:
    """Return a condition as plain text."""
    if condition is None:
        return "not decided to first order"
    words = {sympy.true: "always", sympy.false: "never"}
    return words.get(condition) or " and ".join(text_of(one) for one in sympy.And.make_args(condition))


def _where(condition: Sympy | None, number: int) -> str:
    if condition is None or condition in (sympy.true, sympy.false):
        words = ("", "") if condition is None else ("", "stable") if condition == True else ("", "unstable")  # noqa: E712
        return rf"\text{{{words[number]}}}" if words[number] else ""
    said = r",\ ".join(latex_of(one) for one in sympy.And.make_args(condition))
    return rf"\text{{{('exists for', 'stable for')[number]} }} {said}"


def find_symbolic(plain: PlainEquations) -> list[tuple[SymbolicEquilibrium, State]]:
    """Return the states of rest with what is said of them."""
    every = [(solution, described(plain, solution)) for solution in _solutions(plain)]
    found = [
        made
        for solution, made in every
        if made[1].expansion or (solution.free and not is_singular(plain, solution, of_pole=True))
    ]
    if not found:
        raise UsageError("it stays nowhere at rest", where=plain.name, advice="Look for a steady motion, with `trim`.")
    return found


def _where_it_exists(stable: Sympy | None, exists: Sympy) -> Sympy | None:
    """Return a condition without what the existence of a state says already."""
    if stable is None or stable in (sympy.true, sympy.false):
        return stable
    known = [one for one in sympy.And.make_args(exists) if one.is_Relational]
    strict = {(one.gts, one.lts) for one in known if one.is_Relational and one.func in (sympy.Gt, sympy.Lt)}
    parts = sympy.And.make_args(stable)
    if {(one.lts, one.gts) for one in parts} & {(one.gts, one.lts) for one in known}:
        return sympy.false
    return sympy.And(*(one for one in parts if (one.gts, one.lts) not in strict))


def _solutions(plain: PlainEquations) -> list[Solution]:
    try:
        return solve_conditions(plain.conditions, (*plain.coordinates, *plain.multipliers))
    except NoClosedFormError as problem:
        raise UnsupportedError(
            f"its conditions of rest have no closed form that one would find by hand: {problem}",
            where=plain.name,
            advice="Without `symbolic` states of rest are found in numbers.",
        ) from None


def described(plain: PlainEquations, solution: Solution) -> tuple[SymbolicEquilibrium, State]:
    """Return what is said of a state of rest in the symbols that people see, and in plain ones."""
    exists, expansion = sympy.And(*solution.conditions), expand(plain, solution)
    stable = None if expansion is None else _where_it_exists(stability_of(expansion), exists)
    paths = dict(zip(plain.coordinates, plain.paths, strict=True))
    free = tuple(paths[one] for one in solution.free if one in paths)
    numbers: dict[str, float] = {}
    known = {q: value for q, value in solution.values.items() if q in paths and not value.has(*plain.coordinates)}
    if plain.holds(exists):
        numbers = {paths[q]: plain.place(q, value) for q, value in known.items()}
    if not numbers and not free:
        stability = "does not exist"
    else:
        stability = "undecided" if stable is None else "stable" if plain.holds(stable) else "unstable"
    values = {path: plain.told(solution.values.get(q, q)) for q, path in paths.items()}
    told = None if stable is None else plain.told(stable)
    state = State(tuple(map(known.get, plain.coordinates)), exists, stable, expansion)
    return SymbolicEquilibrium(values, plain.told(exists), told, free, numbers, stability), state


def symbolic_equilibria(assembly: Assembly, symbols: Mapping[str, str] | None = None) -> SymbolicEquilibria:
    """Return the states of rest of a scene as formulas."""
    plain = plain_equations(assembly, symbols)
    return SymbolicEquilibria(find_symbolic(plain), plain)
