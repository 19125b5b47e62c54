"""The ranger of the public interface."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import workbench as wb

FOLDER = Path(__file__).parents[3] / "data/session-0.1.0"


def test_reading_of_a_trial_is_reproduced() -> None:
    session = wb.open_session(FOLDER)
    (capture,) = session.captures.query("purpose == 'trial'")["capture"]
    ranger = wb.Ranger(session.calibration)
    reading = ranger.range(session.frame(capture), session.frame(capture, off=True), scene="here")
    recorded = session.readings.iloc[0]
    assert reading.scene == "here"
    assert reading.flat_mm == pytest.approx(recorded["range_mm"], rel=1e-6)
    assert reading.flat_sigma_mm == pytest.approx(recorded["sigma_mm"], rel=1e-6)


def test_the_prior_over_shapes_decides_where_the_spots_do_not() -> None:
    session = wb.open_session(FOLDER)
    (capture,) = session.captures.query("purpose == 'trial'")["capture"]
    frames = session.frame(capture), session.frame(capture, off=True)
    walls = wb.ShapePrior(flat=1.0, incline=0.0, round=0.0, irregular=0.0)
    readings = [wb.Ranger(session.calibration, prior).range(*frames) for prior in (wb.ShapePrior(), walls)]
    assert readings[1].lines[0].shape.probabilities["flat"] == pytest.approx(1.0)
    assert readings[0].lines[0].shape.probabilities["flat"] < 1.0
    assert readings[1].sigma_mm is not None
    assert readings[0].sigma_mm is not None
    assert readings[1].sigma_mm < readings[0].sigma_mm


def test_frames_without_a_spot_give_no_points() -> None:
    ranger = wb.Ranger(wb.load_calibration(FOLDER / "calibration.yaml"))
    dark = np.full((480, 640), 8, np.uint8)
    assert ranger.range(dark, dark).status == "no_points"


def test_frames_of_another_size_are_refused() -> None:
    ranger = wb.Ranger(wb.load_calibration(FOLDER / "calibration.yaml"))
    with pytest.raises(wb.BadInputError):
        ranger.range(np.zeros((48, 64), np.uint8))
