"""Spots and readings of some hundred drawn scenes, compared with those of the code of 30 November 2026.

Changes for speed must not change results. `stored/*.csv` has the numbers of that code (commit 03e299e9).
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from tests.support.drawn_scenes import KINDS, NUMBERS, DrawnScene, numbers_of
from workbench.model.calibration import load_calibration
from workbench.ranging.ranger import Ranger

STORED = Path(__file__).parent / "stored"
SAME = 1e-9
"""Largest relative difference."""
OF_DIFFERENCE_PX = 1e-9
"""The same for deviations by speckle, px: they are differences, often of nearly equal numbers."""
OF_MIXTURE = 1e-6
"""Largest relative difference of a median: quantiles are searched to a thousandth of their probability."""
OF_TAIL_SD = 0.1
"""The same for the ends of an interval, in sigma: in a gap between shapes the probability hardly changes."""
MEDIANS = ("closest_mm", "sigma_mm", "mean_mm", "mean_sigma_mm")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("lines", ["one-line", "both-lines"])
def test_spots_and_readings_are_those_of_the_slower_code(lines: str, kind: str) -> None:
    ranger = Ranger(load_calibration(STORED / f"{lines}.yaml"))
    with (STORED / f"{lines}.csv").open(newline="") as file:
        stored = [row for row in csv.DictReader(file) if row["kind"] == kind]
    assert len(stored) == 10
    for row in stored:
        found = dict(zip(NUMBERS, numbers_of(DrawnScene(ranger, kind, int(row["seed"]))), strict=True))
        for name, value in found.items():
            expected, where = float(row[name]), f"seed {row['seed']}, {name}"
            if name in ("low_mm", "high_mm") and np.isfinite(expected):
                assert abs(value - expected) < OF_TAIL_SD * found["sigma_mm"], where
                continue
            relative = OF_MIXTURE if name in MEDIANS else SAME
            absolute = OF_DIFFERENCE_PX if name.endswith("speckle_sd_px") else 0.0
            assert value == pytest.approx(expected, rel=relative, abs=absolute, nan_ok=True), where
