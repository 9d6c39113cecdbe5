"""Poisson brackets, canonical transformations, and scenes in other coordinates."""

from atwood.theory.canonical.brackets import (
    fundamental_brackets,
    poisson_bracket,
    poisson_brackets,
    total_derivative,
)
from atwood.theory.canonical.points import PointTransformation, point_transformation
from atwood.theory.canonical.transformations import (
    CanonicalTransformation,
    canonical_transformation,
    generated_transformation,
)

__all__ = [
    "CanonicalTransformation",
    "PointTransformation",
    "canonical_transformation",
    "fundamental_brackets",
    "generated_transformation",
    "point_transformation",
    "poisson_bracket",
    "poisson_brackets",
    "total_derivative",
]
