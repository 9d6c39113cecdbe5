"""The action of motions and paths, motions between given ends, and the theory of Hamilton and Jacobi."""
