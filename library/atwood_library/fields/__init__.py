"""Fields and interactions: charges, potentials, attraction of pairs, laws of joint coordinates."""
