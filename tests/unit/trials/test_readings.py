"""Readings of the sensor in a running session."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.exact import calibration_of
from tests.support.running import running, two_laser_rig
from workbench.model.errors import BadInputError
from workbench.model.event import CaptureTaken, ReadingTaken
from workbench.model.target import Placement
from workbench.trials.readings import session_ranger, take_readings

PLACEMENT = Placement(key="p.1/500mm", standoff_mm=500.0)


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
    assert [one.reference_sd_mm for one in taken] == [reference_mm] * 2
    # The placement's error is drawn from the rig's tolerances: 5 of its standard deviations.
    assert [one.range_mm for one in taken] == pytest.approx([500.0] * 2, abs=5 * 0.5)
    assert [(one.key, one.purpose, one.scene) for one in captures] == [
        (f"p.1/500mm/{n:02d}/all", "trial", f"p.1/500mm/{n:02d}") for n in (0, 1)
    ]
