"""First variations of a scene's equations about a state: linear models, modes, steady motions, equilibria."""
