"""Scenes that a page computes itself: their programs as JavaScript, and the engine that runs them."""

from atwood.plotting.live.program import LiveProgram, engine_script, live_program

__all__ = ["LiveProgram", "engine_script", "live_program"]
