"""Hamiltonian mechanics: the Legendre transform, Poisson brackets, canonical and point transformations."""

from atwood.theory.hamiltonian.conjugate import Conjugate, legendre_transform
from atwood.theory.hamiltonian.flow import Algebra, Flow, bracket_algebra, flow_of
from atwood.theory.hamiltonian.hamiltonian import Hamiltonian, hamiltonian
from atwood.theory.hamiltonian.point_transformations import PointTransformation, point_transformation
from atwood.theory.hamiltonian.transformations import (
    CanonicalTransformation,
    canonical_transformation,
    fundamental_brackets,
    generated_transformation,
    poisson_bracket,
    poisson_brackets,
    total_derivative,
)

__all__ = [
    "Algebra",
    "CanonicalTransformation",
    "Conjugate",
    "Flow",
    "Hamiltonian",
    "PointTransformation",
    "bracket_algebra",
    "canonical_transformation",
    "flow_of",
    "fundamental_brackets",
    "generated_transformation",
    "hamiltonian",
    "legendre_transform",
    "point_transformation",
    "poisson_bracket",
    "poisson_brackets",
    "total_derivative",
]
