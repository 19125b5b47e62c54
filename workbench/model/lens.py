"""Names of lens models and of their parameters in rig files and calibration files."""

from __future__ import annotations

from typing import Literal

LensName = Literal["plumb_bob", "equidistant"]
"""Name of a lens model: `camera.lens` of a rig file, and `distortion_model` of a ROS camera_info."""
PINHOLE = ("f_px", "cx_px", "cy_px")
"""Focal length and principal point in (square) pixels, common to all lens models."""
COEFFICIENTS: dict[LensName, tuple[str, ...]] = {
    "plumb_bob": ("k1", "k2", "p1", "p2", "k3"),
    "equidistant": ("k1", "k2", "k3", "k4"),
}
"""Distortion coefficients of each lens model, in the order of OpenCV and ROS; no unit."""


def lens_parameters(lens: LensName) -> tuple[str, ...]:
    """Names of all parameters of a lens model, in the order of every vector of parameters."""
    return (*PINHOLE, *COEFFICIENTS[lens])
