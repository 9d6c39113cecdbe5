"""The equations of motion of a scene, derived and written down."""
