"""A scene taken apart into leaves, and the laws of each on symbols of its own."""
