"""What analytical mechanics says of a scene: a subject a room, each with its derivation and its public functions."""
