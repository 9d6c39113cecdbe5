"""A form of a scene as a problem for an integrator, and the options of a run."""
