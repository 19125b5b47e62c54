"""Readings of the sensor in a running session."""

from __future__ import annotations

from math import hypot, radians, tan
from pathlib import Path

import numpy as np
import pytest

from tests.support.exact import calibration_of
from tests.support.rangers import IDS, positions, thesis_ranger
from tests.support.rigs import prior, thesis_rig
from tests.support.running import running, two_laser_rig
from workbench.model.calibration import Calibration
from workbench.model.errors import BadInputError
from workbench.model.event import CaptureTaken, ReadingTaken
from workbench.model.target import Placement
from workbench.sensor.calibrated import CalibratedSensor, X, Y
from workbench.trials.readings import reading_taken, session_ranger, take_readings
from workbench.trials.reference import laser_places

PLACEMENT = Placement(key="p.1/500mm", standoff_mm=500.0)


def mean_place_mm(calibration: Calibration, taken: ReadingTaken) -> tuple[float, float]:
    """Mean x and y of the spots of a reading, weighted as its range."""
    sensor, ids = CalibratedSensor(calibration), [one.laser_id for one in taken.lasers]
    px = np.array([[np.nan if p is None else p for p in (one.u_px, one.v_px)] for one in taken.lasers])
    ranges = sensor.ranges(ids, px, np.full_like(px, np.nan))
    weight = ranges.spot_sd_mm**-2 / (ranges.spot_sd_mm**-2).sum()
    x, y = (float(weight @ sensor.places(ids, axis, ranges)[0]) for axis in (X, Y))
    return x, y


def test_without_an_exported_calibration_nothing_is_ranged(tmp_path: Path) -> None:
    with running(tmp_path) as session, pytest.raises(BadInputError, match=r"p\.1") as caught:
        session_ranger(session.context, "p.1")
    assert caught.value.exit_code == 2


@pytest.mark.parametrize(("stated_mm", "reference_mm"), [(None, 0.5), (2.5, 2.5)])
def test_readings_are_journalled_with_range_and_reference(
    tmp_path: Path, stated_mm: float | None, reference_mm: float
) -> None:
    rig = two_laser_rig()
    rig = rig.model_copy(update={"bench": rig.bench.model_copy(update={"placement_sd_mm": 0.5})})
    placement = PLACEMENT.model_copy(update={"standoff_sd_mm": stated_mm})
    with running(tmp_path, rig) as session:
        context = session.context
        context.calibration = calibration_of(rig)
        context.confirm_safety()
        placed = context.bench.target.place(placement)
        taken = take_readings(context, session_ranger(context, "p.1"), "p.1", placed, 2)
        assert [event for event in session.events if isinstance(event, ReadingTaken)] == taken
        captures = [event for event in session.events if isinstance(event, CaptureTaken)]
    assert [(one.scene, one.reading) for one in taken] == [("p.1/500mm/00", 0), ("p.1/500mm/01", 1)]
    tilt = radians(hypot(rig.bench.tilt_sd_deg, rig.bench.target_tilt_sd_deg))
    for one in taken:
        arm_mm = float(np.hypot(*mean_place_mm(context.calibration, one)))
        scale_mm = rig.bench.ruler_scale.sd * 500.0
        assert one.reference_sd_mm == pytest.approx(hypot(reference_mm, tilt * arm_mm, scale_mm))
        own_mm = hypot(reference_mm, radians(rig.bench.tilt_sd_deg) * arm_mm)
        assert one.placement_sd_mm == pytest.approx(own_mm)
    # The placement's error is drawn from the rig's tolerances: 5 of its standard deviations.
    assert [one.range_mm for one in taken] == pytest.approx([500.0] * 2, abs=5 * 0.5)
    assert [(one.key, one.purpose, one.scene) for one in captures] == [
        (f"p.1/500mm/{n:02d}/all", "trial", f"p.1/500mm/{n:02d}") for n in (0, 1)
    ]


def test_the_true_range_has_the_scale_of_the_ruler_and_the_measured_tilt() -> None:
    """All lasers 30 to 60 mm beside the axis on one side, as after two of four have failed."""
    ranger, placement = thesis_ranger(), Placement(key="p/1000mm", standoff_mm=1000.0)
    px = positions(ranger, dict.fromkeys(IDS, 1000.0))[2:]
    reading = ranger.read_known("s", 2, list(IDS[2:]), px, np.full((2, 2), 0.03))
    bench = thesis_rig().bench.model_copy(
        update={"ruler_scale": prior(0.003, 0.0005), "target_yaw_deg": 1.0, "target_tilt_sd_deg": 0.5}
    )
    rig = thesis_rig().model_copy(update={"bench": bench})
    taken = reading_taken(rig, ranger.sensor, "p", placement, 0, reading)
    arm_mm = mean_place_mm(ranger.calibration, taken)[0]
    assert 30.0 < arm_mm < 60.0
    assert taken.reference_mm == pytest.approx(1003.0 + tan(radians(1.0)) * arm_mm, abs=0.01)
    assert taken.error_mm == pytest.approx(-3.0 - tan(radians(1.0)) * arm_mm, abs=0.2)
    places_mm = laser_places(ranger.sensor, taken.lasers)[:, 0]
    assert taken.lasers_true_mm == pytest.approx(1003.0 + tan(radians(1.0)) * places_mm, abs=1e-6)
    assert list(taken.laser_errors_mm) == list(IDS[2:])
    errors_mm = list(taken.laser_errors_mm.values())
    assert errors_mm == pytest.approx(-3.0 - tan(radians(1.0)) * places_mm, abs=1e-6)
    assert taken.placement_sd_mm is not None
    assert taken.reference_sd_mm is not None
    common_mm = (taken.reference_sd_mm**2 - taken.placement_sd_mm**2) ** 0.5
    assert common_mm == pytest.approx(hypot(0.5, radians(0.5) * arm_mm), rel=0.01)
