"""Equations of motion written down: pages, plain data, a picture where they are too long, and a module of Python.

The module needs nothing but `math` and NumPy.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from atwood.arrays import BoolArray
from atwood.display import count_of, data_of
from atwood.errors import UnsupportedError
from atwood.expr import dependencies, substitute
from atwood.forms.assembly import Assembly
from atwood.forms.lagrangian import Lagrangian
from atwood.lazy_dataclasses import dataclass
from atwood.simulation.contacts.chosen import words_of, words_text
from atwood.theory.formulas import page
from atwood.theory.formulas.described import Page
from atwood.theory.formulas.page import Line, Matrix, Section
from atwood.theory.formulas.printers import code, latex, text
from atwood.theory.formulas.tree import Call, Name, Node, Sum, Symbol, names_in
from atwood.tolerances import tolerances

if TYPE_CHECKING:
    from atwood.theory.equations.equations import EquationsOfMotion
    from atwood.theory.equations.formulas import Written

_NOTHING = ("", "")


def equation_lines(written: Written) -> list[Line]:
    """Return the equations of motion and the constraints."""
    return [Line(_NOTHING, one, "= 0") for one in (*written.rows, *written.constraints)]


def page_of_equations(eq: EquationsOfMotion, written: Written) -> Page:
    """Return the page of all that is to be said of equations of motion, with formulas as they are written."""
    title = f"{eq.name} ({eq.form} form)"
    return Page(title, tuple(_sections(eq, written)), symbols=tuple(_shown(eq)), by_part=eq.by_part)


def _sections(eq: EquationsOfMotion, written: Written) -> list[Section]:
    found, notation = eq.expressions, eq.notation
    contacts = words_text(words_of(eq.assembly.flat))
    sections = [*([Section("Contacts", (), f"{contacts}.")] if contacts else []), _energies(written)]
    own = [notation.velocities[u][0] for u in found.velocities]
    for title, letter, formulas in (("Momenta", "p", eq.momenta_shown), ("Generalized forces", "Q", written.forces)):
        lines = [
            Line((f"{letter}_{{{latex.letter(symbol)}}}", f"{letter}_{text.letter(symbol)}"), one)
            for symbol, one in zip(own, formulas, strict=True)
            if one.terms or letter == "p"
        ]
        if lines:
            sections.append(Section(title, tuple(lines)))
    lines = equation_lines(written)
    sections.append(Section("Equations of motion", tuple(lines[: len(written.rows)]), eq.sign_said))
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
    sections += asked_sections(eq)
    if eq.mass:
        sections.append(Section("Mass matrix", (Matrix(("M", "M"), eq.mass),)))
    if eq.mass and written.constraints:
        sections.append(Section("Constraint Jacobian", (Matrix(("G", "G"), eq.slopes),)))
    if eq.book.shared:
        sections.append(Section("Shared terms", tuple(page.line_for(*one) for one in eq.book.shared)))
    return page.with_names(sections, notation.legend)


def asked_sections(eq: EquationsOfMotion) -> list[Section]:
    """Return what is written where it is asked for: the accelerations, and quantities of parts."""
    made = [Section("Accelerations and multipliers", eq.lines_solved)] if eq.is_solved else []
    heads = ((rf"\text{{{path}}}".replace("_", r"\_"), path) for path in eq.paths)
    known = tuple(Line(head, eq.written_quantity(path)) for head, path in zip(heads, eq.paths, strict=True))
    return [*made, Section("Quantities", known)] if known else made


def _energies(written: Written) -> Section:
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


def as_data(eq: EquationsOfMotion) -> dict[str, Any]:
    """Return equations as plain data; see `EquationsOfMotion.to_dict`."""
    made: dict[str, Any] = {"name": eq.name, "form": eq.form, "parameters": eq.parameters}
    contacts = words_of(eq.assembly.flat)
    made |= {"contacts": contacts} if contacts else {}
    made |= {"readable": eq.is_readable, "structure": eq.structure.to_dict()}
    if not eq.is_readable:
        return made
    written = eq.written_by_part if eq.by_part else eq.written
    made["symbols"] = page.symbols_data(eq.legend)
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
    if eq.is_solved:
        made["solved"] = {line.left[1]: _both(line.formula) for line in eq.lines_solved}
    if eq.paths:
        made["quantities"] = {path: _both(eq.written_quantity(path)) for path in eq.paths}
    made["mass_matrix"] = [[_both(one) for one in row] for row in eq.mass]
    made["constraint_jacobian"] = [[_both(one) for one in row] for row in eq.slopes]
    made["shared"] = [{"name": code.formula(name), **_both(value)} for name, value in eq.book.shared]
    return made


def _both(one: Sum) -> dict[str, Any]:
    return {"latex": latex.formula(one), "python": code.formula(one), **page.terms_data(one)}


_COLUMNS = 64
"""Of a picture in text, at most."""


@dataclass(frozen=True)
class Structure:
    """Counts of a scene's equations, and where their matrices have entries.

    Attributes
    ----------
    name, form
        The scene, and the form of its equations.
    coordinates, speeds, constraints
        How many there are.
    operations
        That one evaluation of the equations of motion takes.
    pattern
        Where the matrix ``[[M, G^T], [G, 0]]`` of accelerations and multipliers has entries, shape
        (speeds + constraints, speeds + constraints).
    """

    name: str
    form: str
    coordinates: int
    speeds: int
    constraints: int
    operations: int
    pattern: BoolArray

    @property
    def sentence(self) -> str:
        """The counts as a sentence."""
        n, m = self.speeds, self.constraints
        filled = int(np.count_nonzero(self.pattern[:n, :n]))
        held = f" and {count_of(m, 'constraint')} with {np.count_nonzero(self.pattern[n:, :n])} slopes" if m else ""
        return (
            f"{self.name} has {count_of(self.coordinates, 'coordinate')} and {count_of(n, 'velocity', 'velocities')}; "
            f"its equations of motion take {self.operations} operations, with {filled} of {n * n} entries in the mass "
            f"matrix{held}."
        )

    def text(self) -> str:
        """Return counts and pattern as plain text."""
        return f"{self.sentence}\n\n{self.picture()}"

    def latex(self) -> str:
        """Return the counts in LaTeX."""
        return rf"\text{{{self.sentence}}}".replace("_", r"\_")

    def markdown(self) -> str:
        """Return counts and pattern as a page of Markdown."""
        return f"# {self.name}\n\n{self.sentence}\n\n```\n{self.picture()}\n```\n"

    def html(self) -> str:
        """Return counts and pattern as HTML, the pattern as a picture in SVG."""
        return f"<p>{self.sentence}</p>{self.svg()}"

    notebook = html

    def picture(self) -> str:
        """Return the pattern as text: a block where there are entries."""
        cells = _coarse(self.pattern, _COLUMNS)
        return "\n".join("".join("█" if one else "·" for one in row) for row in cells)

    def svg(self, size: int = 320) -> str:
        """Return the pattern as a picture in SVG: M above, G below and beside it."""
        cells = _coarse(self.pattern, 160)
        n = max(len(cells), 1)
        side = self.speeds * n / max(len(self.pattern), 1)
        squares = "".join(f'<rect x="{j}" y="{i}" width="1" height="1"/>' for i, j in np.argwhere(cells))
        frame = f'<path d="M0 {side:.3g}H{n}M{side:.3g} 0V{n}" stroke="#888" stroke-width="{n / 300:.3g}"/>'
        box = f'<rect width="{n}" height="{n}" fill="#fff" stroke="#444" stroke-width="{n / 200:.3g}"/>'
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{size}" height="{size}" viewBox="0 0 {n} {n}">'
            f'{box}{frame}<g fill="#1f4e79">{squares}</g></svg>'
        )

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data."""
        counts = data_of(self, "coordinates", "speeds", "constraints", "operations")
        return {**counts, "entries": np.argwhere(self.pattern).tolist()}


def _coarse(pattern: BoolArray, most: int) -> BoolArray:
    """Return a pattern with at most so many rows, several of them together where there are more."""
    n = len(pattern)
    by = max(1, -(-n // most))
    m = -(-n // by)
    padded = np.zeros((m * by, m * by), dtype=bool)
    padded[:n, :n] = pattern
    return np.asarray(padded.reshape(m, by, m, by).any(axis=(1, 3)), dtype=bool)


def structure_of(assembly: Assembly, found: Lagrangian, operations: int) -> Structure:
    """Return the size and the sparsity pattern of the equations of a scene."""
    n, m = len(found.velocities), len(found.constraints)
    pattern = np.zeros((n + m, n + m), dtype=bool)
    by_acceleration = {a: j for j, a in enumerate(found.accelerations)}
    by_velocity = {u: j for j, u in enumerate(found.velocities)}
    for i, needed in enumerate(dependencies(list(found.inertial), list(by_acceleration))):
        pattern[i, [by_acceleration[a] for a in needed]] = True
    for i, needed in enumerate(dependencies([one.rate for one in found.constraints], list(by_velocity))):
        columns = [by_velocity[u] for u in needed]
        pattern[n + i, columns] = pattern[columns, n + i] = True
    return Structure(assembly.flat.name, assembly.form, len(found.coordinates), n, m, operations, pattern)


def module_of(eq: EquationsOfMotion) -> str:
    """Return the module; see `EquationsOfMotion.python`."""
    found, n = eq.expressions, len(eq.expressions.coordinates)
    still = dict.fromkeys(found.accelerations, 0.0)
    bias = [eq.formula(row) for row in substitute(list(found.rows), still)]
    gamma = [eq.formula(one) for one in substitute([one.second for one in found.constraints], still)]
    functions = [
        _function(eq, "rates", "t, q, u", "Return the derivatives of the coordinates.", [*eq.written.rates]),
        _function(eq, "mass_matrix", "t, q", "Return the mass matrix M.", [one for row in eq.mass for one in row]),
        _function(eq, "bias", "t, q, u", "Return h, all terms without accelerations, less all forces.", bias),
    ]
    if found.constraints:
        slopes = [one for row in eq.slopes for one in row]
        functions += [
            _function(eq, "constraints", "t, q, u", "Return what stays zero.", [*eq.written.constraints]),
            _function(eq, "constraint_jacobian", "t, q", "Return G, derivatives of the constraints.", slopes),
            _function(eq, "constraint_bias", "t, q, u", "Return the constraints' second derivative at a = 0.", gamma),
        ]
    body = "\n\n\n".join(functions)
    used = [name for name in code.MATH if re.search(rf"\b{name}\b", body)]
    stated = "M a + h = G^T lambda, G a + gamma = 0." if found.constraints else "M a + h = 0."
    head = [f'"""Equations of motion of {eq.name}, {eq.form} form: {stated}', "", *_listing(eq)]
    head += [*filter(None, [eq.sign_said]), '"""', ""]
    head += [f"from math import {', '.join(used)}", ""] if used else []
    head += ["import numpy as np", "from numpy.linalg import solve", ""]
    if found.constraints:
        head += [f"RANK = {tolerances.CLEAR!r}  # smaller singular values of constraints are rounding and drift", ""]
    head += [
        f"{code.letter(one)} = {one.value!r}  # {one.path}" + (f", {one.unit}" if one.unit else "")
        for one in eq.legend
        if one.kind == "parameter"
    ]
    solved = (_SOLVED_WITH if found.constraints else _SOLVED).replace("N]", f"{n}]").replace("[N:", f"[{n}:")
    return "\n".join(head) + f"\n\n\n{body}\n\n\n{solved}"


def _listing(eq: EquationsOfMotion) -> list[str]:
    found, notation = eq.expressions, eq.notation
    q = (f"{code.letter(notation.symbols[one])} ({notation.symbols[one].path})" for one in found.coordinates)
    u = (code.letter(*notation.velocities[one]) for one in found.velocities)
    return [f"q: {', '.join(q)}", f"u: {', '.join(u)}"]


def _function(eq: EquationsOfMotion, name: str, arguments: str, said: str, formulas: Sequence[Sum]) -> str:
    _check(eq, formulas)
    found, notation = eq.expressions, eq.notation
    shared = page.shared_in(formulas, eq.book.shared)
    needed = [f"    {code.formula(name)} = {code.formula(value)}" for name, value in shared]
    lines = [f"def {name}({arguments}):", f'    """{said}"""']
    lines += _unpacked([code.letter(notation.symbols[one]) for one in found.coordinates], "q")
    if "u" in arguments:
        lines += _unpacked([code.letter(*notation.velocities[one]) for one in found.velocities], "u")
    rows = [f"        {code.formula(one)}," for one in formulas]
    shape = {"mass_matrix": len(found.velocities), "constraint_jacobian": len(found.constraints)}.get(name)
    end = f"]).reshape({shape}, -1)" if shape else "])"
    return "\n".join([*lines, *needed, "    return np.array([", *rows, f"    {end}"])


def _unpacked(names: Sequence[str], source: str) -> list[str]:
    return [f"    {', '.join(names)}{',' if len(names) == 1 else ''} = {source}"] if names else []


def _check(eq: EquationsOfMotion, formulas: Sequence[Sum]) -> None:
    """Refuse what a module cannot compute by itself: functions of somebody's own, and values that are no state."""
    found, shared = eq.expressions, {name.symbol: value for name, value in eq.book.shared}
    known = {eq.notation.symbols[one] for one in found.coordinates} | set(shared)
    known |= {eq.notation.velocities[one][0] for one in found.velocities}
    known |= {one for one in eq.legend if one.kind != "sampled value"}
    stack: list[Node] = [*formulas]
    while stack:
        node = stack.pop()
        if isinstance(node, Name) and node.symbol not in known and node.symbol.kind != "time":
            raise UnsupportedError(
                f"it reads {node.symbol.path or node.symbol.name}, which is no coordinate and no velocity: it is held, "
                "as from sample to sample",
                where=eq.name,
                advice="Run the scene with atwood.simulate, or export it without the part that holds values.",
            )
        if isinstance(node, Call):
            if node.function not in code.KNOWN:
                raise UnsupportedError(
                    f"it calls the function {node.function}, which cannot be written down",
                    where=eq.name,
                    advice="atwood.dynamics has the equations as functions of numbers.",
                )
            stack += node.arguments
        elif isinstance(node, Sum):
            stack += [inner for term in node.terms for inner, _ in term.factors]
        elif node.symbol in shared:
            stack.append(shared.pop(node.symbol))


_SOLVED = '''def accelerations(t, q, u):
    """Return the accelerations."""
    return solve(mass_matrix(t, q), -bias(t, q, u))


def derivative(t, y):
    """Return dy/dt of y = (q, u), as scipy.integrate.solve_ivp takes it."""
    q, u = y[:N], y[N:]
    return np.concatenate([rates(t, q, u), accelerations(t, q, u)])
'''

_SOLVED_WITH = '''def accelerations(t, q, u):
    """Return the accelerations and the multipliers; of those that redundant constraints leave open, the smallest.

    Gauss's principle of least constraint, in coordinates in which masses and rows of G are of size one. Where bodies
    have no mass, M + G^T G takes the place of M: with G a = -gamma it has the same accelerations.
    """
    M, G = mass_matrix(t, q), constraint_jacobian(t, q)
    h, gamma = bias(t, q, u), constraint_bias(t, q, u)
    size = np.where(np.diag(M) > 0.0, np.diag(M), np.sum(G * G, axis=0)) ** -0.5
    rows = np.linalg.norm(G * size, axis=1)
    rows = np.where(rows > 0.0, rows, 1.0)
    G, gamma = G * size / rows[:, None], gamma / rows
    L = np.linalg.cholesky(M * np.outer(size, size) + G.T @ G)
    free = -solve(L, h * size + G.T @ gamma)
    Y = solve(L, G.T)
    forced = np.linalg.lstsq(Y.T, -gamma - Y.T @ free, RANK)[0]
    return solve(L.T, free + forced) * size, np.linalg.lstsq(Y, forced, RANK)[0] / rows


def derivative(t, y):
    """Return dy/dt of y = (q, u), as scipy.integrate.solve_ivp takes it; constraints are held as accelerations."""
    q, u = y[:N], y[N:]
    return np.concatenate([rates(t, q, u), accelerations(t, q, u)[0]])
'''
