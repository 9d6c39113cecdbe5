"""The equations of motion of a scene, to be read."""

from __future__ import annotations

from typing import Any

from atwood.analysis.equations import EquationsOfMotion, PartOfEquations, read_equations
from atwood.arguments import one_of, optional, takes
from atwood.forms.assembly import Assembly
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE, assembly_of
from atwood.simulation.problem.arguments import FORM, ORIENTATION

__all__ = ["EquationsOfMotion", "PartOfEquations", "equations"]

PARAMETERS = one_of(("symbolic", "values"))


@takes(scene=SCENE, form=optional(FORM), parameters=PARAMETERS, orientation=optional(ORIENTATION))
def equations(
    scene: Model | Assembly,
    *,
    form: str | None = None,
    parameters: str = "symbolic",
    orientation: str | None = None,
) -> EquationsOfMotion:
    """Return the equations of motion of a scene, to be read.

    Lagrange's equations ``d/dt dL/dq' - dL/dq + dR/dq' = Q + G^T lambda``, ``g(q, t) = 0``, with symbols as in a
    textbook (theta_1, x, m, l, g) and a legend that says what they stand for. Formulas are short: what belongs together
    is put together, sums and differences of angles are recognised. Shown in a notebook, or by `latex`, `markdown`,
    `text` and `python`; everything else is sympy objects.

    Parameters
    ----------
    scene
        The scene, or an assembly of it; what contradicts that is refused.
    form
        ``"reduced"``, as usual: generalized coordinates (Lagrange's equations of the second kind); constraints of
        closed loops stay, with multipliers. ``"dae"``: every joint is a constraint with a multiplier (of the first
        kind).
    parameters
        ``"symbolic"``, or ``"values"``: then the numbers are put in.
    orientation
        See `atwood.assemble`. With Euler angles L is a function of these and their derivatives; with quaternions the
        velocities are angular velocities in the axes of the body.

    Returns
    -------
    EquationsOfMotion
        Energies, momenta, mass matrix, forces, constraints and equations. What is too large to be read says so, and
        shows its structure.

    Raises
    ------
    UsageError
        If orientations are in three coordinates that are no Euler angles.
    """
    assembly = assembly_of(scene, form=form, orientation=orientation)
    chosen: Any = parameters
    return read_equations(assembly, chosen)
