"""Mechanisms in space."""
