"""What is conserved along the motions of an assembly: candidates, proofs on the graph, and checks at random states."""
