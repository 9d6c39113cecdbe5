"""Mechanisms whose constraints stay, as programs for methods that need accelerations and states on the constraints."""
