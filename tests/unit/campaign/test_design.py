"""Campaign `design`: its rows are forecasts, its front is not surpassed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.support.campaigns import RIG, frames_of, write_campaign
from workbench.calibration.design.forecast import forecast
from workbench.campaign.campaign_file import load_campaign
from workbench.campaign.design import pareto_front
from workbench.model.errors import BadInputError
from workbench.model.rig import load_rig

TEXT = f"""format: 1
campaign: grid
title: Grid
work:
  kind: design
  rigs: [{RIG}]
  standoffs_mm: [[125, 400, 2200], [10, 20, 30]]
  repeats: [1, 10]
  placement_s: 60
  capture_s: 0.5
"""


def test_rows_are_forecasts_with_their_cost(tmp_path: Path) -> None:
    campaign = load_campaign(write_campaign(tmp_path, TEXT))
    (every,) = frames_of(campaign)
    expected = forecast(load_rig(RIG), (125.0, 400.0, 2200.0), 10)
    row = every.iloc[1]
    assert row["relative_sd_of_calibration"] == expected.worst_relative_sd_of_calibration
    assert row["captures"] == 3 * 10 * 4
    assert row["minutes"] == 3 + 120 * 0.5 / 60
    assert every["relative_sd"].isna().tolist() == [False, False, True, True]
    assert "standoff 10 mm" in every["reason"].iloc[2]
    summary = campaign.file.work.summarise(campaign.inputs, [every])
    assert summary.headline.startswith("2 of 4 designs are on the Pareto front")
    assert summary.notes == ("2 designs have a standoff without a spot",)


def _points(designs: pd.DataFrame) -> list[tuple[float, float]]:
    numbers = designs[["minutes", "relative_sd_of_calibration"]].to_numpy(float).tolist()
    return [(minutes, sd) for minutes, sd in numbers]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_no_design_surpasses_the_front(seed: int) -> None:
    rng = np.random.default_rng(seed)
    every = pd.DataFrame({"minutes": rng.integers(1, 20, 60), "relative_sd_of_calibration": rng.random(60)})
    front = pareto_front(every)
    points = _points(every)
    best = {(a, sd) for a, sd in points if not any(b <= a and other < sd for b, other in points)}
    assert set(_points(front)) == best


def test_a_grid_is_bounded(tmp_path: Path) -> None:
    text = TEXT.replace("[1, 10]", str(list(range(1, 5002))))
    with pytest.raises(BadInputError, match="at most 10000 designs, got 10002"):
        load_campaign(write_campaign(tmp_path, text))
