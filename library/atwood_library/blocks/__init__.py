"""Blocks of the library: signals worked on, with states of their own, continuous and sampled."""
