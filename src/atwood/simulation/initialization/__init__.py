"""Consistent initial values: positions, speeds, loop closure, mobility, and the report on what moved."""
