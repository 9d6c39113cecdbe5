"""Routh's procedure: ignorable coordinates are taken out, and their momenta stay."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

from atwood.arguments import PATHS, TEXT, optional, takes
from atwood.errors import UnsupportedError, UsageError, suggestion
from atwood.forms.assembly import Assembly
from atwood.forms.lagrangian import Lagrangian, lagrangian_of
from atwood.lazy_dataclasses import dataclass
from atwood.lazy_modules import sympy
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE, assembly_of
from atwood.theory.equations.formulas import EquationFormulas
from atwood.theory.formulas.notation import notation_of
from atwood.theory.formulas.printers import objects
from atwood.theory.formulas.tree import Sum
from atwood.theory.hamiltonian.phase_space import Sympy, collected, short
from atwood.theory.symmetry.find import find_conserved
from atwood.theory.symmetry.proof import Prover
from atwood.theory.symmetry.quantities import Quantities
from atwood.topology.orientation_coordinates import Orientation

_EULER = "euler-zxz"


@dataclass(frozen=True, eq=False)
class Routhian:
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
        """L on plain symbols, the rates of the ignorable coordinates, and what the symbols stand for."""
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
        return plain, solved, momenta, back, tuple(own), others

    @cached_property
    def expression(self) -> Sympy:
        """The Routhian ``R = sum p c' - L`` in what is left (Goldstein, equation 8.48)."""
        plain, solved, _, back, own, others = self._parts
        rates = dict(zip(own, solved, strict=True))
        total = sympy.Add(*(p * w for p, w in zip(self.momenta, solved, strict=True))) - plain.xreplace(rates)
        return collected(total, [*self.momenta, *others]).xreplace(back)

    @cached_property
    def effective_potential(self) -> Sympy:
        """The Routhian where the coordinates that are left are at rest: their effective potential, J."""
        plain, solved, _, back, own, others = self._parts
        still = dict.fromkeys(others, sympy.Integer(0))
        rates = {rate: w.xreplace(still) for rate, w in zip(own, solved, strict=True)}
        total = sympy.Add(*(p * w for p, w in zip(self.momenta, rates.values(), strict=True)))
        total = total - plain.xreplace(still).xreplace(rates)
        return min((short(total), collected(total, self.momenta)), key=lambda one: int(one.count_ops())).xreplace(back)

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


def _formula(written: Sum) -> Sympy:
    return objects.formula(written)


@takes(scene=SCENE, ignorable=optional(PATHS), orientation=optional(TEXT))
def routhian(
    scene: Model | Assembly, ignorable: Sequence[str] | None = None, *, orientation: str | None = None
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
    return routhian_of(assembly, found, chosen)


def routhian_of(assembly: Assembly, found: Lagrangian, ignorable: tuple[str, ...]) -> Routhian:
    """Return the Routhian with some coordinates taken out."""
    return Routhian(EquationFormulas(assembly, found, notation_of(assembly, found)), ignorable)


def ignorable_of(scene: Model | Assembly, orientation: str | None) -> tuple[Assembly, Lagrangian, tuple[str, ...]]:
    """Return a scene in coordinates with momenta, its Lagrangian, and the paths of its ignorable coordinates."""
    from atwood.theory.hamiltonian.legendre import refuse_without_hamiltonian

    assembly = assembly_of(scene, orientation=orientation)
    refuse_without_hamiltonian(assembly)
    if any(one.kind == "quaternion" for one in assembly.reduced.orientation_coordinates):
        assembly = assembly.other_mode(assembly.modes, {}, Orientation(_EULER))
    found = lagrangian_of(assembly, "reduced")
    quantities = Quantities(assembly, found)
    kept = find_conserved(assembly, quantities, Prover(quantities, notation_of(assembly, found)))
    if "h" not in [one.name for one in kept.items]:
        raise UnsupportedError(
            "its energy function is not conserved", where=assembly.flat.name, advice="; ".join(kept.notes)
        )
    names = tuple(one.name.removeprefix("p:") for one in kept.items if one.kind == "ignorable coordinate")
    return assembly, found, names
