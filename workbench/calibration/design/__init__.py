"""What a calibration will determine before any data, and where to place the target."""
