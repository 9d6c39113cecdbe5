"""Formulas for people to read: names as in a textbook, terms in order, and how they are written down."""
