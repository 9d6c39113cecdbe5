"""Routines with loops and branches, written once and printed for each target."""
