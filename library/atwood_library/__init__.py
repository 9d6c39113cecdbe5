"""The standard component library of Atwood."""
