"""Load, plan and run procedures."""
