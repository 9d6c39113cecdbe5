"""Symplectic methods of equal steps for Hamilton's equations: those of Gauss, and symmetric compositions."""
