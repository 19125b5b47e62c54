"""Renderers of tables, figures and the printed board."""
