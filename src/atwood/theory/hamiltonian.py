"""The Hamiltonian of a scene."""

from __future__ import annotations

from typing import Any

from atwood.analysis.hamiltonian import Hamiltonian, read_hamiltonian
from atwood.arguments import optional, takes
from atwood.forms.assembly import Assembly
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE, assembly_of
from atwood.simulation.problem.arguments import ORIENTATION
from atwood.theory.equations import PARAMETERS

__all__ = ["Hamiltonian", "hamiltonian"]


@takes(scene=SCENE, parameters=PARAMETERS, orientation=optional(ORIENTATION))
def hamiltonian(
    scene: Model | Assembly, *, parameters: str = "symbolic", orientation: str | None = None
) -> Hamiltonian:
    """Return the Hamiltonian of a scene, ``H(q, p, t) = p q' - L`` with ``p = dL/dq'``.

    In symbols where it is short, in numbers always (Goldstein, section 8.1). Forces that are linear in the velocities,
    as of magnetic fields, are in it by their potentials; prescribed motions make it differ from T + V, or depend on
    time; dampers and loads come on top of it, and it says which parts they are.

    Parameters
    ----------
    scene
        The scene, or an assembly of it in the reduced form.
    parameters
        ``"symbolic"``, or ``"values"``: then the numbers are put in.
    orientation
        Euler angles in which orientations in space are; quaternions have no momenta, and ``"euler-zxz"`` takes their
        place.

    Returns
    -------
    Hamiltonian
        Its expression, coordinates and momenta in sympy, and H, its derivatives and Hamilton's equations in numbers.

    Raises
    ------
    UnsupportedError
        If there is none: the scene rolls, closed loops tie its coordinates, parts have states of their own, or its mass
        matrix is singular.
    UsageError
        If an assembly is in the dae form.
    """
    assembly = assembly_of(scene, orientation=orientation)
    chosen: Any = parameters
    return read_hamiltonian(assembly, chosen)
