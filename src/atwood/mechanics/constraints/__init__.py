"""Constraints: values and rates, elimination, and constraints on velocities."""
