"""Results: trajectories, energies, and files."""
