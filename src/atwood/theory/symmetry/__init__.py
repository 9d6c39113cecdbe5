"""Symmetries and what they conserve: candidates, proofs on the graph, and checks at random states."""

from atwood.theory.symmetry.conserved import Conserved, ConservedQuantity, conserved
from atwood.theory.symmetry.galilean import galilean
from atwood.theory.symmetry.moved import MovedScene, moved
from atwood.theory.symmetry.stated import Symmetry

__all__ = ["Conserved", "ConservedQuantity", "MovedScene", "Symmetry", "conserved", "galilean", "moved"]
