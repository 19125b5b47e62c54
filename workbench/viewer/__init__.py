"""Rerun recording of a session, made from its records."""
