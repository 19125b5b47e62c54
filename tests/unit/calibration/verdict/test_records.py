"""Records of a fit: every value of the arrays, None where not measured, and an event that survives JSON."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.support.rigs import World, thesis_rig
from workbench.calibration.checks.cross_validation import leave_each_out
from workbench.calibration.data.observations import RejectedObservation
from workbench.calibration.estimation.fit import CalibrationFit, fit
from workbench.calibration.verdict.assessment import Assessment, assess, determined_by
from workbench.calibration.verdict.records import fit_finished, parameter_records
from workbench.model.acceptance import Acceptance
from workbench.model.fit_event import FitFinished, Rejected


@pytest.fixture(scope="module")
def fitted() -> CalibrationFit:
    """A fit with one cell without u, and one rejected observation."""
    observations = World(thesis_rig(), 1).observations()
    first = observations[0]
    cell = (first.laser_id, first.placement)
    partial = [
        replace(s, u_px=float("nan")) if (s.laser_id, s.placement) == cell else s for s in observations
    ]
    return fit(thesis_rig(), partial, [RejectedObservation("row 9", "too dark", first)])


@pytest.fixture(scope="module")
def assessment(fitted: CalibrationFit) -> Assessment:
    return assess(fitted, Acceptance(), 0.01, leave_each_out(fitted))


def test_parameters_are_those_of_the_sensor_with_constants(fitted: CalibrationFit) -> None:
    records = parameter_records(fitted)
    sensor = fitted.sensor
    assert [r.name for r in records] == [p.name for p in fitted.table.parameters[sensor]]
    np.testing.assert_array_equal([r.value for r in records], fitted.values[sensor])
    np.testing.assert_array_equal([r.sd for r in records], fitted.sd[sensor])
    np.testing.assert_array_equal([r.data_share for r in records], fitted.data_share[sensor])
    assert tuple(r.determined_by for r in records) == determined_by(fitted)[sensor]
    assert any(r.prior_sd == 0 and r.sd == 0 for r in records)


def test_a_residual_is_a_cell_and_none_where_not_measured(
    fitted: CalibrationFit, assessment: Assessment
) -> None:
    residuals = fit_finished(fitted, assessment).residuals
    assert len(residuals) == len(fitted.cells.laser)
    found = np.array([(r.u_px, r.v_px) for r in residuals], float)
    np.testing.assert_array_equal(found, fitted.residual_px)
    assert [n for n, r in enumerate(residuals) if r.u_px is None] == [0]
    ids, cells = fitted.rig.laser_ids, fitted.cells
    assert [r.laser_id for r in residuals] == [ids[n] for n in cells.laser]
    assert [r.standoff_mm for r in residuals] == [cells.placements[n].standoff_mm for n in cells.placement]


def test_the_event_equals_itself_read_back(fitted: CalibrationFit, assessment: Assessment) -> None:
    """A resumed session compares them: an observation in a rejection would make them differ."""
    event = fit_finished(fitted, assessment)
    assert FitFinished.model_validate_json(event.model_dump_json()) == event
    assert event.rejected == (Rejected("row 9", "too dark"),)
    assert event.left_out == assessment.cross_validation
    assert all(0.0 <= one.spots_p <= 1.0 and one.coordinates > 0 for one in event.left_out)
