"""Linear algebra on plain arrays and on the entries of large matrices; it knows nothing of mechanics."""
