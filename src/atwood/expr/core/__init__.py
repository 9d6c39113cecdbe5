"""Nodes, local algebra, operations, derivatives, programs, and questions about expressions."""
