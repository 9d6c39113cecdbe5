"""Derivatives of a run by parameters and starts, and what is fitted with them."""
