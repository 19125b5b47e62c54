"""One capture: exposure, frame pair, stuck-beam check, brightness, quality."""
