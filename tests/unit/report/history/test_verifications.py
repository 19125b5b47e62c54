"""Verifications of a sensor: mean errors and scatters at the distances that most sessions share."""

from __future__ import annotations

from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest

from tests.support.reference_session import SERIAL
from tests.support.verified_sensor import FIRST, verified_sensor, write_verification
from workbench.report.history.verifications import (
    DISTANCES,
    DistanceCheck,
    Verification,
    is_same_distance,
    monitored_mm,
    unmonitored_mm,
    unmonitored_texts,
    verifications,
)
from workbench.session.index import indexed_sessions


def test_mean_errors_and_scatters_are_those_of_the_readings(tmp_path: Path) -> None:
    verified_sensor(tmp_path, np.array([[0.001, -0.002, 0.003]]))
    (_, found) = verifications(tmp_path, indexed_sessions(tmp_path))
    assert [check.error for check in found.checks] == pytest.approx([0.001, -0.002, 0.003])
    assert [check.readings for check in found.checks] == [4, 4, 4]
    assert all(0 < check.scatter < 0.001 for check in found.checks)
    assert found.day == "2027-01-04"


def test_targets_that_are_not_measured_are_left_out(tmp_path: Path) -> None:
    verified_sensor(tmp_path, np.zeros((1, 3)))
    path = write_verification(tmp_path, FIRST + timedelta(days=9), [[0.001], [0.001]])
    journal = path / "journal.jsonl"
    text = journal.read_text()
    rough = text.replace('"standoff_mm":200.0', '"standoff_mm":0.3', 1)  # u = 0.3 mm of 0.3 mm
    journal.write_text(rough)
    found = verifications(tmp_path, indexed_sessions(tmp_path))[-1]
    assert [check.range_mm for check in found.checks] == [400.0]


def session(*ranges_mm: float) -> Verification:
    checks = tuple(DistanceCheck(mm, 0.0, 0.0, 1) for mm in ranges_mm)
    return Verification("s", "2027-01-01", 0, SERIAL, checks)


def test_the_distances_of_most_sessions_are_monitored_evenly() -> None:
    usual = [session(200, 300, 500, 800, 1200, 2000, 3000)] * 9
    assert monitored_mm([session(180, 700), *usual]) == (200, 500, 800, 1200, 3000)
    assert monitored_mm([session(200, 500), session(203, 501)]) == (200, 500)
    assert monitored_mm([]) == ()


def test_the_first_sessions_choose_the_distances_each_session_once() -> None:
    first = [session(200, 500)] * 10
    assert monitored_mm([*first, *[session(300)] * 90]) == (200, 500)
    assert unmonitored_mm([*first, session(300, 305, 1000)], (200, 500)) == (300, 1000)
    twice = [session(500, 510), *[session(200)] * 2]
    assert monitored_mm(twice) == (200,)


def test_each_distance_that_is_not_monitored_has_its_reason() -> None:
    usual = [session(200, 300, 500, 800, 1200, 2000)] * 10
    (text,) = unmonitored_texts(usual, monitored_mm(usual))
    assert "500 mm" in text
    assert str(DISTANCES) in text
    both = [*usual, session(200, 4000)]
    spare, rare = unmonitored_texts(both, monitored_mm(both))
    assert spare == text
    assert "4000 mm" in rare
    assert unmonitored_texts(usual, (200, 300, 500, 800, 1200, 2000)) == []


def test_a_distance_within_five_percent_is_the_same() -> None:
    assert is_same_distance(500.0, 520.0)
    assert not is_same_distance(500.0, 530.0)
    assert session(500.0).at(520.0) is not None
    assert session(500.0).at(600.0) is None
