"""From a kernel to a motion: start values, integration, events, accuracy."""
