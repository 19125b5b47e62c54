"""Observations of spots and views of the board, from captures."""
