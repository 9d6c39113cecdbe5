"""Scenes with ignorable coordinates: Routhian, effective potential, and motions by quadrature."""
