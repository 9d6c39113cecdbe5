"""Programs and routines as C99."""
