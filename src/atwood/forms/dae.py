"""The dae form: constraints stay, with one Lagrange multiplier each (Lagrange's equations of the first kind)."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence

from atwood.errors import UsageError, suggestion
from atwood.expr import Expression, depends_on, live, select, sqrt, substitute
from atwood.forms.program import FormProgram, Level, either_sign, kinematic_rows, make_form_program
from atwood.lazy_dataclasses import replace
from atwood.mechanics.dynamics.equations import Equations

LEVELS: tuple[Level, ...] = ("ggl", "index1", "index1-projected")

_TINY = 1e-300
"""In place of a square that is zero."""


def check_level(level: str, form: str) -> None:
    """Refuse a level that would change nothing."""
    if form == "reduced" and level != "ggl":
        raise UsageError(
            f"the reduced form has no levels, and no {level!r}: its constraints are eliminated",
            advice="Give form='dae' with it, or leave level out.",
        )


def dae_form(
    name: str,
    equations: Equations,
    parameters: Collection[Expression],
    level: str,
    tidy: Callable[[Sequence[Expression]], list[Expression]] = list,
) -> FormProgram:
    """Return the dae form of a scene at a level.

    ``ggl``, the stabilised index-2 form of Gear, Gupta and Leimkuhler (J. Comput. Appl. Math. 12, 1985), holds
    position and velocity constraints, with a second set of multipliers that shifts positions onto the constraints.
    ``index1`` holds the constraints' second derivative and drifts; ``index1-projected`` is the same, with what comes
    out of it projected.
    """
    if level not in LEVELS:
        raise UsageError(f"there is no level {level!r} of the dae form", advice=suggestion(level, LEVELS))
    multipliers = equations.multipliers
    rows = _smooth_at_zero(equations.rows_with_multipliers, multipliers) or equations.rows
    dynamic = [r - f for r, f in zip(rows, equations.constraint_rows, strict=True)]
    if not multipliers:
        return make_form_program(name, "dae", "ggl", equations, parameters, tidy(kinematic_rows(equations) + dynamic))
    if level == "ggl":
        kinematic, extra = _shifted(equations)
        values = [one.value for one in equations.constraints if one.value is not None]
        held = values + [one.rate for one in equations.constraints]
    else:
        kinematic, extra = kinematic_rows(equations), ()
        held = [one.second for one in equations.constraints]
    held = [either_sign(one) for one in held]
    chosen: Level = "ggl" if level == "ggl" else ("index1" if level == "index1" else "index1-projected")
    residual = tidy(kinematic + dynamic + held)
    return make_form_program(name, "dae", chosen, equations, parameters, residual, multipliers, extra)


def _smooth_at_zero(rows: Sequence[Expression], multipliers: Sequence[Expression]) -> list[Expression]:
    """Return rows in which roots of multipliers, such as the size of a force, have the slope zero at zero.

    Newton's method asks for it where nothing presses; the values are the same but for 1e-150.
    """
    if not rows:
        return []
    roots = [node for node in live(rows) if node.operation == "sqrt" and depends_on(node, multipliers)]
    inside = {root: root.arguments[0] for root in roots}
    guarded = {root: sqrt(select(one > 0.0, one, _TINY)) for root, one in inside.items()}
    return substitute(list(rows), guarded) if guarded else list(rows)


def _shifted(equations: Equations) -> tuple[list[Expression], tuple[Expression, ...]]:
    """Return the kinematic rows that keep positions on the constraints, and the multipliers that do so."""
    symbols: dict[Expression, Expression] = {
        one.multiplier: equations.graph.symbol(f"mu:{one.multiplier.name}")
        if one.value is not None
        else equations.graph.zero
        for one in equations.constraints
    }
    shift = substitute(list(equations.constraint_rows), symbols)
    return kinematic_rows(equations, shift=shift), tuple(s for s in symbols.values() if s.is_symbol)


def keep_constraints(equations: Equations, kept: Sequence[int]) -> Equations:
    """Return the equations with some of their constraints only; the multipliers of the others are zero."""
    chosen = set(kept)
    gone = {one.multiplier: 0.0 for i, one in enumerate(equations.constraints) if i not in chosen}
    if not gone:
        return equations
    return replace(
        equations,
        constraints=tuple(one for i, one in enumerate(equations.constraints) if i in chosen),
        constraint_rows=tuple(substitute(list(equations.constraint_rows), gone)),
    )
