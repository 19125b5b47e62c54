"""The ranger: from spots and a calibration to ranges."""
