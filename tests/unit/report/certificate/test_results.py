"""Sections on calibration, uncertainty, validation and trials; of many lasers they stay legible."""

from __future__ import annotations

import pytest

from tests.support.reference_session import record
from workbench.model import event as ev
from workbench.report.certificate.range_uncertainty import range_uncertainties, table_mm
from workbench.report.certificate.results import (
    calibration_section,
    trial_sections,
    uncertainty_section,
    validation_section,
)


def test_null_directions_are_given_in_words() -> None:
    session = record()
    section = calibration_section(session, session.calibration)
    assert session.fit is not None
    assert section.texts == session.fit.warnings
    assert {table.name for table in section.tables} == {"parameters", "terms"}
    assert {row["determined_by"] for row in section.tables[0].records()} <= {"data", "joint", "prior"}


def test_a_session_without_calibration_states_that() -> None:
    assert len(uncertainty_section(None, ()).texts) == 1
    assert validation_section(None).charts == ()


def test_uncertainty_has_its_coverage_factor() -> None:
    calibration = record().calibration
    assert calibration is not None
    section = uncertainty_section(calibration, range_uncertainties(calibration, table_mm(calibration)))
    assert "95.45 %" in section.texts[0]
    assert [chart.name for chart in section.charts] == ["range_uncertainty"]


def test_a_trial_has_its_tables_and_its_outcome() -> None:
    (section,) = trial_sections(record())
    assert section.facts[0].value.startswith("6 readings")
    assert {table.name for table in section.tables} == {
        "reference.6-verdict",
        "reference.6",
        "reference.6-bias",
        "reference.6-budget",
    }
    assert [chart.name for chart in section.charts] == ["reference.6-errors"]


@pytest.mark.parametrize("lasers", [9, 100])
def test_residuals_of_many_lasers_are_summarised(lasers: int) -> None:
    fit = record().fit
    assert fit is not None
    residuals = tuple(
        one.model_copy(update={"laser_id": f"L{n}", "u_px": float(n)})
        for n in range(lasers)
        for one in fit.residuals
    )
    errors = tuple(ev.LaserError(laser_id=f"L{n}", error_mm=1.0, sd_mm=1.0) for n in range(lasers))
    left_out = tuple(one.model_copy(update={"lasers": errors}) for one in fit.left_out)
    section = validation_section(fit.model_copy(update={"residuals": residuals, "left_out": left_out}))
    chart = section.charts[0]
    assert [len(one.x) for one in chart.series] == [6]
    assert set(chart.bands[0].low) == {0.0}
    assert set(chart.bands[0].high) == {lasers - 1.0}
    assert len(section.tables[0].columns) < 8
