"""Corners of the printed board in an image, with their standard deviations."""
