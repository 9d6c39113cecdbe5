"""Rotations in angles and in quaternions as formulas: the matrix, angular velocities, and the rates that they give."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product

from atwood.arguments import check, one_of, takes_names
from atwood.lazy_modules import sympy
from atwood.model.values.rotation import Rotation, Turn
from atwood.model.values.space import Vector
from atwood.theory.formulas.notation import SYMBOLS
from atwood.theory.formulas.printers import Sympy
from atwood.theory.formulas.sheet import FormulaSheet, Statement

SEQUENCES = tuple("".join(one) for one in product("xyz", repeat=3) if one[0] != one[1] != one[2])


def _letters(below: str) -> Sympy:
    return sympy.Matrix([sympy.Symbol(f"omega_{one}") for one in below])


_ANGLES = one_of(("quaternion", *SEQUENCES))
_TURNS = one_of(("moving", "fixed"))


@takes_names
def rotation_kinematics(
    angles: str = "zxz", turns: str = "moving", *, symbols: Mapping[str, str] | None = None
) -> FormulaSheet:
    """Return how an orientation is described: its matrix, its angular velocity, and its kinematic equations.

    ``R`` takes components in the axes of the body to those in space, and ``A`` the other way (Goldstein, sections 4.4
    and 4.9). The kinematic equations give the rates of the angles from the angular velocity along the axes of the
    body (``omega_1`` to ``omega_3``) or of space (``omega_x`` to ``omega_z``).

    Parameters
    ----------
    angles
        Axes of three turns by phi, theta and psi, such as ``"zxz"`` of Goldstein, ``"zyz"`` or ``"xyz"`` (Cardan);
        or ``"quaternion"``: q_0 to q_3, of size one.
    turns
        ``"moving"``: each about an axis of the frame that the turns before it have made; ``"fixed"``: about the axes of
        space.
    symbols
        Other letters, such as ``{"phi": "alpha"}``.

    Returns
    -------
    FormulaSheet
        ``R``, ``A``, ``omega_body``, ``omega_space``, ``rates``, ``rates_from_space``, and ``singular``, which is zero
        where the rates have no value; a quaternion has none such.
    """
    angles, turns = (check(kind, v, n) for kind, v, n in ((_ANGLES, angles, "angles"), (_TURNS, turns, "turns")))
    found = _quaternion() if angles == "quaternion" else _turned(angles, turns == "fixed")
    sense = "" if angles == "quaternion" else f", {turns} axes"
    return FormulaSheet(f"Rotation: {angles}{sense}", found).in_letters(check(SYMBOLS, symbols, "symbols"))


def matrix_of(*turns: Turn) -> Sympy:
    """Return turns one after another as a matrix, whose columns are the turned axes."""
    return sympy.Matrix([[sympy.nsimplify(entry) for entry in axis] for axis in Rotation(turns).axes()]).T


def _turned(sequence: str, is_fixed: bool) -> list[Statement]:
    """Return the formulas of three turns; those about fixed axes are moving ones in the other order.

    Angular velocities and rates are worked out in the frames before and after the second turn, where nothing cancels.
    """
    t = sympy.Symbol("t")
    own = [sympy.Function(name)(t) for name in ("phi", "theta", "psi")]
    made = [Turn(Vector(*(float(axis == one) for one in "xyz")), q) for axis, q in zip(sequence, own, strict=True)]
    in_turn, rates = (
        made[:: -1 if is_fixed else 1],
        sympy.Matrix([one.diff(t) for one in own[:: -1 if is_fixed else 1]]),
    )
    first, second, third = (sympy.Matrix([int(c) for c in one.axis]) for one in in_turn)
    outer, middle, inner = map(matrix_of, in_turn)
    before = [first, second, middle * third]
    after = [middle.T * first, second, third]
    singular = before[0].dot(before[1].cross(before[2]))
    spins = [frame * sympy.Matrix.hstack(*axes) * rates for frame, axes in ((inner.T, after), (outer, before))]
    found = []
    for (a, b, c), spin in ((after, inner * _letters("123")), (before, outer.T * _letters("xyz"))):
        rows = [b.cross(c) / singular, b, a.cross(b) / singular]
        found.append(sympy.Matrix([row.dot(spin) for row in rows]))
    return _statements(matrix_of(*in_turn), spins, found, rates, singular)


def _quaternion() -> list[Statement]:
    t = sympy.Symbol("t")
    w, x, y, z = own = [sympy.Function(f"q_{k}")(t) for k in range(4)]
    matrix = sympy.Matrix(
        [
            [1 - 2 * (y**2 + z**2), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x**2 + z**2), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x**2 + y**2)],
        ]
    )
    body = sympy.Matrix([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]])
    space = sympy.Matrix([[-x, -y, -z], [w, z, -y], [-z, w, x], [y, -x, w]])
    rates = sympy.Matrix([one.diff(t) for one in own])
    return _statements(
        matrix,
        [2 * body.T * rates, 2 * space.T * rates],
        [body * _letters("123") / 2, space * _letters("xyz") / 2],
        rates,
    )


def _statements(
    matrix: Sympy, spins: Sequence[Sympy], rates: Sequence[Sympy], left: Sympy, singular: Sympy | None = None
) -> list[Statement]:
    found = [
        Statement("R", "From the axes of the body to those of space", matrix, sympy.Symbol("R")),
        Statement("A", "From the axes of space to those of the body", matrix.T, sympy.Symbol("A")),
    ]
    for name, letters, spin in zip(("body", "space"), (_letters("123"), _letters("xyz")), spins, strict=True):
        found.append(
            Statement(
                f"omega_{name}",
                f"Angular velocity along the axes of {'the body' if name == 'body' else name}",
                spin,
                letters,
            )
        )
    for name, where, one in zip(("rates", "rates_from_space"), ("the body", "space"), rates, strict=True):
        found.append(Statement(name, f"Rates from the angular velocity along the axes of {where}", one, left))
    if singular is not None:
        size = -singular if singular.could_extract_minus_sign() else singular
        found.append(Statement("singular", "The rates have no value where this is zero", size))
    return found
