"""Statistics of readings of any range sensor, from a CSV file."""
