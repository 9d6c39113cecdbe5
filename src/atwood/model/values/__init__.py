"""Values that laws compute with: units, vectors, rotations, spaces."""
