"""Rigid bodies as formulas: rotations, inertia tensors, free bodies, tops, Foucault's pendulum."""

from atwood.theory.rigid.angles import rotation_kinematics
from atwood.theory.rigid.bodies import rigid_body
from atwood.theory.rigid.frames import foucault_formulas
from atwood.theory.rigid.free import FreeRotation, free_body, free_rotation
from atwood.theory.rigid.tensors import inertia_tensor
from atwood.theory.rigid.tops import SymmetricTop, symmetric_top, top_formulas

__all__ = [
    "FreeRotation",
    "SymmetricTop",
    "foucault_formulas",
    "free_body",
    "free_rotation",
    "inertia_tensor",
    "rigid_body",
    "rotation_kinematics",
    "symmetric_top",
    "top_formulas",
]
