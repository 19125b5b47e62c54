"""Readings of a trial drawn from a random model, as a data frame."""

from __future__ import annotations

import numpy as np
import pandas as pd


def drawn_readings(
    random: np.random.Generator, shape: tuple[int, int, int], sds: tuple[float, float, float]
) -> pd.DataFrame:
    """Errors of (sessions, placements, repeats) with normal deviations of each, mm."""
    error = random.normal(0, sds[0], (shape[0], 1, 1)) + random.normal(0, sds[1], (*shape[:2], 1))
    error = error + random.normal(0, sds[2], shape)
    index = np.indices(shape).reshape(3, -1)
    return pd.DataFrame(
        {"error_mm": error.ravel(), "session": index[0], "placement": index[1], "repeat": index[2]}
    )
