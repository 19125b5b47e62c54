"""Events of a trial: what may be missing, and that JSON keeps them."""

from __future__ import annotations

from math import hypot, inf

import pytest
from pydantic import ValidationError

from workbench.model.chart import Axis, Chart, Series
from workbench.model.table import Column, Table
from workbench.model.trial_event import COVERAGE_FACTOR as K
from workbench.model.trial_event import STATUS_TEXT, LaserRange, ReadingTaken, TrialFinished

READING = {
    "trial": "accuracy",
    "scene": "flat",
    "standoff_mm": 500.0,
    "reading": 1,
    "status": "no_points",
    "range_mm": None,
    "sigma_mm": None,
    "lasers": [],
}


def test_a_reading_without_a_range_has_no_deviation_either() -> None:
    reading = ReadingTaken.model_validate(READING)
    assert (reading.range_mm, reading.sigma_mm, reading.reference_sd_mm, reading.lasers) == (
        None,
        None,
        None,
        (),
    )


@pytest.mark.parametrize("missing", ["range_mm", "sigma_mm", "status", "lasers"])
def test_what_is_missing_is_said_to_be(missing: str) -> None:
    """No default: a reader can tell no range from one that was left out."""
    with pytest.raises(ValidationError):
        ReadingTaken.model_validate({key: value for key, value in READING.items() if key != missing})


@pytest.mark.parametrize("change", [{"status": "fine"}, {"range_mm": float("inf")}, {"range": 5.0}])
def test_readings_that_cannot_be_are_refused(change: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        ReadingTaken.model_validate(READING | change)


def test_results_survive_json() -> None:
    laser = LaserRange(laser_id="L1", range_mm=500.2, sigma_mm=0.4, u_px=250.0, v_px=None, low_mm=499.4)
    reading = ReadingTaken.model_validate(READING | {"lasers": [laser]})
    assert ReadingTaken.model_validate_json(reading.model_dump_json()) == reading
    series = Series(name="L1", x=(500.0,), y=(None,))
    chart = Chart(name="c", title="C", x=Axis(label="x"), y=Axis(label="y"), series=(series,))
    table = Table(name="t", title="T", columns=(Column(key="a", name="a"),), rows=((1.5,), (None,)))
    finished = TrialFinished(trial="accuracy", tables=(table,), charts=(chart,))
    assert TrialFinished.model_validate_json(finished.model_dump_json()) == finished


MEASURED = READING | {
    "status": "done",
    "range_mm": 500.0,
    "sigma_mm": 2.0,
    "reference_sd_mm": 1.5,
}


@pytest.mark.parametrize(
    ("change", "interval_mm"),
    [
        ({}, (500 - hypot(K * 2.0, K * 1.5), 500 + hypot(K * 2.0, K * 1.5))),
        ({"low_mm": 497.0, "high_mm": 504.0}, (500 - hypot(3.0, K * 1.5), 500 + hypot(4.0, K * 1.5))),
        ({"low_mm": 497.0, "high_mm": None}, (500 - hypot(3.0, K * 1.5), inf)),
        ({"sigma_mm": None}, None),
        ({"reference_sd_mm": None}, None),
    ],
)
def test_the_interval_combines_sensor_and_reference(
    change: dict[str, object], interval_mm: tuple[float, float] | None
) -> None:
    reading = ReadingTaken.model_validate(MEASURED | change)
    assert reading.interval_mm == (None if interval_mm is None else pytest.approx(interval_mm))


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        ({"status": "done", "range_mm": 500.0}, ""),
        ({"notes": ["dark", "far"]}, "dark; far"),
        ({}, STATUS_TEXT["no_points"]),
    ],
)
def test_the_cause_of_a_missing_range_is_in_its_notes_or_its_status(
    change: dict[str, object], cause: str
) -> None:
    assert ReadingTaken.model_validate(READING | change).cause == cause
