"""How neighbouring motions move: the variational equations along a motion, and what they do to volumes."""
