"""The trials and their statistics."""
