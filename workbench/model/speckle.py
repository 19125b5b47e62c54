"""Deviation of a spot's centre by speckle, from the data sheets of laser, lens and sensor."""

from __future__ import annotations

from math import pi

FITTED_OVER_CENTROID = 0.67 * 2**0.5
"""Deviation of a fitted centre over that of a centroid, lambda N / (sqrt(2) pi pitch); docs/rig-format.md."""


def speckle_sd_px(wavelength_nm: float, f_number: float, pitch_um: float) -> float:
    """Standard deviation of a fitted centre by speckle, px: about 0.67 lambda N / (pi pitch).

    Args:
        wavelength_nm: wavelength of the laser.
        f_number: f-number of the lens.
        pitch_um: distance of the pixels' centres.
    """
    centroid_px = wavelength_nm * 1e-3 * f_number / (2**0.5 * pi * pitch_um)
    return FITTED_OVER_CENTROID * centroid_px
