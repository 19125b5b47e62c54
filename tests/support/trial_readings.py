"""Readings of a trial drawn from a random model, as a data frame and as a file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from workbench.model.arrays import FloatArray
from workbench.model.event import ReadingTaken


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


def drawn_levels(
    seed: int,
    standoffs_mm: Sequence[float] = (300.0, 600.0, 1000.0),
    shape: tuple[int, int, int] = (1, 8, 3),
    sds: tuple[float, float, float] = (0.0, 0.5, 0.3),
) -> pd.DataFrame:
    """Readings at several true ranges with the columns of a trial's readings."""
    random = np.random.default_rng(seed)
    frames = [
        drawn_readings(random, shape, sds).assign(standoff_mm=standoff, true_mm=standoff)
        for standoff in standoffs_mm
    ]
    frame = pd.concat(frames, ignore_index=True)
    return frame.assign(measured_mm=frame["true_mm"] + frame["error_mm"])


def autoregressive(random: np.random.Generator, rho: float, shape: tuple[int, int]) -> FloatArray:
    """Series (series, readings) of unit variance with lag-1 autocorrelation `rho`."""
    noise = random.normal(0, 1, shape)
    for k in range(1, shape[1]):
        noise[:, k] = rho * noise[:, k - 1] + np.sqrt(1 - rho**2) * noise[:, k]
    return noise


def reading_taken(range_mm: float | None, standoff_mm: float = 500.0, number: int = 0) -> ReadingTaken:
    """Reading of a trial; without a range if `range_mm` is None."""
    return ReadingTaken(
        trial="p.1",
        scene=f"p.1/{number:02d}",
        standoff_mm=standoff_mm,
        reading=number,
        status="no_points" if range_mm is None else "done",
        range_mm=range_mm,
        sigma_mm=None if range_mm is None else 0.2,
        reference_sd_mm=0.5,
        lasers=(),
    )
