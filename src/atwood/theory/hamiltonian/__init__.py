"""Hamiltonian mechanics: the Legendre transform, Poisson brackets, canonical and point transformations."""
