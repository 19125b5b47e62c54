"""Design of a calibration before and during the captures: forecast, standoffs, expected spots."""
