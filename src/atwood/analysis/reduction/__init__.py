"""Motions of one coordinate, the others being ignorable: effective potential, turning points and quadratures."""
