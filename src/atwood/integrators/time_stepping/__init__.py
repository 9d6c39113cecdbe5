"""Time stepping over impacts: equal steps that look for no event."""
