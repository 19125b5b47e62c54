"""The thesis's simulation: its scenes, its own chain, the workbench's chain."""
