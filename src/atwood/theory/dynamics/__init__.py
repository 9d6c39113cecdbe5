"""The dynamics of a scene as functions of numbers, and the start values that conditions ask for."""
