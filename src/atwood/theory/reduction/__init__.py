"""Scenes with ignorable coordinates: Routhian, effective potential, and motions by quadrature."""

from atwood.theory.reduction.reduced import ReducedMotion, reduced
from atwood.theory.reduction.routhian import Routhian, routhian

__all__ = ["ReducedMotion", "Routhian", "reduced", "routhian"]
