"""What can be said of a mechanism before it moves: symmetry and the dimension of its motion."""
