"""Schemas, units and the error hierarchy; imports nothing of the workbench."""
