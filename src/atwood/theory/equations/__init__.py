"""The equations of motion of a scene, derived and written down."""

from atwood.theory.equations.equations import EquationsOfMotion, PartOfEquations, equations

__all__ = ["EquationsOfMotion", "PartOfEquations", "equations"]
