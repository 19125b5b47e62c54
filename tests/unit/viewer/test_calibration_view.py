"""Recording of a calibration file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.viewer.readback import Contents, layout_views
from workbench.model.calibration import Calibration, load_calibration
from workbench.model.fit_tables import calibration_parameter_table
from workbench.sensor.calibrated import CalibratedSensor
from workbench.viewer.calibration_view import record_calibration, uncertainty_chart, verdict_text
from workbench.viewer.table_text import table_text

FILE = Path(__file__).parents[3] / "data/session-0.1.0/calibration.yaml"


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    return load_calibration(FILE)


def test_every_view_has_content(calibration: Calibration, tmp_path: Path) -> None:
    out = record_calibration(calibration, "c", tmp_path / "c.rrd")
    contents = Contents(out)
    assert all(contents.below(view.origin) for view in layout_views(out))
    table = calibration_parameter_table(calibration.laser_ranger.parameters)
    assert contents.static("/calibration/parameters", "TextDocument:text") == [[table_text(table)]]


def test_the_chart_has_the_uncertainty_of_each_laser_in_per_cent(calibration: Calibration) -> None:
    sensor = CalibratedSensor(calibration)
    chart = uncertainty_chart(sensor)
    assert [series.name for series in chart.series] == list(sensor.ids)
    for series in chart.series:
        x, y = np.array(series.x), np.array([np.nan if v is None else v for v in series.y])
        inside = np.isfinite(y)
        assert inside.any()
        expected = 100.0 * sensor.relative_range_sd(series.name, x[inside])
        np.testing.assert_allclose(y[inside], expected)


def test_the_verdict_names_sensor_and_validity(calibration: Calibration) -> None:
    ranger = calibration.laser_ranger
    text = verdict_text(calibration)
    assert ranger.provenance.serial in text
    for standoff_mm in ranger.validity.standoff_mm:
        assert f"{standoff_mm:g}" in text
