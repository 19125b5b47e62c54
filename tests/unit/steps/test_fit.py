"""Step `fit`; its run is tested by whole sessions in tests/bench."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.running import running, two_laser_rig
from tests.support.steps import parse_step, wrong_keys
from workbench.model.errors import BadInputError
from workbench.procedure.engine.step import COMPUTING_S


def test_it_makes_a_fit_of_captures() -> None:
    step, rig = parse_step("step: fit"), two_laser_rig()
    assert (step.needs, step.gives) == ("captures", "fit")
    assert step.captures(rig) == 0
    assert list(step.prompts("p.2", rig)) == []
    assert step.default_duration_s == COMPUTING_S


def test_limits_are_those_of_a_calibration() -> None:
    assert parse_step("step: fit, limits: {max_rms_px: 0.3}").limits.max_rms_px == 0.3
    assert wrong_keys("step: fit, limits: {max_rms_px: 0}") == ["steps[0].limits.max_rms_px"]
    assert wrong_keys("step: fit, limits: {min_standoffs: 2}") == ["steps[0].limits.min_standoffs"]
    assert wrong_keys("step: fit, limits: {rms: 1}") == ["steps[0].limits.rms"]


def test_without_captures_there_is_nothing_to_fit(tmp_path: Path) -> None:
    with running(tmp_path) as session:
        with pytest.raises(BadInputError, match=r"p\.2") as caught:
            parse_step("step: fit").run(session.context, "p.2")
        assert session.events == []
        assert not (session.context.session_dir / "captures.csv").exists()
    assert caught.value.exit_code == 2
