"""Runs: the choice of solver, segments, sessions, and what is recorded."""
