"""What theory knows of a scene, on the command line."""
