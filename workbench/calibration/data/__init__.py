"""From captures to the observations that a fit uses."""
