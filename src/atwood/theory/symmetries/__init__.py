"""Symmetries of scenes and what they conserve."""

from atwood.theory.symmetries.conserved import Conserved, ConservedQuantity, conserved
from atwood.theory.symmetries.stated import Symmetry

__all__ = ["Conserved", "ConservedQuantity", "Symmetry", "conserved"]
