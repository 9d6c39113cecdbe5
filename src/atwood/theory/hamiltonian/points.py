"""Point transformations: a scene in other coordinates, ``q = q(Q, t)``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from atwood.arguments import BY_PATH, check, command, takes
from atwood.errors import UsageError, suggestion
from atwood.forms.assembly import Assembly
from atwood.late import dataclass
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE
from atwood.theory.equations.equations import equations
from atwood.theory.hamiltonian.arguments import EXPRESSION, SYMBOLS
from atwood.theory.hamiltonian.hamiltonian import Hamiltonian, hamiltonian
from atwood.theory.hamiltonian.phase_space import Sympy, collected, phase_space_of, short

__all__ = ["PointTransformation", "point_transformation"]


@dataclass(frozen=True, eq=False)
class PointTransformation:
    """A scene in new coordinates; everything in sympy, with new coordinates and momenta as symbols.

    Attributes
    ----------
    coordinates, velocities, momenta
        Symbols of the new coordinates, of their derivatives, and of their momenta.
    old
        What the old coordinates are in terms of the new and of time.
    lagrangian
        L in new coordinates and velocities.
    definitions
        The new momenta ``dL/dQ'`` in terms of velocities.
    hamiltonian
        The new Hamiltonian: ``K = H + dF/dt`` with ``F = P . Q(q, t)``.
    source
        The Hamiltonian in the old coordinates.
    """

    coordinates: tuple[Sympy, ...]
    velocities: tuple[Sympy, ...]
    momenta: tuple[Sympy, ...]
    old: Mapping[Sympy, Sympy]
    lagrangian: Sympy
    definitions: tuple[Sympy, ...]
    hamiltonian: Sympy
    source: Hamiltonian

    @property
    def ignorable(self) -> tuple[Sympy, ...]:
        """The new coordinates that K does not depend on: their momenta are conserved."""
        return tuple(one for one in self.coordinates if not self.hamiltonian.has(one))

    def __repr__(self) -> str:
        return f"<PointTransformation to {', '.join(map(str, self.coordinates))}: K = {self.hamiltonian}>"


@command("transform")
@takes(scene=SCENE, old=BY_PATH, coordinates=SYMBOLS)
def point_transformation(
    scene: Model | Assembly, old: Mapping[str, Any], coordinates: Sequence[Any]
) -> PointTransformation:
    """Return a scene in other coordinates: polar, relative and of the centre of mass, in a rotating frame.

    Parameters
    ----------
    scene
        The scene, or an assembly of it.
    old
        Every coordinate of the scene by its path, in terms of the new ones, parameters and t; in sympy.
    coordinates
        Symbols of the new coordinates, as many as old ones.

    Returns
    -------
    PointTransformation
        L, momenta and Hamiltonian in the new coordinates.

    Raises
    ------
    UsageError
        If a coordinate is missing or there is none of that path, or the new ones do not determine the old.
    UnsupportedError
        If the scene has no Hamiltonian in symbols.
    """
    import sympy

    h: Hamiltonian = hamiltonian(scene)
    old = {path: check(EXPRESSION, value, path, "point_transformation") for path, value in old.items()}
    for path in old:
        if path not in h.paths:
            told = suggestion(path, h.paths) or f"There are {', '.join(h.paths)}."
            raise UsageError("no coordinate has this path", where=path, advice=told)
    missing = [path for path in h.paths if path not in old]
    n = len(h.paths)
    new = tuple(coordinates)
    if missing or len(new) != n or len(set(new)) != n:
        told = f"{missing[0]} is not given" if missing else f"{n} new coordinates are needed"
        advice = f"Give {', '.join(h.paths)}, each in terms of {n} new ones that are all different."
        raise UsageError(f"the coordinates are not all transformed: {told}", where=h.name, advice=advice)
    values = [old[path] for path in h.paths]
    rates = tuple(sympy.Symbol(f"{one.name}'") for one in new)
    momenta = tuple(sympy.Symbol(f"p_{one.name}") for one in new)
    t = sympy.Symbol("t")
    by_new = sympy.Matrix([[one.diff(x) for x in new] for one in values])
    determinant = short(by_new.det(method="berkowitz"))
    if determinant == 0:
        raise UsageError(
            "the new coordinates do not determine the old ones: they depend on each other",
            where=h.name,
            advice="Give as many independent coordinates as the scene has.",
        )
    inverse = by_new.adjugate().applyfunc(lambda one: short(one / determinant))
    explicit = sympy.Matrix([one.diff(t) for one in values])
    space = phase_space_of(h)
    own_p = inverse.T * sympy.Matrix(momenta)
    where = dict(zip((*space.coordinates, *space.momenta), (*values, *own_p), strict=True))
    moved = (sympy.Matrix(momenta).T * inverse * explicit)[0, 0]
    k = collected(space.read(h.expression).xreplace(where) - moved, momenta)
    velocities = list(by_new * sympy.Matrix(rates) + explicit)
    eq = equations(h.assembly)
    letters = dict(zip(eq.velocities, velocities, strict=True))
    lagrangian = eq.lagrangian.xreplace(letters).xreplace(dict(zip(eq.coordinates, values, strict=True)))
    lagrangian = collected(lagrangian, rates)
    definitions = tuple(short(lagrangian.diff(one)) for one in rates)
    return PointTransformation(
        new, rates, momenta, dict(zip(h.coordinates, values, strict=True)), lagrangian, definitions, k, h
    )
