"""The ranger of the public interface."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import workbench as wb

FOLDER = Path(__file__).parents[3] / "data/session-0.1.0"


def test_reading_of_an_old_trial_is_reproduced_within_its_uncertainty() -> None:
    session = wb.open_session(FOLDER)
    (capture,) = session.captures.query("purpose == 'trial'")["capture"]
    ranger = wb.Ranger(session.calibration)
    reading = ranger.range(session.frame(capture), session.frame(capture, off=True), scene="here")
    recorded = session.readings.iloc[0]
    assert reading.scene == "here"
    # The session was recorded by version 0.1.0, whose spots had weights without speckle.
    assert reading.flat_mm == pytest.approx(recorded["range_mm"], abs=0.5 * recorded["sigma_mm"])
    assert 0.6 * recorded["sigma_mm"] < reading.flat_sigma_mm < 1.1 * recorded["sigma_mm"]


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
