"""`make prove`: simulated calibrations against what the workbench states of them."""
