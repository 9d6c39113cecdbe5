"""Explicit Runge-Kutta pairs: their steps, error estimates and dense output, for any tableau."""
