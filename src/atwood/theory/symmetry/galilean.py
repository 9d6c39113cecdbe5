"""The Galilei group: what shifts in time and space, rotations and boosts of a whole scene do to T and to L."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from atwood.arguments import takes
from atwood.errors import UnsupportedError
from atwood.forms.assembly import Assembly
from atwood.forms.lagrangian import lagrangian_of
from atwood.lazy_modules import sympy
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE, smooth_assembly_of
from atwood.theory.equations.equations import EquationsOfMotion
from atwood.theory.formulas.notation import SYMBOLS, notation_of
from atwood.theory.formulas.printers import Sympy
from atwood.theory.formulas.sheet import FormulaSheet, Statement
from atwood.theory.symmetry.proof import in_body

Moves = tuple[dict[int, Sympy], dict[int, Sympy]]
"""Displacements of coordinates, and along velocities, each by number."""


@takes(scene=SCENE, symbols=SYMBOLS)
def galilean(scene: Model | Assembly, *, symbols: Mapping[str, str] | None = None) -> FormulaSheet:
    """Return what the generators of the Galilei group do to a scene: ten in space, six in the plane.

    All bodies are displaced, ``delta r = e``, ``e x r`` or ``e t``, fields and what is fixed in the world stay, with
    places of the bodies as coordinates and constraints kept (form ``"dae"``). Where ``delta L = df/dt``, f is the gauge
    term, and ``p . delta q - f`` is conserved (Noether; Landau and Lifshitz, Mechanics, sections 3 to 9); else its rate
    is what is left over, with the forces and multipliers that do not follow from L.

    Parameters
    ----------
    scene
        The scene, or an assembly of it.
    symbols
        See `atwood.equations`.

    Returns
    -------
    FormulaSheet
        For each generator, such as ``"P_x"``, ``"L_z"``, ``"K_x"`` and the energy function ``"h"``, one below the
        other: its quantity, the changes of T and of L, the gauge term, and the rate of the quantity: what is left over.
    """
    assembly = smooth_assembly_of(scene)
    whole = lagrangian_of(assembly, "dae")
    equations = EquationsOfMotion(assembly, whole, notation_of(assembly, whole, symbols), "symbolic")
    return FormulaSheet(
        f"Galilei group: {equations.name}", (_statement(equations, *one) for one in _generators(equations))
    )


def _generators(equations: EquationsOfMotion) -> Iterator[tuple[str, str, Moves]]:
    """Yield the generators: name, meaning and displacements of coordinates and along velocities."""
    if None in equations.expressions.moves and equations.multipliers:
        raise UnsupportedError(
            "what constraints on orientations leave over would fill a book",
            where=equations.name,
            advice="See `conserved` for what is conserved.",
        )
    t, q, moves = sympy.Symbol("t"), equations.coordinates, equations.expressions.moves
    forest, space = equations.assembly.maximal.forest, equations.assembly.mechanism.space
    axes = ("x", "xz", "xyz")[len(space.basis) - 1]
    free = [one for one in forest.attachments if len(one.coordinates) == len(axes)]
    angles = [one.coordinate for one in forest.orientations if one.coordinate is not None and space.is_planar]
    known = {*angles, *(i for one in free for i in (*one.coordinates, *one.orientation))}
    if known != set(range(len(q))):
        names = ", ".join(one.name for i, one in enumerate(equations.expressions.names) if i not in known)
        raise UnsupportedError(f"{names} is no place of a body", where=equations.name, advice="See `conserved`.")

    def moved(e: Sympy, n: Sympy) -> Moves:
        """Return what bodies are displaced by along e and a rotation about n."""
        shifts: dict[int, Sympy] = dict.fromkeys(angles, -n[1])  # counter-clockwise is about -y
        along: dict[int, Sympy] = {}
        for one in free:
            place = dict(zip(axes, one.coordinates, strict=True))
            r = sympy.Matrix([q[place[a]] if a in place else 0 for a in "xyz"])
            shifts |= {place[a]: x for a, x in zip("xyz", e + n.cross(r), strict=True) if a in place}
            if one.orientation:
                w, *v = (q[i] for i in one.orientation)
                turned = [-n.dot(sympy.Matrix(v)) / 2, *((w * n + n.cross(sympy.Matrix(v))) / 2)]
                shifts |= dict(zip(one.orientation, turned, strict=True))
                size = sympy.Add(*(x**2 for x in (w, *v)))  # of quaternions it is one
                along |= dict(zip(one.spin, (sympy.expand(x * size) for x in in_body([w, *v], list(n))), strict=True))
        return shifts, along | {k: shifts[i] for k, i in enumerate(moves) if i in shifts}

    still, units = sympy.zeros(3, 1), {a: sympy.Matrix([int(a == b) for b in "xyz"]) for a in "xyz"}
    told = dict(zip(axes, space.axis_names, strict=True))
    for a in axes:
        yield f"P_{told[a]}", f"translation along {told[a]}", moved(units[a], still)
    if len(axes) == 2:
        yield "L", "rotation, counter-clockwise", moved(still, -units["y"])
    for a in axes if len(axes) == 3 else ():
        yield f"L_{a}", f"rotation about {a}", moved(still, units[a])
    for a in axes:
        yield f"K_{told[a]}", f"boost along {told[a]}", moved(t * units[a], still)
    yield "h", "shift in time", ({}, dict(enumerate(equations.velocities)))


def _statement(equations: EquationsOfMotion, name: str, told: str, moves: Moves) -> Statement:
    """Return what a generator conserves, what it does to T and to L, with which gauge term, and what is left over."""
    t, (shifts, along), is_time = sympy.Symbol("t"), moves, name == "h"
    q, u, lagrangian = equations.coordinates, equations.velocities, equations.lagrangian
    rates = {k: along[k].diff(t) for k, place in enumerate(equations.expressions.moves) if place in shifts}

    def explicit(value: Sympy) -> Sympy:
        return sympy.expand(value.diff(t) - sum(value.diff(x) * x.diff(t) for x in (*u, *q)))

    def changed(value: Sympy) -> Sympy:
        if is_time:
            return explicit(value)
        terms = [value.diff(q[i]) * by for i, by in shifts.items()]
        return sympy.expand_mul(sympy.Add(*terms, *(value.diff(u[k]) * by for k, by in rates.items())))

    change = changed(lagrangian)
    f = lagrangian if is_time else _gauge(change, q, t)
    rate = -change if is_time else change - f.diff(t)
    friction, pulls = equations.rayleigh_function, sympy.zeros(len(u), 1)
    if equations.multipliers and not is_time:
        pulls = equations.constraint_jacobian.T * sympy.Matrix(equations.multipliers)
    for k, w in along.items():
        rate += w * (equations.generalized_forces[k] - friction.diff(u[k]) + pulls[k])
    if is_time:
        rate -= sum(x * explicit(g) for x, g in zip(equations.multipliers, equations.constraints, strict=True))
    left = sympy.expand_mul(rate) if sympy.expand(rate) != 0 else sympy.Integer(0)
    value = sympy.expand_mul(sympy.Add(*(equations.momenta[k] * w for k, w in along.items())) - f)
    told = f"{told.capitalize()}{'' if left else ': conserved'}"
    heads = sympy.Matrix([sympy.Symbol(one) for one in (name, "delta_T", "delta_L", "f", f"{name}'")])
    gauge = sympy.Integer(0) if is_time else f
    return Statement(name, told, sympy.Matrix([value, changed(equations.kinetic_energy), change, gauge, left]), heads)


def _gauge(value: Sympy, q: tuple[Sympy, ...], t: Sympy) -> Sympy:
    """Return what a value is the rate of; else what those of its terms with a velocity are that are a rate alone."""
    whole = _primitive(value, q, t)
    if whole is None:
        alone = (_primitive(one, q, t) for one in sympy.Add.make_args(value) if one.has(sympy.Derivative))
        whole = sympy.Add(*(f for f in alone if f is not None))
    return sympy.expand_mul(whole)


def _primitive(value: Sympy, q: tuple[Sympy, ...], t: Sympy) -> Sympy | None:
    """Return a polynomial of coordinates and time whose rate a value is; None if there is none."""
    rates, at = {one.diff(t): sympy.Dummy() for one in q}, {one: sympy.Dummy() for one in q}
    form, share = value.xreplace(rates).xreplace(at), sympy.Dummy()
    if not form.is_polynomial(*rates.values(), *at.values(), t):
        return None
    way, start = ({x: size * x for x in at.values()} for size in (share, 0))
    slopes = (form.diff(u).xreplace(way) * x for u, x in zip(rates.values(), at.values(), strict=True))
    f = sympy.integrate(form.xreplace(dict.fromkeys(rates.values(), sympy.Integer(0))).xreplace(start), t)
    f += sympy.integrate(sympy.expand(sympy.Add(*slopes)), (share, 0, 1))
    f = f.xreplace({x: own for own, x in at.items()})
    return f if sympy.expand(f.diff(t) - value) == 0 else None
