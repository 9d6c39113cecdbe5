"""Closed loops that are solved by formulas."""
