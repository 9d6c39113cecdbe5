"""Linear models of scenes, equilibria, small oscillations: what the equations say near a state."""

from atwood.theory.linearization.branches import (
    BranchPoint,
    EquilibriumBranch,
    EquilibriumBranches,
    equilibrium_branches,
)
from atwood.theory.linearization.equilibria import Equilibria, Equilibrium, equilibria
from atwood.theory.linearization.linear_model import LinearModel
from atwood.theory.linearization.linearize import linearize
from atwood.theory.linearization.normal_modes import NormalModes, normal_modes
from atwood.theory.linearization.root_locus import RootLocus, root_locus
from atwood.theory.linearization.trim import Trim, trim

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
