"""Inertia, forces and the equations of motion."""
