"""Mechanisms in a plane and on a line."""
