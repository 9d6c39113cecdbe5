"""Forces of the library."""
