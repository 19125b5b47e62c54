"""The run of a verification on the noise-free bench."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from tests.support.exact import calibration_of
from tests.support.four_lasers import calibrated, finished
from tests.support.steps import parse_step
from workbench.model.calibration import Calibration
from workbench.model.errors import BadInputError, LimitFailedError
from workbench.model.event import TargetPlaced, TrialProgress

TEXT = "step: verify_trial, standoffs_mm: [300, 500], readings: 2, reference_sd_mm: 0.5"
SPOT_SD_PX = 0.05


def with_noise(calibration: Calibration, **laser: float) -> Calibration:
    """The calibration with noise of a real spot, and with another direction of L2."""
    own = calibration.laser_ranger
    noise = own.noise.model_copy(update={"spot_sd_px": SPOT_SD_PX, "speckle_sd_px": SPOT_SD_PX})
    lasers = tuple(
        one.model_copy(update={"direction": (laser.get(one.id, 0.0), 0.0, 1.0)}) for one in own.lasers
    )
    return calibration.model_copy(
        update={"laser_ranger": own.model_copy(update={"noise": noise, "lasers": lasers})}
    )


def test_a_valid_calibration_is_kept(tmp_path: Path) -> None:
    with calibrated(tmp_path) as session:
        session.context.calibration = with_noise(calibration_of(session.context.rig))
        parse_step(TEXT).run(session.context, "p.1")
        rows = pd.read_csv(session.context.session_dir / "p.1.csv")
        verdict = pd.read_csv(session.context.session_dir / "p.1-verdict.csv")
        event = finished(session)
        assert any(isinstance(one, TrialProgress) for one in session.events)
    assert rows["standoff_mm"].tolist() == [300.0, 500.0]
    assert (rows["error_mm"].abs() <= rows["expanded_mm"]).all()
    assert verdict["valid"].tolist() == ["yes"]
    assert [chart.name for chart in event.charts] == ["p.1-errors"]


def test_a_laser_that_has_turned_ends_it_before_a_target_is_measured(tmp_path: Path) -> None:
    with calibrated(tmp_path) as session:
        session.context.calibration = with_noise(calibration_of(session.context.rig), L2=0.003)
        with pytest.raises(LimitFailedError) as caught:
            parse_step(TEXT).run(session.context, "p.1")
        placed = [one.placement.key for one in session.events if isinstance(one, TargetPlaced)]
        verdict = pd.read_csv(session.context.session_dir / "p.1-verdict.csv")
    assert caught.value.exit_code == 3
    assert placed == ["p.1/unmeasured-600mm"]
    assert verdict["valid"].tolist() == ["NO"]


def test_a_calibration_without_its_bench_is_refused_before_a_target_is_placed(tmp_path: Path) -> None:
    with calibrated(tmp_path) as session:
        session.context.calibration = with_noise(calibration_of(session.context.rig))
        with pytest.raises(BadInputError):
            parse_step(f"{TEXT}, same_bench: true").run(session.context, "p.1")
        assert not any(isinstance(one, TargetPlaced) for one in session.events)
