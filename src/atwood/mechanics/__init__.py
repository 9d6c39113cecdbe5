"""Mechanics: placements, inertia, forces, equations of motion, and what can be observed."""
