"""Equations in the form that an expert would write by hand, where that costs less."""
