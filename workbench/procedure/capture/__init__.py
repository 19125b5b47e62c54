"""Capture: exposure, latency, frame pair, brightness, quality."""
