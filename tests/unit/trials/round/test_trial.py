"""The run of the round trial on the noise-free bench."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.support.four_lasers import calibrated, finished, reading
from tests.support.steps import parse_step
from workbench.model.event import TrueValues
from workbench.trials.round.trial import cylinder_statistics, radius_statistics
from workbench.trials.targets import CylinderSpec

TARGET = CylinderSpec(kind="cylinder", diameter_mm=178.0, diameter_sd_mm=0.4)
TRUE = TrueValues(range_mm=300.0, range_sd_mm=0.3, radius_mm=89.0, radius_sd_mm=0.2)


def test_radius_and_range_are_those_of_the_fitted_cylinder() -> None:
    readings = [
        reading(
            TRUE, range_mm=299.0, radius_mm=90.0, radius_sd_mm=0.6, cylinder_mm=300.2, cylinder_sd_mm=0.4
        ),
        reading(TRUE, range_mm=299.0),
    ]
    radius, by_cylinder = radius_statistics(TARGET, readings), cylinder_statistics(readings)
    assert (radius.n, radius.missing) == (1, 1)
    assert radius.mean == pytest.approx(1.0)
    assert radius.expanded == pytest.approx(2 * np.hypot(0.6, 0.2))
    assert by_cylinder.mean == pytest.approx(0.2)
    assert by_cylinder.expanded == pytest.approx(2 * np.hypot(0.4, 0.3))


def test_a_cylinder_is_ranged_by_its_own_shape(tmp_path: Path) -> None:
    text = "step: round_trial, ranges_mm: [200, 300], readings: 2, target: {kind: cylinder, diameter_mm: 178}"
    with calibrated(tmp_path) as session:
        parse_step(text).run(session.context, "p.1")
        tables = {
            suffix: pd.read_csv(session.context.session_dir / f"p.1{suffix}.csv")
            for suffix in ("", "-cylinder", "-radius")
        }
        event = finished(session)
    assert tables[""]["true_mm"].tolist() == [200.0, 300.0]
    # The centroid of a spot on an inclined surface is off by some hundredths of a pixel.
    assert tables["-cylinder"]["mean_error_mm"].abs().max() < 0.3
    assert tables["-radius"]["mean_error_mm"].abs().max() < 1.5
    assert [chart.name for chart in event.charts] == ["p.1-errors", "p.1-radii"]
    assert [table.name for table in event.tables] == ["p.1", "p.1-cylinder", "p.1-radius"]
