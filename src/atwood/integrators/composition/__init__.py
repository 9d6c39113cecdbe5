"""Symmetric compositions of the method of Stoermer and Verlet, of orders 2 to 8, where H = T(p) + V(q, t)."""
