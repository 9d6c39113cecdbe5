"""Equations of scenes with gaps and slips for implicit methods, whose steps end where they end.

Explicit steps are taken onto gaps that are closed and onto what sticks. In implicit ones the equations see to it:
``q' = B (u - k d(g))`` and ``u' = a - k d(g')`` with a rate k and the shortest displacement d that undoes an error.
That changes nothing where g and g' are zero, and nears them elsewhere, however stiffly (U. Ascher, H. Chin and
S. Reich, Stabilization of DAEs and invariant manifolds, Numerische Mathematik 67, 1994). Which rows hold is said by the
masks, as in all programs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from atwood.expr import Expression
from atwood.forms.assembly import Assembly
from atwood.forms.caches import Key, as_by_hand
from atwood.forms.constrained import nearest
from atwood.forms.loose import is_loose, loose_equations, loosened
from atwood.forms.program import FormProgram, Pull
from atwood.forms.residuals import NullSpaceProgram, dae_form, keep_constraints, null_space_program, reduced_form
from atwood.lazy_dataclasses import replace
from atwood.mechanics.dynamics.equations import Constraint, Equations

_FORM: Key[FormProgram] = Key("programs of the form at gaps and slips")

_Rows = tuple[Equations, Sequence[Expression], tuple[Expression, ...], Callable[[], Pull]]
"""Equations, equations of motion, parameters, and what makes the pull."""


def form_at_contacts(
    assembly: Assembly, kept: Sequence[int] | None, dependent: Sequence[int], dependent_speeds: Sequence[int]
) -> FormProgram:
    """Return the programs of a scene with gaps and slips for implicit methods; see `Assembly.form_program`.

    Unless nothing touches, slips or sticks, the rate of the pull in 1/s and the size of a displacement along each speed
    follow the parameters of the scene.
    """

    def make() -> FormProgram:
        equations, rows, parameters, pull = _rows(assembly, kept)
        name = f"{assembly.flat.name} ({assembly.form})"
        if assembly.form == "reduced":
            made = reduced_form(name, equations, parameters, lambda: rows, dependent, dependent_speeds, pull)
        else:
            tidy = partial(as_by_hand, equations, parameters)
            made = dae_form(name, equations, parameters, assembly.level, tidy, pull)
        return made.with_lock(assembly.shared.lock)

    about = None if kept is None else tuple(kept), tuple(dependent), tuple(dependent_speeds), is_loose(assembly)
    return assembly.shared.get(_FORM, make, *about)


def null_space_at_contacts(assembly: Assembly, kept: Sequence[int]) -> NullSpaceProgram:
    """Return what the reduced form of such a scene with loops is made of."""
    equations, rows, parameters, pull = _rows(assembly, kept)
    return null_space_program(f"{assembly.flat.name} (reduced)", equations, parameters, rows, pull())


def _rows(assembly: Assembly, kept: Sequence[int] | None) -> _Rows:
    """Return the equations of a form with some of its constraints: where nothing touches, or of all sets."""
    own = assembly.own_equations
    rows = assembly.rows if assembly.form == "reduced" else own.rows
    if is_loose(assembly):
        own, rows = loose_equations(assembly, rows)
        own = replace(own, rows=rows, rows_with_multipliers=tuple(loosened(assembly, own.rows_with_multipliers)))
    equations = own if kept is None else keep_constraints(own, kept)
    if not equations.contacts:
        return equations, rows, assembly.parameters, Pull
    names = ["rate of the pull", *(f"size of {one.name}" for one in equations.speed_names)]
    rate, *sizes = more = tuple(map(equations.graph.symbol, names))
    return equations, rows, (*assembly.parameters, *more), lambda: pull_of(equations, rate, sizes)


def pull_of(equations: Equations, rate: Expression, sizes: Sequence[Expression]) -> Pull:
    """Return what takes a motion onto gaps that are closed, and onto what sticks, at a rate in 1/s.

    Constraints have rows or coordinates of their own: the displacements keep to them, and undo none of their errors.
    """
    zero, one = equations.graph.zero, equations.graph.one
    rows = [(each, one, zero, zero) for each in equations.constraints]
    for each in equations.contacts:
        value = each.row.value
        rows.append((each.row, each.mask, zero if value is None else value, each.row.rate))

    def undoing(some: Sequence[tuple[Constraint, Expression, Expression]]) -> list[Expression]:
        held, masks, errors = zip(*some, strict=True)
        found = nearest(equations, held, errors, sizes, masks)
        return [rate * (share * size) for share, size in zip(found, sizes, strict=True)]

    holding = [row for row in rows if row[0].holonomic and row[0].value is not None]
    moved = undoing([(row, mask, value) for row, mask, value, _ in holding]) if holding else [zero] * len(sizes)
    changed = undoing([(row, mask, speed) for row, mask, _, speed in rows])
    return Pull(
        {u: u - by for u, by in zip(equations.speeds, moved, strict=True)},
        {a: a + by for a, by in zip(equations.accelerations, changed, strict=True)},
    )
