"""Section on verifications: limits and alarm of each chart."""

from __future__ import annotations

import numpy as np
import pytest

from tests.unit.report.history.test_drift import checked
from workbench.report.history.drift import distance_histories
from workbench.report.history.verification_section import verification_section


def test_limits_and_alarm_are_those_of_the_chart() -> None:
    errors = np.random.default_rng(1).normal(0.0, 0.001, 20)
    errors[15:] += 0.02
    sessions = checked(errors)
    (history,) = distances = distance_histories(sessions)
    section = verification_section(sessions, distances)
    xbar = next(chart for chart in section.charts if chart.name == "xbar_500mm")
    assert history.chart is not None
    half = 100 * history.chart.limits.half_width
    lines = sorted(line.y for line in xbar.limits)
    assert (lines[2] - lines[0]) / 2 == pytest.approx(half)
    assert xbar.flagged_x == (15 * 30.0,)
    assert len(section.tables[0].rows) == 20
