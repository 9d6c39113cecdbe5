"""Equations of motion solved for accelerations and multipliers, and quantities of parts as formulas.

A reaction follows from the balance of forces in maximal coordinates, where every joint has its multipliers, on the
motion that the coordinates allow (Goldstein, section 2.4): from a row in which it is the only one that is not known
yet, or, as a force along a direction that turns, from the rows of forces together.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from atwood.display import listed
from atwood.errors import UnsupportedError
from atwood.expr import Expression, collect, cos, depends_on, jacobian, jvp, live, sin, substitute
from atwood.forms.lagrangian import lagrangian_of, rows_by_part
from atwood.forms.quantities import find_observables, internal_reactions_of, places
from atwood.lazy_modules import sympy
from atwood.mechanics.outputs.reactions import Reaction
from atwood.theory.equations.euler_angles import in_whole_angles, middle_angles

if TYPE_CHECKING:
    from atwood.theory.equations.formulas import EquationFormulas

LARGEST_BLOCK = 3
"""Mass matrices are inverted in symbols block by block, where no block has more rows."""

_LARGEST_SYSTEM = 4
"""The same of equations with multipliers."""


def blocks(size: int, entries: Collection[tuple[int, int]]) -> Iterator[list[int]]:
    """Yield the rows that belong together since entries join them."""
    groups = sympy.utilities.iterables.connected_components((list(range(size)), list(entries)))
    yield from sorted(map(sorted, groups))


def entries_of(
    formulas: EquationFormulas, values: Sequence[Expression], by: Sequence[Expression]
) -> dict[tuple[int, int], Expression]:
    """Return the derivatives of values that are not zero; what is the same everywhere is of parameters alone."""
    found = [one for one in jacobian(list(values), list(by)).triples if not one[2].is_zero]
    short = collect([one for _, _, one in found], formulas.book.angles, formulas.book.parameters)
    return {(i, j): few if few.is_parametric else one for (i, j, one), few in zip(found, short, strict=True)}


def solved_for(formulas: EquationFormulas) -> list[tuple[Expression, Expression]]:
    """Return accelerations and multipliers as functions of the state, by Cramer's rule: what is above and below.

    The equations of motion and the second derivatives of the constraints are linear in both.
    """
    found = formulas.expressions
    unknown = [*found.accelerations, *(one.multiplier for one in found.constraints)]
    values = [*formulas.residuals, *(one.second for one in found.constraints)]
    entries = entries_of(formulas, values, unknown)
    right = [-one for one in substitute(values, dict.fromkeys(unknown, 0.0))]
    pairs = [(found.graph.zero, found.graph.one)] * len(right)
    for block in blocks(len(right), entries):
        if len(block) > _LARGEST_SYSTEM:
            raise UnsupportedError(
                f"{len(block)} of its equations hang together, and solved they would fill a page",
                where=formulas.name,
                advice="atwood.dynamics solves them in numbers.",
            )
        matrix = [[entries.get((i, j), found.graph.zero) for j in block] for i in block]
        for k, i in enumerate(block):
            columns = [[*row[:k], right[j], *row[k + 1 :]] for row, j in zip(matrix, block, strict=True)]
            pairs[i] = _determinant(columns), _determinant(matrix)
    return pairs


def _determinant(rows: Sequence[Sequence[Expression]]) -> Expression:
    """Return the determinant, by the first row."""
    if len(rows) == 1:
        return rows[0][0]
    terms = [
        (one if k % 2 == 0 else -one) * _determinant([[*row[:k], *row[k + 1 :]] for row in rows[1:]])
        for k, one in enumerate(rows[0])
        if not one.is_zero
    ]
    return sum(terms[1:], terms[0]) if terms else rows[0][0]


def quantity_of(formulas: EquationFormulas, path: str) -> tuple[Expression, dict[str, Expression]]:
    """Return a quantity by path in terms of coordinates, velocities, accelerations and multipliers that are kept.

    With it, of a reaction by part, what each part adds to it; else nothing.
    """
    assembly, found = formulas.assembly, formulas.expressions
    (one,) = find_observables(assembly, [path])
    equations, maximal = found.equations, assembly.maximal
    along = found.course
    own: dict[Expression, Expression | float] = dict(zip(equations.speeds, found.speeds, strict=True))
    own |= dict(zip(equations.accelerations, jvp(list(found.speeds), along), strict=True))
    own |= {q: -one for q, one in zip(equations.coordinates, found.coordinates, strict=True) if one is not q}
    reactions = [other for other in assembly.reactions if depends_on(one.value, [other.symbol])]
    if not reactions:
        return substitute([one.value], own)[0], {}
    where: dict[Expression, Expression | float] = {}
    if assembly.form == "reduced":
        positions, speeds = (substitute(list(values), own) for values in places(equations, maximal))
        moving = zip((*maximal.coordinates, *maximal.speeds), (*positions, *speeds), strict=True)
        where = {**dict(moving), **dict(zip(maximal.accelerations, jvp(speeds, along), strict=True))}
    known, balance = _balanced(formulas, where) if where else ({}, {})
    by = {other.symbol: _reaction(formulas, other, where, known) for other in reactions}
    value = in_whole_angles(substitute([one.value], {**own, **by}), formulas.book.angles, formulas.book.parameters)[0]
    shares: dict[str, Expression] = {}
    if formulas.by_part and balance and substitute([value], dict.fromkeys(balance, 0.0))[0].is_zero:
        open_ = dict.fromkeys((held.multiplier for held in maximal.constraints if held.multiplier in known), 0.0)
        for part, rows in rows_by_part(lagrangian_of(assembly, "dae")).items():
            here = substitute(list(rows), {**where, **open_})
            shares[part] = substitute([value], dict(zip(balance, here, strict=True)))[0]
    return substitute([value], balance)[0], shares


def _reaction(
    formulas: EquationFormulas,
    reaction: Reaction,
    where: Mapping[Expression, Expression | float],
    known: Mapping[Expression, Expression | float],
) -> Expression:
    """Return a reaction, where maximal coordinates and multipliers are what is given."""
    inside, maximal = internal_reactions_of(formulas.assembly), formulas.assembly.maximal
    held = [one for one in maximal.constraints if one.key == reaction.key]
    if inside is not None and reaction.path in inside.rows:
        value = inside.program.outputs[0].expressions[inside.rows[reaction.path]]
    elif held:
        value = reaction.sign * held[0].multiplier
    else:
        raise UnsupportedError("the motion says nothing of this reaction", where=reaction.path)
    value = substitute(substitute([value], dict(where)), dict(known))[0]
    kept = {one.multiplier for one in formulas.expressions.constraints}
    left = [one for one in maximal.constraints if one.multiplier not in kept and depends_on(value, [one.multiplier])]
    if left and where:
        raise UnsupportedError(
            f"it hangs together with the reactions of {listed(one.label for one in left)}",
            where=reaction.path,
            advice="atwood.simulate gives it in numbers; in the dae form it is a multiplier.",
        )
    return value


def _balanced(
    formulas: EquationFormulas, where: Mapping[Expression, Expression | float]
) -> tuple[dict[Expression, Expression | float], dict[Expression, Expression | float]]:
    """Return the multipliers of joints that follow one after another from the balance of forces on a motion.

    They are in terms of symbols, one for each row of the balance, which are returned with the rows.
    """
    maximal, graph = formulas.assembly.maximal, formulas.expressions.graph
    sides = zip(maximal.rows_with_multipliers or maximal.rows, maximal.constraint_rows, strict=True)
    rows = _in_whole_angles(formulas, substitute([row - held for row, held in sides], dict(where)))
    kept = {one.multiplier for one in formulas.expressions.constraints}
    unknown = [one.multiplier for one in maximal.constraints if one.multiplier not in kept]
    slopes: dict[int, dict[Expression, Expression]] = {i: {} for i in range(len(rows))}
    for (i, j), slope in entries_of(formulas, rows, unknown).items():
        slopes[i][unknown[j]] = slope
    points = [(one.name.rpartition(".")[0], one.unit == "m/s") for one in maximal.speed_names]
    balance = {graph.symbol(f"row:{i}"): row for i, row in enumerate(substitute(rows, dict.fromkeys(unknown, 0.0)))}
    names, known = list(balance), dict[Expression, Expression | float]()
    while True:
        alone: dict[tuple[Expression, tuple[str, bool]], list[int]] = {}
        beside: dict[tuple[Expression, tuple[str, bool]], list[int]] = {}
        left = {i: [one for one in row if one not in known] for i, row in slopes.items()}
        for i, open_ in left.items():
            for one in open_:
                (alone if len(open_) == 1 else beside).setdefault((one, points[i]), []).append(i)
        ways = [(one, [i for i in at if slopes[i][one].is_parametric][:1] or at) for (one, _), at in alone.items()]
        ways += [(one, alone.get((one, point), []) + at) for (one, point), at in beside.items()]
        for multiplier, several in ways:
            if len(several) > 1 or not slopes[several[0]][multiplier].is_parametric:
                several = [i for i in several if points[i][1]]
            across = dict.fromkeys((one for i in several for one in left[i]), graph.zero)
            for i in several:
                across |= {one: across[one] + slopes[i][multiplier] * slopes[i][one] for one in left[i]}
            square = across.pop(multiplier, graph.zero)
            [size] = collect([square], formulas.book.angles, formulas.book.parameters)
            if size.is_zero or not size.is_parametric:
                continue
            if not any(formulas.formula(one).terms for one in across.values()):  # it is square to all others
                rests = [
                    sum((s * known[one] for one, s in slopes[i].items() if one in known), names[i]) for i in several
                ]
                pushed = (slopes[i][multiplier] * rest for i, rest in zip(several, rests, strict=True))
                known[multiplier] = -sum(pushed, graph.zero) / size
                break
        else:
            return known, dict(balance)


def _in_whole_angles(formulas: EquationFormulas, rows: Sequence[Expression]) -> list[Expression]:
    """Return rows with products of sines and cosines of half an angle as those of the angle."""
    if middle_angles(formulas.expressions):
        return in_whole_angles(rows, formulas.book.angles, formulas.book.parameters)
    nodes, parameters = live(rows), formulas.book.parameters
    waves = dict.fromkeys(one.arguments[0] for one in nodes if one.operation in ("sin", "cos"))
    halves = [one for one in waves if 2.0 * one in waves and not one.is_parametric]
    if not halves:
        return list(rows)
    angles = [*(one for one in formulas.book.angles if 0.5 * one not in halves), *halves]
    known: dict[Expression, Expression | float] = {}
    for divisor in {one.arguments[1] for one in nodes if one.operation == "div"}:
        known |= {divisor: collect([divisor], angles, parameters)[0]}
    for half in halves:
        known |= {sin(2.0 * half): 2.0 * sin(half) * cos(half), cos(2.0 * half): 1.0 - 2.0 * sin(half) * sin(half)}
    return [collect([one], angles, parameters)[0] for one in substitute(list(rows), known)]
