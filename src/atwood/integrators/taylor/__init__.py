"""Taylor series of adaptive order."""
