"""Calibration certificate of a session: as a document, and as a Digital Calibration Certificate."""
