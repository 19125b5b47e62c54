"""Meaning of each column of the exported tables."""

from __future__ import annotations

from collections.abc import Mapping

CAPTURE = "capture (key of the journal)"
STANDOFF = "standoff of the target from the reference plane"
U, V = "position to the right, origin in the centre of the top-left pixel", "position down, the same origin"
MEANINGS: Mapping[str, Mapping[str, tuple[str, str]]] = {
    "captures": {
        "capture": ("", CAPTURE),
        "purpose": ("", "calibration or trial"),
        "placement": ("", "key of the placement of the target"),
        "scene": ("", "scene of a trial; empty for a calibration"),
        "laser_id": ("", "laser that was on; all, or board for a frame of the printed board"),
        "standoff_mm": ("mm", STANDOFF),
        "standoff_sd_mm": ("mm", "standard uncertainty of the standoff; empty: that of the rig file"),
        "repeat": ("", "number of the capture at its placement"),
        "exposure": ("", "exposure of the camera; empty if none was set"),
        "exposure_unit": ("", "unit of the exposure; empty: the driver's own"),
        "time": ("", "time of the exposure, UTC"),
        "on": ("", "file of the frame with the laser on"),
        "off": ("", "file of the frame with all lasers off"),
    },
    "spots": {
        "capture": ("", CAPTURE),
        "laser_id": ("", "laser of the spot; empty if it is not assigned"),
        "standoff_mm": ("mm", STANDOFF),
        "repeat": ("", "number of the capture at its placement"),
        "u_px": ("px", U),
        "v_px": ("px", V),
        "u_sd_px": ("px", "standard uncertainty of u_px"),
        "v_sd_px": ("px", "standard uncertainty of v_px"),
        "u_speckle_sd_px": ("px", "standard uncertainty of u_px by speckle; empty: not known"),
        "v_speckle_sd_px": ("px", "standard uncertainty of v_px by speckle; empty: not known"),
        "flux_dn": ("DN", "sum of the spot's light in digital numbers"),
        "width_px": ("px", "width of the spot (standard deviation of its profile)"),
        "peak_dn": ("DN", "brightest value of the spot"),
        "flags": ("", "remarks on the spot, separated by blanks"),
    },
    "residuals": {
        "laser_id": ("", "laser"),
        "standoff_mm": ("mm", STANDOFF),
        "u_px": ("px", "measured - predicted u of the last fit, mean of the repeats"),
        "v_px": ("px", "measured - predicted v"),
        "u_sd_px": ("px", "standard uncertainty of u_px"),
        "v_sd_px": ("px", "standard uncertainty of v_px"),
    },
    "readings": {
        "trial": ("", "trial: procedure and number of the step"),
        "scene": ("", "scene"),
        "standoff_mm": ("mm", STANDOFF),
        "reading": ("", "number of the reading at its placement"),
        "status": ("", "done, not_enough_points or no_points"),
        "range_mm": ("mm", "mean range of the lasers; empty without a range"),
        "sigma_mm": ("mm", "stated standard uncertainty of range_mm"),
        "error_mm": ("mm", "range_mm - true_mm"),
        "reference_sd_mm": ("mm", "standard uncertainty of true_mm"),
        "true_mm": ("mm", "true range"),
        "closest_mm": ("mm", "smallest range over the front"),
        "closest_sigma_mm": ("mm", "stated standard uncertainty of closest_mm"),
        "angle_deg": ("deg", "measured angle of an incline"),
        "angle_sd_deg": ("deg", "stated standard uncertainty of angle_deg"),
        "radius_mm": ("mm", "measured radius of a cylinder"),
        "radius_sd_mm": ("mm", "stated standard uncertainty of radius_mm"),
        "cause": ("", "cause of a missing range"),
    },
    "parameters": {
        "parameter": ("", "name of the parameter"),
        "unit": ("", "unit of value, sd and prior_sd"),
        "value": ("", "posterior mean"),
        "sd": ("", "posterior standard deviation"),
        "prior_sd": ("", "standard deviation of the prior; 0: a constant"),
        "data_share": ("", "share of the information that the data give, 0 to 1"),
        "determined_by": ("", "data, joint (with priors of other parameters), or prior"),
    },
    "covariance": {
        "parameter_1": ("", "name of a parameter"),
        "parameter_2": ("", "name of a parameter"),
        "covariance": ("", "posterior covariance, in the product of their units"),
    },
}
"""Unit and meaning by table and column."""
