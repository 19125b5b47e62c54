"""Commands offered after a refused calibration or a failed limit: only those that may cure the cause."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.fits import cross_validated, fitted
from tests.support.records import placed, started
from workbench.cli.refusal import failed_limit_commands, repair_commands
from workbench.model import event as ev
from workbench.model.fit_event import REFUSING, Fault, FitFinished, ResidualRecord
from workbench.model.prompt import Answer
from workbench.session.journal import Journal

AT_300, AT_600 = "p.1/300mm", "p.1/600mm"
PLACEMENTS = (cross_validated(AT_300, 300.0, 1.0), cross_validated(AT_600, 600.0, -3.0))
ADVICE = ev.StandoffAdvised(
    placements=2, relative_range_sd=0.1, limit=0.01, next_standoff_mm=5000.0, then_relative_range_sd=0.02
)
SKIP = ev.Answered(key="p.1/800mm", question="800 mm", answer=Answer(action="skip", reason="no room"))


def offered(folder: Path, fit: FitFinished, *before: ev.Event) -> dict[str, list[str]]:
    """Placements or standoffs by the option of the offered commands, in order; `--accept` has its reason."""
    session = folder / "s"
    session.mkdir()
    with Journal(session) as journal:
        for event in (*before, fit):
            journal.append(event)
    found = {}
    for command in repair_commands(session, fit):
        assert command[:3] == ["workbench", "repair", str(session)]
        values = command[4:] if command[3] == "--accept" else command[4 : command.index("--reason")]
        found[command[3]] = [value for value in values if not value.startswith("--")]
    return found


def fault(name: str, placement: str | None = None) -> Fault:
    return Fault(name=name, message="wrong. Do: mend it", placement=placement)


def test_a_failed_limit_may_be_accepted_for_a_reason_that_only_a_person_can_give(tmp_path: Path) -> None:
    found = offered(tmp_path, fitted("rms", left_out=PLACEMENTS), ADVICE)
    assert found == {"--recapture": [AT_600], "--accept": ["TEXT"]}


@pytest.mark.parametrize("name", REFUSING)
def test_a_named_fault_is_neither_accepted_nor_cured_by_another_standoff(tmp_path: Path, name: str) -> None:
    fit = fitted("wrong", left_out=PLACEMENTS, faults=(fault(name, AT_300),))
    assert offered(tmp_path, fit, ADVICE, SKIP) == {"--recapture": [AT_300], "--leave-out": [AT_300]}


def test_no_repair_of_placements_cures_a_fault_of_the_whole_session(tmp_path: Path) -> None:
    alarm = cross_validated(AT_300, 300.0, 9.0, alarm=True)
    fit = fitted("wrong", left_out=(alarm,), faults=(fault("lasers_swapped"),))
    assert offered(tmp_path, fit, ADVICE, SKIP) == {}


def test_a_fault_that_is_a_note_does_not_count(tmp_path: Path) -> None:
    fit = fitted("rms", left_out=PLACEMENTS, faults=(fault("saturated"),))
    assert list(offered(tmp_path, fit)) == ["--recapture", "--accept"]


def test_a_contradicting_placement_is_captured_again_or_left_out(tmp_path: Path) -> None:
    alarm = cross_validated(AT_300, 300.0, 9.0, alarm=True)
    fit = fitted("contradicts", left_out=(alarm, PLACEMENTS[1]), needs_standoffs=True)
    found = offered(tmp_path, fit, ADVICE)
    assert found == {"--recapture": [AT_300], "--leave-out": [AT_300], "--accept": ["TEXT"]}


def test_too_few_standoffs_are_cured_by_those_skipped_and_by_further_ones(tmp_path: Path) -> None:
    fit = fitted("too few", left_out=PLACEMENTS, needs_standoffs=True)
    found = offered(tmp_path, fit, ADVICE, SKIP)
    assert found == {"--restore": ["p.1/800mm"], "--add": ["5000"], "--accept": ["TEXT"]}


def test_a_placement_that_was_skipped_and_then_captured_is_not_restored(tmp_path: Path) -> None:
    own = ResidualRecord(
        laser_id="L1", standoff_mm=800, u_px=0.1, v_px=0.1, u_sd_px=0.1, v_sd_px=0.1, placement=SKIP.key
    )
    fit = fitted("too few", needs_standoffs=True).model_copy(update={"residuals": (own,)})
    assert list(offered(tmp_path, fit, SKIP)) == ["--accept"]


def reading(key: str, range_mm: float | None) -> ev.ReadingTaken:
    return ev.ReadingTaken(
        trial="p.2",
        scene=f"{key}/00",
        standoff_mm=500.0,
        reading=0,
        status="done",
        range_mm=range_mm,
        sigma_mm=1.0,
        reference_sd_mm=0.5,
        lasers=(),
    )


def visited(key: str, range_mm: float | None) -> list[ev.Event]:
    return [placed(key), reading(key, range_mm), ev.PlacementFinished(key=key)]


@pytest.mark.parametrize(
    ("events", "words"),
    [
        ([*visited("a", 501.0), *visited("b", 480.0), *visited("c", 502.0)], ["repair", "--recapture", "b"]),
        ([*visited("a", 501.0), *visited("b", 480.0), *visited("c", None)], ["repair", "--recapture", "c"]),
        ([*visited("a", 501.0), placed("b")], ["resume"]),
        ([SKIP], ["repair", "--restore", SKIP.key]),
    ],
    ids=["largest error", "no range", "unfinished", "skipped"],
)
def test_a_failed_trial_is_repaired_where_a_resumption_would_compute_the_same(
    events: list[ev.Event], words: list[str]
) -> None:
    (command,) = failed_limit_commands(
        Path("s"), [started(1, 4), *visited("grid", 0.0), started(2, 4), *events]
    )
    assert [word for word in command[1:] if word != "s"][: len(words)] == words


def test_a_step_without_placements_has_no_command() -> None:
    assert failed_limit_commands(Path("s"), [started(1, 4), *visited("grid", 0.0), started(2, 0)]) == []
