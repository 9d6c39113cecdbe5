"""Symmetries and what they conserve: candidates, proofs on the graph, and checks at random states."""
