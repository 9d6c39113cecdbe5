"""C99 of programs and routines."""
