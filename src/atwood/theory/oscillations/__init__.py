"""States of rest and small oscillations as formulas, with their stability as inequalities between parameters."""

from atwood.theory.oscillations.equilibria import SymbolicEquilibria, SymbolicEquilibrium
from atwood.theory.oscillations.modes import SymbolicMode, SymbolicModes

__all__ = ["SymbolicEquilibria", "SymbolicEquilibrium", "SymbolicMode", "SymbolicModes"]
