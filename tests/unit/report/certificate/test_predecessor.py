"""As found and as left: the change against the calibration before."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.support.reference_session import REFERENCE, record
from workbench.calibration.verdict.comparison import Difference, compare
from workbench.model.calibration import Calibration
from workbench.report.certificate import predecessor
from workbench.report.certificate.predecessor import Predecessor, change_section, load_predecessor


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    found = record().calibration
    assert found is not None
    return found


def shifted(calibration: Calibration, offset_mm: float) -> Calibration:
    """The calibration with another offset of the reference plane."""
    values = calibration.model_dump()
    ours = values["laser_ranger"]
    index = ours["parameters"]["names"].index("offset_mm")
    moved = list(ours["parameters"]["values"])
    moved[index] += offset_mm
    ours["parameters"]["values"] = tuple(moved)
    ours["reference_plane"]["offset_mm"] += offset_mm
    return Calibration.model_validate(values)


def test_the_error_as_found_is_the_change_that_the_calibration_before_lacked(
    calibration: Calibration,
) -> None:
    before = Predecessor("old/calibration.yaml", shifted(calibration, 25.0), "")
    (table,) = change_section(calibration, before).tables
    # A spot seen at the range r by the new calibration is ranged 25 mm nearer by the old one.
    assert [row["mean_mm"] for row in table.records()] == pytest.approx([-25.0] * len(table.rows), rel=1e-3)


def test_the_largest_error_is_that_in_mm_not_in_standard_deviations(
    calibration: Calibration, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = compare(calibration, shifted(calibration, 2.0))
    pair = (Difference("L1", 500.0, -3.0, 3.0), Difference("L2", 500.0, 1.0, 0.1))
    monkeypatch.setattr(predecessor, "compare", lambda *_: replace(found, differences=pair))
    (table,) = change_section(calibration, Predecessor("old", calibration, "")).tables
    (row,) = table.records()
    assert (row["largest_mm"], row["laser_id"], row["expanded_mm"]) == (-3.0, "L1", 6.0)


def test_an_equal_calibration_has_not_changed(calibration: Calibration) -> None:
    section = change_section(calibration, load_predecessor(REFERENCE / "calibration.yaml"))
    assert "same numbers" in section.texts[0]


def test_without_one_before_nothing_is_stated(calibration: Calibration) -> None:
    assert change_section(calibration, None).tables == ()


def test_another_sensor_is_not_compared(calibration: Calibration) -> None:
    other = Path(__file__).parents[4] / "data/session-0.1.0/calibration.yaml"
    section = change_section(calibration, load_predecessor(other))
    assert section.tables == ()
    assert "Not comparable" in section.texts[0]
