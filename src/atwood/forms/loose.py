"""Equations of scenes with gaps and slips as they are where nothing touches, slips or sticks.

Programs for all states have rows for every gap and slip. Those for none are the shorter ones, and are derived from the
same equations with zeros for these states, so that what is far away costs nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

from atwood.expr import Expression, substitute
from atwood.forms.assembly import Assembly, FormName
from atwood.forms.balance_program import BalanceProgram, balance_program
from atwood.forms.caches import Key
from atwood.lazy_dataclasses import replace
from atwood.mechanics.dynamics.equations import ContactRow, Equations
from atwood.model.declare.contact_laws import state_names

_STATES: Key[tuple[int, ...]] = Key("states of gaps and slips")
_LOOSE: Key[bool] = Key("whether nothing touches")
_BALANCE: Key[BalanceProgram] = Key("balance of forces where nothing touches")
_WHOLE: Key[Assembly] = Key("the scene with the programs for all states")


def state_paths(one: ContactRow) -> tuple[str, ...]:
    """Return the paths of the discrete states of a gap, or of a slip: its state, then its direction."""
    return tuple(f"{one.row.key[0]}.{name}" for name in state_names(one.law))


def _states(assembly: Assembly) -> tuple[int, ...]:
    """Return which discrete states are those of gaps and slips."""

    def find() -> tuple[int, ...]:
        paths = {path for one in assembly.own_equations.contacts for path in state_paths(one)}
        return tuple(i for i, one in enumerate(assembly.discrete_states) if one.path in paths)

    return assembly.shared.get(_STATES, find)


def is_loose(assembly: Assembly) -> bool:
    """Return whether a scene has gaps or slips, and none of them touches, slips or sticks."""

    def find() -> bool:
        places, held = _states(assembly), assembly.held_now
        return bool(places) and not any(held[i] for i in places)

    return assembly.kept.get(_LOOSE, find)


def in_no_contact(assembly: Assembly) -> Assembly:
    """Return a scene in which nothing touches, slips or sticks."""
    held = list(assembly.held_now)
    for place in _states(assembly):
        held[place] = 0.0
    return assembly.with_held(held)


def kept_touching(assembly: Assembly) -> Assembly:
    """Return a scene in which nothing touches, slips or sticks, with the programs for all states."""
    if not is_loose(assembly):
        return assembly

    def make() -> Assembly:
        made = replace(assembly)
        made.kept.get(_LOOSE, lambda: False)
        return made

    return assembly.kept.get(_WHOLE, make)


def has_touched(assembly: Assembly) -> bool:
    """Return whether a scene has gaps or slips, and one of them touches, slips or sticks."""
    return bool(assembly.own_equations.contacts) and not is_loose(assembly)


def loosened(assembly: Assembly, values: Sequence[Expression], form: FormName | None = None) -> list[Expression]:
    """Return expressions, in its own coordinates or others, as they are in the present states, if these are all zero.

    Else they stand as they are.
    """
    if not is_loose(assembly):
        return list(values)
    equations, states = assembly.in_coordinates(form or assembly.form), assembly.discrete_states
    known = {equations.read.get(one, one) for one in equations.contact_multipliers}
    zeros = {one: equations.graph.zero for one in known if not one.is_constant}
    without = substitute(list(values), zeros)
    return substitute(without, {states[i].symbol: equations.graph.zero for i in _states(assembly)})


def balance_now(assembly: Assembly, form: FormName) -> BalanceProgram:
    """Return the balance of forces in the coordinates of either form, as it is in the present states."""
    return _loose_balance(assembly, form) if is_loose(assembly) else assembly.balance(form)


def balance_with_masses(assembly: Assembly, form: FormName) -> BalanceProgram:
    """Return the shortest balance of forces that has the masses, which are those of all states."""
    return _loose_balance(assembly, form) if assembly.own_equations.contacts else assembly.balance(form)


def _loose_balance(assembly: Assembly, form: FormName) -> BalanceProgram:
    def make() -> BalanceProgram:
        equations = assembly.in_coordinates(form)
        rows = tuple(loosened(assembly, equations.rows, form))
        return balance_program(f"{assembly.flat.name} ({form})", replace(equations, rows=rows), assembly.parameters)

    return assembly.shared.get(_BALANCE, make, form)


def loose_equations(assembly: Assembly, rows: Sequence[Expression]) -> tuple[Equations, tuple[Expression, ...]]:
    """Return the equations of the form, and equations of motion, as they are in the present states."""
    equations = assembly.own_equations
    if not is_loose(assembly):
        return equations, tuple(rows)
    found = loosened(assembly, [*rows, *equations.rates])
    rates = tuple(found[len(rows) :])
    return replace(equations, rates=rates, contacts=()), tuple(found[: len(rows)])
