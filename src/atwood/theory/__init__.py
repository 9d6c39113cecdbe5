"""What theory says of a scene: its equations to be read, and as functions of numbers."""
