"""Analysis of readings of any range sensor."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.trial_readings import autoregressive, drawn_levels
from workbench.trials.any_sensor.analysis import KINDS, ClippedLevel, analyse


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_gives_a_table_of_its_name(kind: str) -> None:
    found = analyse(kind, drawn_levels(1, shape=(2, 4, 3), sds=(0.4, 0.3, 0.2)))
    assert (found.kind, found.table.name) == (kind, kind)
    assert (found.readings, found.missing, found.clipped) == (72, 0, ())
    assert not any("no statistics" in str(row.get("note")) for row in found.table.records())


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_states_too_few_readings_in_words(kind: str) -> None:
    found = analyse(kind, drawn_levels(1, [500.0], (1, 1, 1)))
    assert all(str(row["note"]) for row in found.table.records())


def test_clipped_levels_are_reported_and_left_out() -> None:
    frame = drawn_levels(1, [300.0, 600.0, 900.0, 1000.0])
    limited = frame["measured_mm"].clip(upper=1000.0)
    frame = frame.assign(measured_mm=limited, error_mm=limited - frame["true_mm"])
    count = int((limited == 1000.0).sum())
    found = analyse("accuracy", frame)
    assert found.clipped == (ClippedLevel(1000.0, 1000.0, count, 24),)
    assert [row["standoff_mm"] for row in found.table.records()] == [300, 600, 900]
    assert found.readings == 96


def test_autocorrelation_and_missing_readings_are_reported() -> None:
    frame = drawn_levels(1, [300.0], (1, 4, 60))
    series = autoregressive(np.random.default_rng(2), 0.5, (4, 60)).ravel()
    series[:3] = np.nan
    found = analyse("repeatability", frame.assign(error_mm=series, measured_mm=300 + series))
    assert found.missing == 3
    assert 0.3 < found.autocorrelation.lag1 < 0.7


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_of_clipped_readings_alone_has_no_statistics(kind: str) -> None:
    frame = drawn_levels(1, [500.0, 600.0]).assign(measured_mm=400.0)
    found = analyse(kind, frame.assign(error_mm=400.0 - frame["true_mm"]))
    assert [level.clipped for level in found.clipped] == [24, 24]
    assert not any(isinstance(row.get("sd_mm"), float) for row in found.table.records())
