"""Positions, orientations and velocities of every node and body."""
