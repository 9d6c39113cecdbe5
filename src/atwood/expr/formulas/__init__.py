"""Formulas for people: to and from sympy."""
