"""Scenes of the library."""
