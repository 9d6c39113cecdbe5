"""Rigid bodies as formulas: rotations, inertia tensors, bodies in their principal axes."""

from atwood.theory.rigid.angles import rotation_kinematics
from atwood.theory.rigid.bodies import rigid_body
from atwood.theory.rigid.tensors import inertia_tensor

__all__ = ["inertia_tensor", "rigid_body", "rotation_kinematics"]
