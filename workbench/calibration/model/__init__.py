"""Parameters of a calibration, their priors, and the predicted positions of spots and corners."""
