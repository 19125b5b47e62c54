"""The virtual bench, reached only by its name in a rig file."""
