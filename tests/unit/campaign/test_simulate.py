"""Campaign `simulate`: its rows, and its summary compared with that of all rows at once."""

from __future__ import annotations

import weakref
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.support.campaigns import SIMULATE, frames_of, simulated_campaign
from workbench.campaign.campaign_file import Campaign
from workbench.campaign.kind import Summary

SENSORS = 160
TEXT = SIMULATE.replace("sensors: 40", f"sensors: {SENSORS}").replace("chunk: 16", "chunk: 48") + (
    "  limits: {max_relative_range_sd: 0.0125, max_relative_range_error: 0.02}\n"
)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    return simulated_campaign(tmp_path_factory.mktemp("campaign"), TEXT)


@pytest.fixture(scope="module")
def frames(campaign: Campaign) -> list[pd.DataFrame]:
    return frames_of(campaign)


@pytest.fixture(scope="module")
def summary(campaign: Campaign, frames: list[pd.DataFrame]) -> Summary:
    return campaign.file.work.summarise(campaign.inputs, frames)


def test_there_is_one_row_for_each_sensor(frames: list[pd.DataFrame]) -> None:
    every = pd.concat(frames)
    assert every["sensor"].tolist() == list(range(SENSORS))
    assert every["converged"].all()
    assert every["error.f_px"].nunique() == SENSORS


def test_a_chunk_depends_neither_on_order_nor_on_others(
    campaign: Campaign, frames: list[pd.DataFrame]
) -> None:
    again = campaign.file.work.run(campaign.inputs, campaign.chunks[2], Path())
    pd.testing.assert_frame_equal(again, frames[2], check_exact=True)


def test_parameters_and_ranges_lie_in_their_intervals(frames: list[pd.DataFrame]) -> None:
    every = pd.concat(frames)
    for start in ("", "_mm"):
        errors = [name for name in every if str(name).startswith(f"error{start}.")]
        z = [every[name] / every[str(name).replace("error", "sd", 1)] for name in errors]
        covered = (np.abs(np.array(z)) < 1.96).mean()
        # Errors of one sensor are correlated: as uncertain as those of SENSORS independent ones.
        assert abs(covered - 0.95) < 3 * np.sqrt(0.95 * 0.05 / SENSORS)


def test_the_summary_is_that_of_all_rows(summary: Summary, frames: list[pd.DataFrame]) -> None:
    every = pd.concat(frames)
    decisions, ranges, parameters = (pd.DataFrame(table.records()) for table in summary.tables)
    error, sd = every["error_mm.L2.3000"], every["sd_mm.L2.3000"]
    row = ranges[(ranges["laser"] == "L2") & (ranges["range_mm"] == 3000.0)].iloc[0]
    assert row["rms_error_mm"] == pytest.approx(np.sqrt((error**2).mean()))
    assert row["stated_sd_mm"] == pytest.approx(np.sqrt((sd**2).mean()))
    assert row["coverage_95"] == pytest.approx((error.abs() < 1.959964 * sd).mean())
    own = parameters.set_index("parameter").loc["L3.tx"]
    assert own["mean_error"] == pytest.approx(every["error.L3.tx"].mean())
    assert own["prior_sd"] == 0.005
    assert decisions["sensors"].sum() == SENSORS


def test_decisions_compare_stated_and_true_errors_with_the_limits(
    summary: Summary, frames: list[pd.DataFrame]
) -> None:
    every = pd.concat(frames)
    cells = [(laser, at) for laser in ("L1", "L2", "L3", "L4") for at in (300, 3000)]
    good = np.all([every[f"error_mm.{laser}.{at}"].abs() <= 0.02 * at for laser, at in cells], axis=0)
    accepted = np.all([every[f"sd_mm.{laser}.{at}"] <= 0.0125 * at for laser, at in cells], axis=0)
    counts = {row["decision"]: row["sensors"] for row in summary.tables[0].records()}
    assert counts == {
        "accepted, good": (accepted & good).sum(),
        "accepted, not good": (accepted & ~good).sum(),
        "refused, good": (~accepted & good).sum(),
        "refused, not good": (~accepted & ~good).sum(),
    }
    assert 0 < accepted.sum() < SENSORS
    assert 0 < good.sum() < SENSORS


def test_the_summary_holds_one_chunk_at_a_time(campaign: Campaign, frames: list[pd.DataFrame]) -> None:
    alive: list[weakref.ref[pd.DataFrame]] = []

    def one_by_one() -> Iterator[pd.DataFrame]:
        for n in range(12):
            assert sum(one() is not None for one in alive) <= 1
            frame = frames[n % len(frames)].copy()
            alive.append(weakref.ref(frame))
            yield frame
            del frame

    assert campaign.file.work.summarise(campaign.inputs, one_by_one()).tables
