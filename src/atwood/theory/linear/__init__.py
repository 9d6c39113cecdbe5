"""Linear models of scenes, equilibria, small oscillations: what the equations say near a state."""

from atwood.theory.linear.branches import (
    BranchPoint,
    EquilibriumBranch,
    EquilibriumBranches,
    equilibrium_branches,
)
from atwood.theory.linear.equilibria import Equilibria, Equilibrium, equilibria
from atwood.theory.linear.linear_model import LinearModel
from atwood.theory.linear.linearize import linearize
from atwood.theory.linear.normal_modes import NormalModes, RootLocus, normal_modes, root_locus
from atwood.theory.linear.steady import Trim, trim

__all__ = [
    "BranchPoint",
    "Equilibria",
    "Equilibrium",
    "EquilibriumBranch",
    "EquilibriumBranches",
    "LinearModel",
    "NormalModes",
    "RootLocus",
    "Trim",
    "equilibria",
    "equilibrium_branches",
    "linearize",
    "normal_modes",
    "root_locus",
    "trim",
]
