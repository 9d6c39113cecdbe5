"""Ropes of the library."""
