"""The command line. Its modules import what is heavy only inside the functions that need it."""

from atwood.cli.app import main

__all__ = ["main"]
