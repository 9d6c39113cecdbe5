"""Topology: nodes, joints, bodies, and the forest in which configurations are computed; no algebra."""
