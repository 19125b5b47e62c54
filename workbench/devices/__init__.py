"""Device protocols, drivers of real devices, and the guardian that switches lasers off."""
