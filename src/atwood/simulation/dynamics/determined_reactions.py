"""Reactions that laws of force read must be determined: with redundant constraints none is told from the others."""

from __future__ import annotations

import numpy as np

from atwood.arrays import FloatArray
from atwood.errors import UnsupportedError
from atwood.forms.assembly import Assembly
from atwood.simulation.dynamics.balance import balance_of
from atwood.simulation.dynamics.reactions import maximal_state
from atwood.simulation.dynamics.redundancy import find_rank
from atwood.simulation.dynamics.scales import motion_scales

__all__ = ["check_read_reactions"]


def check_read_reactions(assembly: Assembly, t: float, q: FloatArray, u: FloatArray, length: float) -> None:
    """Refuse a scene with redundant constraints in which a force reads a reaction.

    Parameters
    ----------
    assembly
        The scene.
    t, q, u
        A state in the coordinates of the form.
    length
        Extent of the scene, m.

    Raises
    ------
    UnsupportedError
        If there are; with the reaction's constraint, and the constraints that follow from the others.
    """
    if not assembly.own_equations.read:
        return
    maximal = assembly.maximal
    big_q, _ = maximal_state(assembly, np.array([t]), q[:, None], u[:, None])
    finding = find_rank(balance_of(assembly, "dae"), t, big_q[:, 0], motion_scales(maximal, length))
    if finding.redundant:
        read = next(iter(assembly.own_equations.read)).name.removeprefix("lambda:")
        follow = ", ".join(maximal.constraints[i].label for i in finding.redundant)
        raise UnsupportedError(
            f"a force reads the reaction of {read}, and constraints of the scene are redundant ({follow} follow from "
            "the others), so that reactions are not determined",
            where=read.partition("[")[0].rpartition(".")[0],
            advice="Remove the redundancy: use a joint that leaves free what the other joints already constrain.",
        )
