"""Scenes as environments of gymnasium: one, or many that go on together in one call of machine code."""
