"""Integrators: the protocol they share, event location, and one room for each method; none knows of mechanics."""
