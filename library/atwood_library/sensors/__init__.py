"""Sensors of the library."""
