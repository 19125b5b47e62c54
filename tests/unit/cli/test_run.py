"""`workbench run`."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.crash.short import CALIBRATION, write_files
from tests.support.command_line import Run, refused
from tests.support.reference_session import REFERENCE
from workbench.calibration.selection import model_terms
from workbench.cli.run import replay_text
from workbench.model.errors import StoppedError
from workbench.model.prompt import Answer, Prompt
from workbench.procedure.engine.repair import Repair, kept_captures
from workbench.procedure.engine.resume import files_now, plan_of
from workbench.report.certificate.identity import operators
from workbench.report.certificate.session_record import read_session
from workbench.session.manifest import load_manifest
from workbench.session.state import placement_captures

ROOT = Path(__file__).parents[3]
WEBCAM_RIG = ROOT / "rigs/webcam-laser.yaml"


def test_a_rig_without_a_driver(workbench: Run, tmp_path: Path) -> None:
    procedure = ROOT / "procedures/calibrate-flat.yaml"
    outcome = workbench("run", procedure, "--rig", WEBCAM_RIG, "--sessions", tmp_path)
    refused(outcome, 2, "webcam-laser: expected `devices`, or a `driver`")


def test_one_procedure_twice(workbench: Run, tmp_path: Path) -> None:
    procedure = ROOT / "procedures/calibrate-flat.yaml"
    outcome = workbench("run", procedure, procedure, "--rig", WEBCAM_RIG, "--sessions", tmp_path)
    refused(outcome, 2, "procedure: ", "got calibrate-flat")
    assert list(tmp_path.iterdir()) == []


def test_the_operator_can_be_a_person(workbench: Run, tmp_path: Path) -> None:
    procedure = tmp_path / "p.yaml"
    procedure.write_text("format: 1\nprocedure: p\ntitle: T\nsteps:\n  - {step: message, text: Hello.}\n")
    rig = ROOT / "rigs/thesis-emulated.yaml"
    options = ("--sessions", tmp_path / "sessions", "--no-view", "--operator", "A. Person")
    assert workbench("run", procedure, "--rig", rig, *options).code == 0
    (session,) = (tmp_path / "sessions").glob("*-p")
    assert operators(read_session(session)) == ["A. Person"]


@pytest.mark.parametrize("name", ["", "  ", "two\nlines", "\udcfc"])
def test_a_name_that_is_none_is_refused(workbench: Run, tmp_path: Path, name: str) -> None:
    procedure = ROOT / "procedures/calibrate-flat.yaml"
    outcome = workbench("run", procedure, "--rig", WEBCAM_RIG, "--operator", name, "--sessions", tmp_path)
    refused(outcome, 2, "--operator")
    assert list(tmp_path.iterdir()) == []


def test_a_request_to_stop_during_the_fit_holds_for_the_question_after_it(
    workbench: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The fit is refused; a person would be asked for a repair, and is not."""
    rig, procedure = write_files(
        tmp_path, CALIBRATION.replace("max_relative_range_sd: 0.5", "max_rms_px: 0.0001")
    )
    reasons = list[str | None]()

    class Person:
        def __init__(self, stopping: Callable[[], str | None]) -> None:
            self.stopping = stopping

        def ask(self, prompt: Prompt) -> Answer:
            reasons.append(self.stopping())
            raise StoppedError("stopped")

    def fit(*arguments: Any) -> object:
        os.kill(os.getpid(), signal.SIGINT)
        return fit_calibration(*arguments)

    fit_calibration = model_terms.fit_calibration
    monkeypatch.setattr(model_terms, "fit_calibration", fit)
    monkeypatch.setattr("workbench.cli.run.choose_operator", lambda *given: Person(given[2]))
    outcome = workbench("run", procedure, "--rig", rig, "--sessions", tmp_path / "s", "--no-view")
    assert outcome.code == 3
    assert reasons == ["stopped by SIGINT"]


def test_a_replay_counts_the_captures_that_are_kept() -> None:
    records = read_session(REFERENCE).all_records
    now, _ = files_now(REFERENCE, load_manifest(REFERENCE))
    plan = plan_of(REFERENCE, now)
    found = {key: len(one.captures) for key, one in placement_captures(records).items() if one.complete}
    first, second, *_ = found
    assert kept_captures(plan, records, None) == found
    kept = kept_captures(plan, records, Repair("because", recapture=(first,), leave_out=(second,)))
    assert kept == {key: count for key, count in found.items() if key not in {first, second}}
    assert replay_text({}) == ""
    (text,) = replay_text({first: found[first]}).splitlines()
    assert f"{found[first]} capture" in text
    assert "1 placement" in text
