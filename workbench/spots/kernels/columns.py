"""Columns of the tables that the compiled loops share. Numba compiles them as constants."""

from __future__ import annotations

from typing import Final

BACKGROUND, FLUX, U, V, LN_SU, LN_SV, SHEAR = range(7)
"""Parameters of a spot: DN per pixel, DN, px, px, ln of the widths in px, px per row."""

(
    WORST_EXCESS,
    RIM_NOISE,
    PEAK_DN,
    INFORMATION,
    FLUX_DEVIATION,
    FLUX_NOISE,
    U_DEVIATION,
    V_DEVIATION,
    U_SPECKLE,
    V_SPECKLE,
    SHEAR_SCORE,
    RIM_PIXELS,
) = range(12)
"""Statistics that a fitted window is accepted by. WORST_EXCESS: largest squared residual over its variance.
RIM_NOISE: mean squared residual over its variance at the rim. PEAK_DN: highest pixel of the model.
INFORMATION: Fisher information of the flux times the flux squared, where speckle is no noise.
FLUX_DEVIATION: standard deviation of the flux, DN. FLUX_NOISE: the same without speckle.
U_DEVIATION, V_DEVIATION: of the position by noise, px;
U_SPECKLE, V_SPECKLE: by speckle. SHEAR_SCORE: squared score of a shear over its variance.
RIM_PIXELS: number of pixels used at the rim."""
STATISTIC_COLUMNS: Final = 12
