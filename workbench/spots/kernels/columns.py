"""Names of the columns of the tables that the compiled loops share. Numba takes them for constants."""

from __future__ import annotations

from typing import Final

BACKGROUND, FLUX, U, V, LN_SU, LN_SV, SHEAR = range(7)
"""Parameters of a spot: DN, DN, px, px, logarithms of the widths in px, px a row."""

(
    WORST_EXCESS,
    RIM_NOISE,
    PEAK_DN,
    INFORMATION,
    FLUX_DEVIATION,
    U_DEVIATION,
    V_DEVIATION,
    SHEAR_SCORE,
    RIM_PIXELS,
) = range(9)
"""What a fitted window is accepted by: largest squared residual over its variance; mean of that at the rim;
highest pixel of the model; Fisher information of the flux, times the flux squared; standard deviations of
flux (DN), u and v (px); squared score of a shear over its variance; pixels used at the rim."""
ACCEPTANCE_COLUMNS: Final = 9
