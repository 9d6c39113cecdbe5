"""Programs as plain Python and NumPy: the reference for machine code."""
