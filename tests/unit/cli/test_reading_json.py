"""A reading as a line of JSON."""

from __future__ import annotations

import json
from dataclasses import replace
from math import degrees
from pathlib import Path

import pytest

from tests.support.surfaces import X, flat, incline, seen
from workbench.cli.reading_json import plain
from workbench.model.calibration import load_calibration
from workbench.model.captures import load_captures
from workbench.ranging.captures import read_captures
from workbench.ranging.ranger import Ranger, Reading
from workbench.ranging.shape import fit_shape

SESSION = Path(__file__).parents[3] / "data/session-0.1.0"


@pytest.fixture(scope="module")
def reading() -> Reading:
    ranger = Ranger(load_calibration(SESSION / "calibration.yaml"))
    (one,) = read_captures(ranger, load_captures(SESSION / "trial-captures.csv"))
    return one


def test_numbers_are_the_readings(reading: Reading) -> None:
    printed = json.loads(json.dumps(plain(reading)))
    assert (printed["scene"], printed["status"]) == (reading.scene, reading.status)
    assert (printed["closest_mm"], printed["sigma_mm"]) == (reading.closest_mm, reading.sigma_mm)
    assert [one["range_mm"] for one in printed["lasers"]] == [laser.range_mm for laser in reading.lasers]
    assert [one["interval_mm"] for one in printed["lasers"]] == [
        [x.low_mm, x.high_mm] for x in reading.lasers
    ]
    assert printed["lines"][0]["lasers"] == [laser.laser_id for laser in reading.lasers]


def test_a_shape_is_told_with_its_angle_in_degrees(reading: Reading) -> None:
    slope = incline(800.0, 25.0)
    shape = fit_shape(seen(X, slope(X)))
    other = replace(reading, lines=(replace(reading.lines[0], shape=shape),))
    printed = plain(other)["shape"]
    assert printed == plain(other)["lines"][0]["shape"]
    assert (printed["kind"], printed["degree"]) == ("incline", 1)
    assert printed["angle_deg"] == pytest.approx(25.0, abs=0.01)
    assert shape.angle_sigma_rad is not None
    assert printed["angle_sigma_deg"] == pytest.approx(degrees(shape.angle_sigma_rad))
    low, high = printed["angle_interval_deg"]
    assert low < 25.0 < high
    assert printed["probabilities"] == dict(shape.probabilities)


def test_a_flat_has_probabilities_and_an_angle_too(reading: Reading) -> None:
    shape = fit_shape(seen(X, flat(800.0)(X)))
    flat_one = plain(replace(reading, lines=(replace(reading.lines[0], shape=shape),)))["shape"]
    assert flat_one["kind"] == "flat"
    assert flat_one["probabilities"].keys() == {"flat", "incline", "round", "cylinder"}
    assert flat_one["angle_deg"] == pytest.approx(0.0, abs=1e-6)


def test_a_reading_of_nothing_is_valid_json_too(reading: Reading) -> None:
    ranger = Ranger(load_calibration(SESSION / "calibration.yaml"))
    printed = json.loads(json.dumps(plain(ranger.read_lit("nothing", ()))))
    assert printed["status"] == "no_points"
    assert (printed["closest_mm"], printed["interval_mm"], printed["lasers"], printed["lines"]) == (
        None,
        None,
        [],
        [],
    )
    assert printed["shape"] == {"kind": "unknown"}
