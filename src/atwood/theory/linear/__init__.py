"""Linear models of scenes, equilibria, small oscillations: what the equations say near a state."""
