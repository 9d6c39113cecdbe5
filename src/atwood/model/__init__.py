"""Declaring: parameters, connectors, laws, components, models and scenes."""
