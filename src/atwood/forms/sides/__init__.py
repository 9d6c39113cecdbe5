"""Relations of what moves as parameters of the programs that are run."""
