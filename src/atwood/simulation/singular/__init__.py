"""Singular positions: the monitor that finds them and the crossing."""
