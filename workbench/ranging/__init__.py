"""Ranger: ranges and shapes from spots and a calibration."""
