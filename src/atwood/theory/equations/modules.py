"""The equations of motion of a scene as a module of Python that needs nothing but `math` and NumPy."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from atwood.errors import UnsupportedError
from atwood.expr import substitute
from atwood.theory.formulas.printers import code
from atwood.theory.formulas.tree import Call, Name, Node, Sum, names_in
from atwood.tolerances import tolerances

if TYPE_CHECKING:
    from atwood.theory.equations.equations import EquationsOfMotion


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
    head = [f'"""Equations of motion of {eq.name}, {eq.form} form: {_statement(eq)}', "", *_listing(eq), '"""', ""]
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


def _statement(eq: EquationsOfMotion) -> str:
    return "M a + h = G^T lambda, G a + gamma = 0." if eq.expressions.constraints else "M a + h = 0."


def _listing(eq: EquationsOfMotion) -> list[str]:
    found, notation = eq.expressions, eq.notation
    q = (f"{code.letter(notation.symbols[one])} ({notation.symbols[one].path})" for one in found.coordinates)
    u = (code.letter(*notation.velocities[one]) for one in found.velocities)
    return [f"q: {', '.join(q)}", f"u: {', '.join(u)}"]


def _function(eq: EquationsOfMotion, name: str, arguments: str, said: str, formulas: Sequence[Sum]) -> str:
    _check(eq, formulas)
    found, notation = eq.expressions, eq.notation
    definitions, wanted = dict(eq.book.shared), {one.symbol for one in names_in(formulas)}
    needed: list[str] = []
    for shared, value in reversed(list(definitions.items())):
        if shared.symbol in wanted:
            wanted |= {one.symbol for one in names_in([value])}
            needed.insert(0, f"    {code.formula(shared)} = {code.formula(value)}")
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
