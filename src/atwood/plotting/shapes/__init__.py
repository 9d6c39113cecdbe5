"""Surfaces of bodies and outlines of parts."""
