"""Calibration and lab-measurement workbench for laser-spot range sensors."""
