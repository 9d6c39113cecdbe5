"""Routh's procedure: ignorable coordinates are taken out, their momenta stay, and a coordinate may be left alone.

``L = q'.M q'/2 + b.q' - U`` (Goldstein, section 1.6). With momenta p of the ignorable coordinates c, and the coordinate
s that is left,

    c' = C^-1 (p - b_c - m s'),    U_eff = U + (p - b_c).C^-1 (p - b_c)/2,    mu = M_ss - m.C^-1 m,

where C and m are the blocks ``M_cc`` and ``M_cs`` (Goldstein, section 8.3: Routh's procedure). Then
``mu s'^2/2 + U_eff = h``; terms of L that are linear in s' change nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from itertools import islice, permutations

import numpy as np

from atwood.arguments import PATHS, TEXT, optional, takes
from atwood.arrays import FloatArray
from atwood.errors import UnsupportedError, UsageError, suggestion
from atwood.forms.assembly import Assembly
from atwood.forms.lagrangian import Lagrangian, lagrangian_of
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE, smooth_assembly_of
from atwood.theory.dynamics.one_coordinate import Parts, PartsAt
from atwood.theory.equations.formulas import EquationFormulas
from atwood.theory.formulas.described import Described
from atwood.theory.formulas.notation import SYMBOLS, notation_of
from atwood.theory.formulas.printers import Sympy, objects
from atwood.theory.formulas.tree import Sum
from atwood.theory.hamiltonian.hamiltonian import with_momenta_of_its_own
from atwood.theory.hamiltonian.phase_space import collected, short
from atwood.theory.hamiltonian.point_transformations import PointTransformation
from atwood.theory.hamiltonian.tidied import length
from atwood.theory.symmetry.find import find_conserved
from atwood.theory.symmetry.proof import Prover
from atwood.theory.symmetry.quantities import Quantities


@dataclass(frozen=True, eq=False)
class Routhian(Described):
    """The Routhian of a scene; sympy expressions of functions of t, as those of `atwood.equations`.

    Attributes
    ----------
    formulas
        What writes the equations of the scene.
    ignorable
        Paths of the coordinates that are taken out.
    """

    formulas: EquationFormulas
    ignorable: tuple[str, ...]

    @property
    def _found(self) -> Lagrangian:
        return self.formulas.expressions

    def _numbers(self) -> tuple[list[int], list[int]]:
        paths = [one.name for one in self._found.names]
        gone = [paths.index(path) for path in self.ignorable]
        return [k for k in range(len(paths)) if k not in gone], gone

    @cached_property
    def _letters(self) -> tuple[Sympy, ...]:
        return tuple(objects.letter(self.formulas.notation.symbols[q]) for q in self._found.coordinates)

    @property
    def coordinates(self) -> tuple[Sympy, ...]:
        """The coordinates that are left, functions of t."""
        return tuple(self._letters[k] for k in self._numbers()[0])

    @property
    def momenta(self) -> tuple[Sympy, ...]:
        """Symbols of the momenta of the ignorable coordinates, which are constants."""
        return tuple(sympy.Symbol(f"p_{self._letters[k].func}") for k in self._numbers()[1])

    @cached_property
    def _parts(self) -> tuple[Sympy, Sympy, Sympy, dict[Sympy, Sympy], tuple[Sympy, ...], tuple[Sympy, ...]]:
        """L on plain symbols, the rates of the ignorable coordinates, their mass matrix, and what symbols stand for."""
        left, gone = self._numbers()
        found, t = self._found, sympy.Symbol("t")
        linear = found.lagrangian - found.kinetic + found.potential
        written = [self.formulas.formula(one, energy=True) for one in (found.kinetic, found.potential, linear)]
        whole = _formula(written[0]) - _formula(written[1]) + _formula(written[2])
        rates = [sympy.Symbol(f"{one.func}'") for one in self._letters]
        places = [sympy.Dummy(str(one.func)) for one in self._letters]
        back = dict(zip(places, self._letters, strict=True))
        back |= {rate: one.diff(t) for rate, one in zip(rates, self._letters, strict=True)}
        plain = whole.xreplace({one.diff(t): rate for one, rate in zip(self._letters, rates, strict=True)})
        plain = plain.xreplace(dict(zip(self._letters, places, strict=True)))
        own = [rates[k] for k in gone]
        still = dict.fromkeys(own, sympy.Integer(0))
        momenta = sympy.Matrix([plain.diff(rate) for rate in own])
        free = sympy.Matrix(self.momenta) - momenta.xreplace(still)
        mass = momenta.jacobian(own).applyfunc(short) if own else sympy.zeros(0, 0)
        determinant = short(mass.det(method="berkowitz")) if own else sympy.Integer(1)
        if determinant == 0:
            raise UnsupportedError(
                "its mass matrix is singular: momenta do not determine the velocities", where=self.formulas.name
            )
        solved = (mass.adjugate() * free).applyfunc(lambda one: short(one / determinant)) if own else free
        others = tuple(rates[k] for k in left)
        return plain, solved, mass, back, tuple(own), others

    @cached_property
    def expression(self) -> Sympy:
        """The Routhian ``R = sum p c' - L`` in what is left (Goldstein, equation 8.48)."""
        plain, solved, _, back, own, others = self._parts
        rates = dict(zip(own, solved, strict=True))
        total = sympy.Add(*(p * w for p, w in zip(self.momenta, solved, strict=True))) - plain.xreplace(rates)
        moving = total - total.xreplace(dict.fromkeys(others, 0))
        whole, rest = (collected(one, [*self.momenta, *others]).xreplace(back) for one in (total, moving))
        return min(whole, rest + self.effective_potential, key=length)

    @cached_property
    def effective_potential(self) -> Sympy:
        """The Routhian where the coordinates that are left are at rest: their effective potential, J."""
        plain, _, mass, back, own, others = self._parts
        linear, still = plain.xreplace(dict.fromkeys(others, 0)), dict.fromkeys(own, 0)
        free = sympy.Matrix([p - linear.diff(rate).xreplace(still) for p, rate in zip(self.momenta, own, strict=True)])
        static = short(-linear.xreplace(still))
        ways = [static + _squares(mass, free, order) for order in islice(permutations(range(len(own))), _ORDERS)]
        written = [*ways, short(ways[0]), collected(ways[0], self.momenta)]
        return min(written, key=length).xreplace(back)

    @property
    def values(self) -> dict[Sympy, float]:
        """The value of each parameter's symbol, in SI units."""
        return {objects.letter(one): one.value for one in self.formulas.legend if one.value is not None}

    @property
    def rates(self) -> dict[str, Sympy]:
        """The derivatives of the ignorable coordinates in what is left, by path."""
        _, solved, _, back, _, _ = self._parts
        return {path: one.xreplace(back) for path, one in zip(self.ignorable, solved, strict=True)}

    @property
    def equations(self) -> tuple[Sympy, ...]:
        """The equations of motion of what is left, each zero: ``d/dt dR/ds' - dR/ds`` (Goldstein, equation 8.50)."""
        t, r = sympy.Symbol("t"), self.expression
        return tuple(r.diff(one.diff(t)).diff(t) - r.diff(one) for one in self.coordinates)

    def __repr__(self) -> str:
        return f"<Routhian of {self.formulas.name}, {', '.join(self.ignorable) or 'nothing'} ignored>"


_ORDERS = 6
"""So many orders are tried in which squares of momenta are completed."""


def _squares(mass: Sympy, free: Sympy, order: Sequence[int]) -> Sympy:
    """Return ``p.M^-1 p / 2`` as a sum of squares, completed in an order of the momenta."""
    total = sympy.Integer(0)
    for k in order:
        size, column, own = short(mass[k, k]), mass[:, k], short(free[k])
        total += own**2 / 2 / sympy.factor(size)
        mass, free = mass - column * column.T / size, free - column * own / size
    return total


def _formula(written: Sum) -> Sympy:
    return objects.formula(written)


@takes(scene=SCENE, ignorable=optional(PATHS), orientation=optional(TEXT), symbols=SYMBOLS)
def routhian(
    scene: Model | Assembly,
    ignorable: Sequence[str] | None = None,
    *,
    orientation: str | None = None,
    symbols: Mapping[str, str] | None = None,
) -> Routhian:
    """Return the Routhian of a scene: its ignorable coordinates are taken out, and their momenta stay as constants.

    Parameters
    ----------
    scene
        The scene, or an assembly of it.
    ignorable
        Paths of the coordinates that are taken out; all that are ignorable if not given.
    orientation
        Euler angles in which orientations in space are; ``"euler-zxz"`` if not given.
    symbols
        See `atwood.equations`.

    Raises
    ------
    UsageError
        If a coordinate is not ignorable.
    UnsupportedError
        If closed loops tie the coordinates, the scene rolls, or its mass matrix is singular.
    """
    assembly, found, names = ignorable_of(scene, orientation)
    chosen = names if ignorable is None else tuple(ignorable)
    for path in chosen:
        if path not in names:
            told = f"Ignorable are {', '.join(names)}." if names else "None is."
            raise UsageError(
                "it is not ignorable", where=f"{assembly.flat.name}: {path}", advice=suggestion(path, names) or told
            )
    return routhian_of(assembly, found, chosen, symbols)


def routhian_of(
    assembly: Assembly, found: Lagrangian, ignorable: tuple[str, ...], symbols: Mapping[str, str] | None
) -> Routhian:
    """Return the Routhian with some coordinates taken out."""
    return Routhian(EquationFormulas(assembly, found, notation_of(assembly, found, symbols)), ignorable)


def ignorable_of(scene: Model | Assembly, orientation: str | None) -> tuple[Assembly, Lagrangian, tuple[str, ...]]:
    """Return a scene in coordinates with momenta, its Lagrangian, and the paths of its ignorable coordinates."""
    assembly = with_momenta_of_its_own(smooth_assembly_of(scene, orientation=orientation))
    found = lagrangian_of(assembly, "reduced")
    quantities = Quantities(assembly, found)
    kept = find_conserved(assembly, quantities, Prover(quantities, notation_of(assembly, found)))
    if "h" not in [one.name for one in kept.items]:
        raise UnsupportedError(
            "its energy function is not conserved", where=assembly.flat.name, advice="; ".join(kept.notes)
        )
    names = tuple(one.name.removeprefix("p:") for one in kept.items if one.kind == "ignorable coordinate")
    return assembly, found, names


def transformed_parts(given: PointTransformation, along: int) -> PartsAt:
    """Return what gives the parts of a Lagrangian in new coordinates at places; see `parts_of`."""
    name = given.source.name
    whole = given.lagrangian.xreplace(given.source.values)
    if whole.has(sympy.Symbol("t")):
        raise UnsupportedError("its Lagrangian depends on time in these coordinates", where=name)
    still = dict.fromkeys(given.velocities, sympy.Integer(0))
    momenta = [whole.diff(one) for one in given.velocities]
    mass = [one.diff(other) for one in momenta for other in given.velocities]
    if any(one.has(*given.velocities) for one in mass):
        raise UnsupportedError("its Lagrangian is of higher degree in the velocities", where=name)
    values = [*mass, *(one.xreplace(still) for one in momenta), -whole.xreplace(still)]
    slopes = [one.diff(given.coordinates[along]) for one in values]
    function = sympy.lambdify(given.coordinates, [*values, *slopes], "numpy")
    n = len(given.coordinates)

    def at(q: FloatArray) -> Parts:
        with np.errstate(all="ignore"):
            found = [np.broadcast_to(np.asarray(one, dtype=float), q.shape[1]) for one in function(*q)]
        rows = np.array(found).reshape(2, n * n + n + 1, -1)
        made = [(one[: n * n].reshape(n, n, -1), one[n * n : -1], one[-1]) for one in rows]
        return Parts(*made[0], *made[1])

    return at
