"""Spots whose images overlap: which belong together, and their joint fit."""
