"""Inertia tensors of bodies of simple shape, in letters, about any point."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from atwood.arguments import Kind, Refused, check, either, one_of, optional, takes_names
from atwood.lazy_modules import sympy
from atwood.theory.formulas.notation import SYMBOLS
from atwood.theory.formulas.printers import Sympy
from atwood.theory.formulas.sheet import FormulaSheet, Statement
from atwood.theory.hamiltonian.phase_space import as_expression


class _Shape(NamedTuple):
    """A homogeneous body with its principal axes along x, y and z, the last that of revolution if there is one.

    Attributes
    ----------
    letters
        Names of its lengths.
    moments
        Gives the three moments about the centre of mass, divided by the mass.
    height
        Gives the z coordinate of the centre of mass in the axes that places are given in.
    """

    letters: str
    moments: Callable[..., Sequence[Sympy]]
    height: Callable[..., Sympy] = lambda *lengths: sympy.Integer(0)


def _round(across: Sympy, along: Sympy) -> tuple[Sympy, Sympy, Sympy]:
    return across, across, along


_SHAPES = {
    "rod": _Shape("l", lambda l: (l**2 / 12, l**2 / 12, 0)),
    "ring": _Shape("a", lambda a: _round(a**2 / 2, a**2)),
    "disc": _Shape("a", lambda a: _round(a**2 / 4, a**2 / 2)),
    "annulus": _Shape("a b", lambda a, b: _round((a**2 + b**2) / 4, (a**2 + b**2) / 2)),
    "plate": _Shape("a b", lambda a, b: (b**2 / 12, a**2 / 12, (a**2 + b**2) / 12)),
    "box": _Shape("a b c", lambda a, b, c: ((b**2 + c**2) / 12, (a**2 + c**2) / 12, (a**2 + b**2) / 12)),
    "cylinder": _Shape("a h", lambda a, h: _round(a**2 / 4 + h**2 / 12, a**2 / 2)),
    "tube": _Shape("a b h", lambda a, b, h: _round((a**2 + b**2) / 4 + h**2 / 12, (a**2 + b**2) / 2)),
    "ball": _Shape("a", lambda a: [2 * a**2 / 5] * 3),
    "spherical shell": _Shape("a", lambda a: [2 * a**2 / 3] * 3),
    "half ball": _Shape("a", lambda a: _round(83 * a**2 / 320, 2 * a**2 / 5), lambda a: 3 * a / 8),
    "cone": _Shape("a h", lambda a, h: _round(3 * (4 * a**2 + h**2) / 80, 3 * a**2 / 10), lambda a, h: 3 * h / 4),
    "ellipsoid": _Shape("a b c", lambda a, b, c: ((b**2 + c**2) / 5, (a**2 + c**2) / 5, (a**2 + b**2) / 5)),
}
"""Bodies of a course. Heights of a half ball are from its flat side, those of a cone from its tip."""


def _point(value: Any) -> tuple[Sympy, Sympy, Sympy]:
    if isinstance(value, str) or len(value) != 3:
        raise Refused
    x, y, z = map(as_expression, value)
    return x, y, z


_ABOUT = either(optional(one_of(("centre", "origin"))), Kind("'centre', 'origin', or three coordinates", _point))


@takes_names
def inertia_tensor(shape: str, about: Any = "centre", *, symbols: Mapping[str, str] | None = None) -> FormulaSheet:
    """Return the inertia tensor of a homogeneous body of mass m in letters, about any point.

    Its axis of revolution, or its longest line of a rod, is z; the origin is its centre, of a cone its tip, of half a
    ball the middle of its flat side. The tensor is ``I + m (d^2 1 - d d^T)`` with d from the centre of mass to the
    point (Steiner's theorem; Goldstein, section 5.3).

    Parameters
    ----------
    shape
        ``"rod"`` of length l; ``"ring"``, ``"disc"``, ``"ball"``, ``"spherical shell"`` or ``"half ball"`` of radius a;
        ``"annulus"`` of radii a and b; ``"plate"`` with sides a and b; ``"box"`` with sides a, b and c; ``"cylinder"``
        or ``"cone"`` of radius a and height h; ``"tube"`` of radii a and b; ``"ellipsoid"`` of semi-axes a, b and c.
    about
        The point: ``"centre"`` of mass, ``"origin"``, or its coordinates, numbers or text such as ``("a", 0, "-h/2")``.
    symbols
        Other letters, such as ``{"a": "R"}``.

    Returns
    -------
    FormulaSheet
        ``centre``, ``I`` about the point, the principal ``moments`` there, and their ``axes`` as columns, turned by the
        angle ``alpha`` where they are. Where the point is in no plane of symmetry, ``characteristic``: the cubic that
        the principal moments are roots of.
    """
    kind = check(one_of(_SHAPES), shape, "shape")
    point = check(_ABOUT, about, "about", "inertia_tensor")
    one = _SHAPES[kind]
    m, lengths = sympy.Symbol("m"), [sympy.Symbol(name) for name in one.letters.split()]
    centre = sympy.Matrix([0, 0, one.height(*lengths)])
    place = {"centre": centre, "origin": sympy.zeros(3, 1)}.get(point) if isinstance(point, str) else None
    d = (sympy.Matrix(point) if place is None else place) - centre
    each = sympy.diag(*map(sympy.sympify, one.moments(*lengths))) + d.dot(d) * sympy.eye(3) - d * d.T
    tensor = (m * each).applyfunc(sympy.factor)
    found = [
        Statement("centre", "Centre of mass", centre, sympy.Matrix(sympy.symbols("x_S y_S z_S"))),
        Statement("I", "Inertia tensor about the point", tensor, sympy.Symbol("I")),
        *_principal(each, m),
    ]
    return FormulaSheet(f"Inertia of a {kind}", found).in_letters(check(SYMBOLS, symbols, "symbols"))


def _principal(tensor: Sympy, m: Sympy) -> list[Statement]:
    """Return the principal moments and axes of m times a tensor; where it couples all axes, the cubic they are of."""
    coupled = [(i, j) for i, j in ((0, 1), (0, 2), (1, 2)) if tensor[i, j] != 0]
    letters = sympy.Matrix([sympy.Symbol(f"I_{k}") for k in (1, 2, 3)])
    if len(coupled) > 1:
        root = sympy.Symbol("lambda")
        cubic = (root * sympy.eye(3) - m * tensor).det(method="berkowitz")
        terms = [sympy.factor(sympy.expand(cubic).coeff(root, k)) * root**k for k in range(4)]
        return [Statement("characteristic", "Principal moments there are the roots lambda of", sympy.Add(*terms))]
    moments, axes, more = [tensor[k, k] for k in range(3)], sympy.eye(3), []
    for i, j in coupled:
        mean, half = (moments[i] + moments[j]) / 2, (moments[i] - moments[j]) / 2
        root, angle = sympy.sqrt(sympy.factor(half**2 + tensor[i, j] ** 2)), sympy.Symbol("alpha")
        moments[i], moments[j] = sympy.factor(mean) + root, sympy.factor(mean) - root
        axes[i, i] = axes[j, j] = sympy.cos(angle)
        axes[j, i], axes[i, j] = sympy.sin(angle), -sympy.sin(angle)
        turn = sympy.atan2(sympy.factor(2 * tensor[i, j]), sympy.factor(2 * half)) / 2
        more = [Statement("alpha", "The angle that they are turned by", turn, angle)]
    values = sympy.Matrix([m * one for one in moments]).applyfunc(lambda one: one if coupled else sympy.factor(one))
    found = Statement("moments", "Principal moments there", values, letters)
    return [found, Statement("axes", "Principal axes there, as columns", axes, sympy.Symbol("A")), *more]
