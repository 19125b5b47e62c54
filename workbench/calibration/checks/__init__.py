"""Tests of a fit: residuals, cross-validation, target motion, and named faults."""
