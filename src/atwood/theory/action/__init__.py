"""The action of motions and paths, motions between given ends, and the theory of Hamilton and Jacobi."""

from atwood.theory.action.action_angle import ActionAngle, action_angle
from atwood.theory.action.adiabatic import AdiabaticInvariant, adiabatic_invariant
from atwood.theory.action.boundary_values import JoiningMotion, boundary_value_motions
from atwood.theory.action.integral import Action, SecondVariation, Variation, action
from atwood.theory.action.principal import PrincipalFunction, principal_function
from atwood.theory.action.separation import SeparatedMotion, Separation, separation

__all__ = [
    "Action",
    "ActionAngle",
    "AdiabaticInvariant",
    "JoiningMotion",
    "PrincipalFunction",
    "SecondVariation",
    "SeparatedMotion",
    "Separation",
    "Variation",
    "action",
    "action_angle",
    "adiabatic_invariant",
    "boundary_value_motions",
    "principal_function",
    "separation",
]
