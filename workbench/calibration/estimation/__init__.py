"""Maximum a posteriori estimation by non-linear least squares, one sensor or many."""
