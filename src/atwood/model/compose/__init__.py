"""Components put together: models, scenes, their differences and their files."""
