"""From an assembled scene to its motion."""
