"""Scores of the ranger's shapes that `make prove` repeats: exact calibration, some seconds."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tests.support.surfaces import F_PX, SD_PX, X, drawn, flat, holds, incline, readings, seen, share
from workbench.ranging.shape import DEFAULT_PRIOR, Shape, fit_shape

NEAREST_MM, FARTHEST_MM = 150.0, 4500.0
FLATS_MM = (300.0, 1500.0, 4000.0)
INCLINES = ((600.0, 5.0), (1500.0, 30.0), (3000.0, 15.0), (4500.0, 60.0))
"""Closest range, mm, and angle, degrees."""
COVERAGE = (0.94, 0.96)
"""Of the interval of the closest range, over shapes drawn from the prior."""
ANGLE_COVERAGE = (0.93, 0.97)
MOST_OTHERS = 0.01
"""Largest share of flats that are reported as another shape."""
DEVIATIONS = 4.0
"""Of a share by its number of trials, from which it misses its limits."""


def scores(n: int, seed: int) -> tuple[list[str], list[str]]:
    """Lines of a table, and the figures that are missed; n readings for each row."""
    found = [
        ("shapes drawn from the prior in the interval", drawn_coverage(n, seed), n, COVERAGE),
        *((f"{mm:.0f} mm flat: another shape reported", *_others(mm, n, seed)) for mm in FLATS_MM),
        *(
            (f"{mm:.0f} mm incline {angle:g} deg: angle in its interval", *_angle(mm, angle, n, seed))
            for mm, angle in INCLINES
        ),
    ]
    misses = [
        f"{name}: {100 * value:.1f} %" for name, value, of, limits in found if not _is_met(value, of, limits)
    ]
    return [*(_line(*row) for row in found), *(f"MISSED  {miss}" for miss in misses)], misses


def _line(name: str, value: float, n: int, limits: tuple[float, float]) -> str:
    low, high = limits
    spread = np.sqrt(value * (1.0 - value) / n)
    expected = f"{100 * low:g} - {100 * high:g} %"
    return f"{name:>52}{100 * value:8.1f} +- {100 * spread:.1f} %, expected {expected}"


def _is_met(value: float, n: int, limits: tuple[float, float]) -> bool:
    low, high = limits
    spread = DEVIATIONS * np.sqrt(value * (1.0 - value) / n)
    return bool(low - spread <= value <= high + spread)


def drawn_coverage(n: int, seed: int) -> float:
    """Coverage of the interval over n shapes from the prior, their closest ranges log-uniform."""
    rng = np.random.default_rng(seed)
    at = np.exp(rng.uniform(np.log(NEAREST_MM), np.log(FARTHEST_MM), n))
    return float(np.mean([holds(_drawn_shape(mm, rng), mm) for mm in at.tolist()]))


def _drawn_shape(closest_mm: float, rng: np.random.Generator) -> Shape:
    surface = drawn(DEFAULT_PRIOR, closest_mm, rng)
    noise = rng.normal(0.0, 1.0, len(X)) * SD_PX / (F_PX * np.abs(X))
    return fit_shape(seen(X, 1.0 / (1.0 / surface(X) + noise)))


def _others(at: float, n: int, seed: int) -> tuple[float, int, tuple[float, float]]:
    return share(readings(flat(at), n, seed + int(at)), lambda s: s.kind != "flat"), n, (0.0, MOST_OTHERS)


def _angle(at: float, angle_deg: float, n: int, seed: int) -> tuple[float, int, tuple[float, float]]:
    shapes = readings(incline(at, angle_deg), n, seed + int(at))
    return float(np.mean(list(angle_held(shapes, angle_deg)))), n, ANGLE_COVERAGE


def angle_held(shapes: list[Shape], angle_deg: float) -> Iterator[bool]:
    """Whether the interval of each angle contains the true one."""
    for shape in shapes:
        low, high = shape.angle_interval_rad or (np.nan, np.nan)
        yield bool(low <= np.radians(angle_deg) <= high)
