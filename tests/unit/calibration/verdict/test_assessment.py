"""The verdict on a fit: limits, faults, and what makes it accepted or refused."""

from __future__ import annotations

import pytest

from tests.support.rigs import World, thesis_rig
from workbench.calibration.estimation.fit import CalibrationFit, fit
from workbench.calibration.verdict.assessment import Assessment, judge
from workbench.model.acceptance import Acceptance


@pytest.fixture(scope="module")
def fitted() -> CalibrationFit:
    return fit(thesis_rig(), World(thesis_rig(), 1).observations())


def judged(fitted: CalibrationFit, worst: float = 0.01, **limits: float) -> Assessment:
    return judge(fitted, Acceptance.model_validate(limits), worst)


def test_limits_that_fail_are_named(fitted: CalibrationFit) -> None:
    assert "expected at most 0.001 px" in judged(fitted, max_rms_px=0.001).reasons[0]
    assert "up to 30 % of it, expected at most 5 %" in judged(fitted, worst=0.3).reasons[0]
    assert "seen at 11 standoffs, expected at least 12" in judged(fitted, min_standoffs=12).reasons[1]
    assert judged(fitted, worst=float("nan")).verdict == "refused"


def test_a_laser_that_never_lit_is_named() -> None:
    rig = thesis_rig()
    observations = [s for s in World(rig, 1).observations(repeats=1) if s.laser_id != "L2"]
    (reason,) = judged(fit(rig, observations)).reasons
    assert reason.startswith("laser L2 never lit: no capture is of it. Do: check its supply")
