"""The balance of forces in numbers: accelerations, multipliers, rank, coordinates, scales."""
