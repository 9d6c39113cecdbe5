"""Joints of the library."""
