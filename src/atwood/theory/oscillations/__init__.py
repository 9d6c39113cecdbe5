"""States of rest and small oscillations as formulas, with their stability as inequalities between parameters."""
