"""Quantities over time, work-precision diagrams, sweeps."""
