"""Scenes as C99: their equations, the method and all that follows a motion, in one file without libraries."""
