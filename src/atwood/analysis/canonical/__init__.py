"""Canonical momenta: the Legendre transform in numbers and in symbols, and which scenes have one."""
