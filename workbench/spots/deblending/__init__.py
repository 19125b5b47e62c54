"""Deblending: clusters of spots whose images overlap, and their joint fit."""
