"""One-dimensional drives, rotational and translational, on the coordinates of joints, rotors and masses."""
