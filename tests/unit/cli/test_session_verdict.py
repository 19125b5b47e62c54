"""Verdict of an ended session from its journal."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.fits import cross_validated, fitted
from tests.support.records import finished, placed
from workbench.cli.session_verdict import CALIBRATE_AGAIN, REPEAT, session_verdict
from workbench.model import event as ev
from workbench.model.errors import LimitFailedError
from workbench.model.fit_event import Fault
from workbench.session.journal import Journal

BEGIN = ev.SessionStarted(session="s", rig="r", procedures=("p",))
WRONG = "the captures at 300 mm fit a standoff of 320 mm. Do: leave it out"


PLACEMENTS = (cross_validated("p.1/300mm", 300.0, 1.0), cross_validated("p.1/600mm", 600.0, -3.0))


def write(folder: Path, *events: ev.Event) -> Path:
    folder = folder / "s"
    folder.mkdir()
    with Journal(folder) as journal:
        for event in (BEGIN, *events):
            journal.append(event)
    return folder


def test_a_finished_calibration_is_accepted_with_the_outcomes_of_fit_and_trials(tmp_path: Path) -> None:
    fit_step = finished(1).model_copy(update={"outcome": "accepted: rms 0.1 px"})
    trial_step = finished(2).model_copy(update={"outcome": "errors agree"})
    other = finished(3).model_copy(update={"outcome": "shown"})
    session = write(tmp_path, fitted(), fit_step, ev.TrialFinished(trial="p.2"), trial_step, other)
    verdict = session_verdict(session, None)
    assert (verdict.word, verdict.headline, verdict.facts) == (
        "ACCEPTED",
        "p: rms 0.1 px",
        ["p: errors agree"],
    )
    assert verdict.notes == ["cx_px is fixed"]
    assert verdict.commands == ()
    assert dict(verdict.labelled)["session:"] == str(session)


def test_a_session_that_decides_nothing_is_done(tmp_path: Path) -> None:
    session = write(tmp_path, ev.TrialFinished(trial="p.1"), finished(1))
    assert session_verdict(session, None).word == "DONE"


@pytest.mark.parametrize("suspect", ["p.1/300mm", None])
def test_a_refused_calibration_has_one_reason_and_a_repair(tmp_path: Path, suspect: str | None) -> None:
    faults = () if suspect is None else (Fault(name="standoff", message=WRONG, placement=suspect),)
    session = write(tmp_path, fitted(WRONG, left_out=PLACEMENTS, faults=faults))
    verdict = session_verdict(session, LimitFailedError("refused: all reasons"))
    assert (verdict.word, verdict.headline) == ("REFUSED", WRONG.partition(". Do:")[0])
    first = verdict.commands[0]
    assert first[:3] == ["workbench", "repair", str(session)]
    # Without a suspect it is the placement with the largest error.
    assert first[first.index("--recapture") + 1] == (suspect or "p.1/600mm")
    assert bool(verdict.action) == (suspect is None), "the commands say the same"


@pytest.mark.parametrize("complete", [False, True])
def test_a_limit_on_captures_is_followed_by_a_resumption(tmp_path: Path, complete: bool) -> None:
    finished_too = [ev.PlacementFinished(key="p.1/300mm")] if complete else []
    session = write(tmp_path, placed("p.1/300mm"), *finished_too)
    verdict = session_verdict(session, LimitFailedError("p.1/300mm/L1: snr: expected at least 9, got 3"))
    assert verdict.word == "REFUSED"
    assert verdict.headline.startswith("p.1/300mm/L1: snr")
    assert verdict.commands[0][:3] == ["workbench", "repair" if complete else "resume", str(session)]
    assert verdict.action == (CALIBRATE_AGAIN if complete else REPEAT)
