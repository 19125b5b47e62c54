"""Mutants of the core: tests that fail when the code is wrong (`make mutants`)."""
