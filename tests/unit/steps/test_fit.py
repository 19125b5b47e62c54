"""Step `fit`; its run is tested by whole sessions in tests/bench."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.support.fits import cross_validated, fitted
from tests.support.running import Scripted, running, two_laser_rig
from tests.support.steps import parse_step, wrong_keys
from workbench.model.errors import BadInputError
from workbench.model.event import FitFinished
from workbench.model.prompt import Answer
from workbench.model.rig import load_rig
from workbench.procedure.engine.step import COMPUTING_S
from workbench.steps.fit import _refusal


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


def test_the_advice_of_a_refusal_names_options_of_repair() -> None:
    alarm = cross_validated("p.1/300mm", 300.0, 9.0, alarm=True)
    text = _refusal(fitted("the captures contradict the others", left_out=(alarm,)))
    assert "--recapture p.1/300mm" in text
    assert "--leave-out p.1/300mm" in text
    assert "--" not in _refusal(fitted("a limit failed"))


RIG = Path(__file__).parents[3] / "rigs/thesis-emulated.yaml"
GRID = "step: capture_grid, standoffs_mm: [300, 500, 800, 1200, 2000], repeats: 1"


@pytest.mark.long_cases
@pytest.mark.parametrize(
    ("skipped", "numbers"),
    [
        ((), []),
        ((500,), ["1", "500", "300", "2000"]),
        ((1200, 2000), ["2", "1200", "2000", "300", "800", "300"]),
    ],
)
def test_skipped_placements_and_the_remaining_validity_are_noted(
    tmp_path: Path, skipped: tuple[int, ...], numbers: list[str]
) -> None:
    skip = Answer(action="skip", reason="no room")
    grid, fit = parse_step(GRID), parse_step("step: fit, limits: {max_placement_scale: 100}")
    operator = Scripted({f"p.1/{standoff}mm": [skip] for standoff in skipped})
    with running(tmp_path, load_rig(RIG), operator) as session:
        session.context.steps = (grid, fit)
        grid.run(session.context, "p.1")
        session.context.step_index = 1
        outcome = fit.run(session.context, "p.2")
        (fitted,) = [event for event in session.events if isinstance(event, FitFinished)]
        calibration = session.context.accepted
    assert calibration is not None
    assert calibration.laser_ranger.fit.warnings == fitted.warnings
    notes = [warning for warning in fitted.warnings if "skipped" in warning]
    assert len(notes) == bool(skipped)
    for note in notes:
        assert re.findall(r"\d+", note)[: len(numbers)] == numbers
        assert note in outcome
