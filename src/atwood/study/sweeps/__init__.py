"""Sweeps over parameters and starts."""
