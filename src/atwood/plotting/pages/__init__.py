"""Pages that show scenes moving, each one file that needs nothing else."""
