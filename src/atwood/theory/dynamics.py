"""The dynamics of a scene as functions of numbers."""

from __future__ import annotations

from atwood.analysis.dynamics import Dynamics
from atwood.arguments import optional, takes
from atwood.forms.assembly import Assembly
from atwood.model.compose.composite import Model
from atwood.pipeline import SCENE, assembly_of
from atwood.simulation.problem.arguments import FORM, ORIENTATION

__all__ = ["Dynamics", "dynamics"]


@takes(scene=SCENE, form=optional(FORM), orientation=optional(ORIENTATION))
def dynamics(scene: Model | Assembly, *, form: str | None = None, orientation: str | None = None) -> Dynamics:
    """Return the dynamics of a scene as functions of numbers, for control, optimisation and teaching.

    Mass matrix, bias, constraint Jacobian, inverse and forward dynamics, and Jacobians of quantities: compiled when
    they are first called, for one state or for many, for trees and for closed loops.

    Parameters
    ----------
    scene
        The scene, or an assembly of it; what contradicts that is refused.
    form, orientation
        See `atwood.assemble`.

    Returns
    -------
    Dynamics
        Its functions.
    """
    return Dynamics(assembly_of(scene, form=form, orientation=orientation))
