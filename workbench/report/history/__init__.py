"""History of a sensor over its sessions: calibrations, verifications, control charts, drift."""
