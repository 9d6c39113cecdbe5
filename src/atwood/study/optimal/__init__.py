"""Motions that cost least: optimal control by collocation."""
