"""Gaps and slips along a run: which hold, impacts, and what is told of both."""
