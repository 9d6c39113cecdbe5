"""Rigid bodies as formulas: rotations, inertia tensors, free bodies, tops, Foucault's pendulum."""
