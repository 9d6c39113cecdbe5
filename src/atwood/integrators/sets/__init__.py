"""Routines of a set of contacts: impacts, which gaps and slips hold, and shares of their forces."""
