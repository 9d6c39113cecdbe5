"""The equations of motion of a scene on a page, in a notebook, and as plain data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from atwood.forms.lagrangian import rows_by_part
from atwood.theory.formulas import code, latex, page, text
from atwood.theory.formulas.page import Line, Matrix, Section
from atwood.theory.formulas.tree import Sum, Symbol, names_in

if TYPE_CHECKING:
    from atwood.theory.equations.equations import EquationsOfMotion

__all__ = ["as_data", "equation_lines", "html_of", "sections_of", "symbol_lines", "symbol_table"]

_NOTHING = ("", "")


def equation_lines(eq: EquationsOfMotion) -> list[Line]:
    """Return the equations of motion and the constraints."""
    return [Line(_NOTHING, one, "= 0") for one in (*eq.written.rows, *eq.written.constraints)]


def sections_of(eq: EquationsOfMotion) -> list[Section]:
    """Return all that is to be said of equations of motion."""
    written, found, notation = eq.written, eq.expressions, eq.notation
    sections = [_energies(eq)]
    own = [notation.velocities[u][0] for u in found.velocities]
    for title, letter, formulas in (("Momenta", "p", written.momenta), ("Generalized forces", "Q", written.forces)):
        lines = [
            Line((f"{letter}_{{{latex.letter(symbol)}}}", f"{letter}_{text.letter(symbol)}"), one)
            for symbol, one in zip(own, formulas, strict=True)
            if one.terms or letter == "p"
        ]
        if lines:
            sections.append(Section(title, tuple(lines)))
    lines = equation_lines(eq)
    sections.append(Section("Equations of motion", tuple(lines[: len(written.rows)])))
    if written.constraints:
        sections.append(Section("Constraints", tuple(lines[len(written.rows) :]), _multipliers(eq)))
    if found.has_angular_velocities or found.is_restricted:
        rates = [
            Line((latex.letter(symbol, 1), text.letter(symbol, 1)), one)
            for q, symbol, one in zip(
                found.coordinates, (notation.symbols[q] for q in found.coordinates), written.rates, strict=True
            )
            if q not in {found.coordinates[place] for place in found.moves if place is not None}
        ]
        sections.append(Section("Kinematics", tuple(rates)))
    sections.append(Section("Mass matrix", (Matrix(("M", "M"), eq.mass),)))
    if written.constraints:
        sections.append(Section("Constraint Jacobian", (Matrix(("G", "G"), eq.slopes),)))
    if eq.book.shared:
        names = [Line((latex.formula(name), text.formula(name)), value) for name, value in eq.book.shared]
        sections.append(Section("Shared terms", tuple(names)))
    return page.with_names(sections, [one.name for one in notation.legend])


def _energies(eq: EquationsOfMotion) -> Section:
    written = eq.written
    lines = [Line(("T", "T"), written.kinetic), Line(("V", "V"), written.potential)]
    note = "$L = T - V$."
    if written.linear.terms:
        lines.append(Line(("L_1", "L₁"), written.linear))
        note = "$L = T - V + L_1$."
    if written.rayleigh.terms:
        lines.append(Line(("R", "R"), written.rayleigh))
    return Section("Energies", tuple(lines), note)


def _multipliers(eq: EquationsOfMotion) -> str:
    """Return what the multipliers are."""
    said = []
    for one in eq.expressions.constraints:
        symbol = eq.notation.symbols[one.multiplier]
        sign = "-" if one.sign < 0 else ""
        said.append(f"`{one.key[0]}.{one.reaction}` is ${sign}{latex.letter(symbol)}$")
    return f"The multipliers $\\lambda$ have the generalized forces $G^T \\lambda$: {', '.join(said)}."


def _shown(eq: EquationsOfMotion) -> list[Symbol]:
    """Return the symbols that occur; parameters that nothing depends on do not."""
    written = eq.written
    formulas = [written.kinetic, written.potential, written.linear, written.rayleigh, *written.rows, *written.forces]
    formulas += [*written.constraints, *(value for _, value in eq.book.shared)]
    used = {name.symbol for name in names_in(formulas)}
    return [one for one in eq.legend if one.kind != "parameter" or one in used]


def symbol_table(eq: EquationsOfMotion) -> str:
    """Return the symbols as a table in Markdown."""
    rows = ["| symbol | stands for | unit | value |", "|---|---|---|---|"]
    for one in _shown(eq):
        value = "" if one.value is None else f"{one.value:.6g}"
        unit = "" if one.unit == "1" else one.unit
        rows.append(f"| ${latex.letter(one)}$ | `{one.path}` | {unit} | {value} |")
    return "\n".join(rows)


def symbol_lines(eq: EquationsOfMotion) -> list[str]:
    """Return the symbols in plain text, a line each."""
    rows = []
    for one in _shown(eq):
        unit = "" if one.unit == "1" else one.unit
        rows.append((text.letter(one), one.path, f"{one.value:.6g} {unit}" if one.value is not None else unit))
    widths = [max(page.width(row[i]) for row in rows) for i in range(2)]
    return [
        "  " + "  ".join(cell + " " * (width - page.width(cell)) for cell, width in zip(row, (*widths, 0), strict=True))
        for row in rows
    ]


def html_of(eq: EquationsOfMotion) -> str:
    """Return the energies and equations for a notebook; each term says on hovering from which parts it comes."""
    found, shares = eq.expressions, rows_by_part(eq.expressions)
    energies = {one.path: (one.kinetic, one.potential) for one in found.parts}
    lines = [
        Line((letter, letter), eq.formula(total, {path: both[i] for path, both in energies.items()}, True))
        for i, (letter, total) in enumerate((("T", found.kinetic), ("V", found.potential)))
    ]
    rows = [
        Line(_NOTHING, eq.formula(row, {path: share[k] for path, share in shares.items()}), "= 0")
        for k, row in enumerate(eq.residuals)
    ]
    shown = [Section("Energies", tuple(lines)), Section("Equations of motion", tuple(rows))]
    if eq.written.constraints:
        shown.append(Section("Constraints", tuple(equation_lines(eq)[len(rows) :])))
    return page.as_html(f"{eq.name} ({eq.form} form)", shown)


def as_data(eq: EquationsOfMotion) -> dict[str, Any]:
    """Return equations as plain data; see `EquationsOfMotion.to_dict`."""
    made: dict[str, Any] = {"name": eq.name, "form": eq.form, "parameters": eq.parameters}
    made |= {"readable": eq.is_readable, "structure": eq.structure.to_dict()}
    if not eq.is_readable:
        return made
    written = eq.written
    made["symbols"] = [
        {"symbol": one.name, "path": one.path, "unit": one.unit, "value": one.value, "kind": one.kind}
        for one in eq.legend
    ]
    made["kinetic_energy"], made["potential_energy"] = _both(written.kinetic), _both(written.potential)
    made["linear_terms"], made["rayleigh_function"] = _both(written.linear), _both(written.rayleigh)
    for key, several in (
        ("momenta", written.momenta),
        ("generalized_forces", written.forces),
        ("rows", written.rows),
        ("constraints", written.constraints),
        ("rates", written.rates),
    ):
        made[key] = [_both(one) for one in several]
    made["mass_matrix"] = [[_both(one) for one in row] for row in eq.mass]
    made["constraint_jacobian"] = [[_both(one) for one in row] for row in eq.slopes]
    made["shared"] = [{"name": code.formula(name), **_both(value)} for name, value in eq.book.shared]
    return made


def _both(one: Sum) -> dict[str, str]:
    return {"latex": latex.formula(one), "python": code.formula(one)}
